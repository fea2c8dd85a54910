"""The verbs that integrate nothing: classify, scenes, derive and doctor."""

import pytest

import heavytop as ht
from heavytop.cli import Exit
from heavytop.equations.derivation import as_latex, as_text, derivation
from heavytop.scene.shipped import shipped_scenes

from ..commands import document, printed, refused

# --- classify ---------------------------------------------------------------------------


@pytest.mark.parametrize("name", shipped_scenes())
def test_every_scene_is_classified(name):
    said, read = printed("classify", name), ht.load_scene(name)
    assert f"{ht.Motion(read.top, read.start).kind}, proved" in said
    assert not any(word in said for word in ("nan", "None"))


# --- scenes --------------------------------------------------------------------------------------


def test_scenes_are_listed_and_printed_as_json():
    assert "sicm-kicked" in printed("scenes")
    for key, found in (("scenes", document("scenes")), ("text", document("scenes", "sleeping"))):
        assert found["schema"] == "heavytop/scenes/1"
        assert found[key]


# --- derive and doctor ---------------------------------------------------------------------------


def test_derive_prints_text_latex_or_json():
    steps = derivation()
    for words, text in ((("derive",), as_text(steps)), (("derive", "--latex"), as_latex(steps))):
        assert printed(*words).rstrip("\n") == text.rstrip("\n")
    assert [each["name"] for each in document("derive")["steps"]] == [each.name for each in steps]


def test_doctor_names_what_is_missing(monkeypatch):
    assert f"heavytop     {ht.__version__}" in printed("doctor")
    assert document("doctor")["schema"] == "heavytop/doctor/2"
    monkeypatch.setattr("heavytop.doctor.requirements", lambda: {"": ["no-such-package"]})
    assert "no-such-package" in refused(Exit.OUT_OF_BOUND, "doctor")
