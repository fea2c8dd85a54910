"""The verbs that integrate nothing: classify, plan, scenes, derive and doctor."""

import json

import pytest

import heavytop as ht
from heavytop.cli import Exit
from heavytop.equations.derivation import as_latex, as_text, derivation
from heavytop.scene.shipped import shipped_scenes

from ..commands import heavytop_

# --- classify and plan ---------------------------------------------------------------------------


@pytest.mark.parametrize("name", shipped_scenes())
def test_every_scene_is_classified_and_planned_and_can_be_taken_over(name, tmp_path):
    """What `heavytop scenes NAME` prints is a file of the same scene."""
    result = heavytop_("classify", name)
    assert result.exit_code == 0, result.stderr
    read = ht.load_scene(name)
    assert f"{ht.Motion(read.top, read.start).kind}, proved" in result.stdout
    assert not any(word in result.stdout for word in ("nan", "None"))
    assert heavytop_("plan", name).exit_code == 0
    path = tmp_path / "mine.toml"
    path.write_text(heavytop_("scenes", name).stdout, "utf-8")
    assert ht.load_scene(path) == read


# --- scenes --------------------------------------------------------------------------------------


def test_scenes_are_listed_and_printed_as_json():
    assert "sicm-kicked" in heavytop_("scenes").stdout
    for words, key in ((("scenes",), "scenes"), (("scenes", "sicm-kicked"), "text")):
        document = json.loads(heavytop_(*words, "--json").stdout)
        assert document["schema"] == "heavytop/scenes/1"
        assert document[key]


# --- derive and doctor ---------------------------------------------------------------------------


def test_derive_prints_text_latex_or_json():
    steps = derivation()
    assert heavytop_("derive").stdout.rstrip("\n") == as_text(steps).rstrip("\n")
    assert heavytop_("derive", "--latex").stdout.rstrip("\n") == as_latex(steps).rstrip("\n")
    document = json.loads(heavytop_("derive", "--json").stdout)
    assert [each["name"] for each in document["steps"]] == [each.name for each in steps]


def test_doctor_names_what_is_missing(monkeypatch):
    found = heavytop_("doctor")
    assert found.exit_code == 0
    assert f"heavytop     {ht.__version__}" in found.stdout
    assert json.loads(heavytop_("doctor", "--json").stdout)["schema"] == "heavytop/doctor/2"
    monkeypatch.setattr("heavytop.doctor.requirements", lambda: {"": ["no-such-package"]})
    missing = heavytop_("doctor")
    assert missing.exit_code == Exit.OUT_OF_BOUND
    assert "no-such-package" in missing.stderr
