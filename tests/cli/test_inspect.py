"""The verbs that integrate nothing: classify, plan, scenes, derive and doctor."""

import json
import subprocess
import sys

import pytest

import heavytop as ht
from heavytop.cli import Exit
from heavytop.equations.derivation import as_latex, as_text, derivation
from heavytop.scene.scene import load_scene
from heavytop.scene.shipped import shipped_scenes

from ..commands import heavytop_

# --- classify and plan ---------------------------------------------------------------------------


@pytest.mark.parametrize("name", shipped_scenes())
def test_every_scene_is_classified_and_planned_and_can_be_taken_over(name, tmp_path):
    """What `heavytop scenes NAME` prints is a file of the same scene."""
    result = heavytop_("classify", name)
    assert result.exit_code == 0, result.stderr
    read = load_scene(name)
    assert f"{ht.Motion(read.top, read.start).kind}, proved" in result.stdout
    assert not any(word in result.stdout for word in ("nan", "None"))
    assert heavytop_("plan", name).exit_code == 0
    path = tmp_path / "mine.toml"
    path.write_text(heavytop_("scenes", name).stdout, "utf-8")
    assert load_scene(path) == read


def test_what_is_not_proved_is_said():
    """√cos²2 is −cos 2, and no identity that the package knows shows it."""
    nothing = "start.phidot=sqrt(cos(2)^2) + cos(2)"
    for verb in ("classify", "run"):
        result = heavytop_(verb, "sicm-kicked", "--set", nothing)
        assert result.exit_code == 0, result.stderr
        assert "undecided" in result.stdout
        assert "proved;" not in result.stdout


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


# --- what is imported ----------------------------------------------------------------------------


@pytest.mark.processes
@pytest.mark.parametrize("words", [["classify", "sicm-kicked"], ["doctor"]])
def test_neither_the_integrator_nor_the_symbols_are_imported(words):
    code = (
        "import sys\nfrom heavytop.cli import app\n"
        f"try: app({words!r})\nfinally: print(*sys.modules, file=sys.stderr)"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert result.stdout
    slow = {"heyoka", "sympy", "scipy", "matplotlib", "xarray"}
    assert slow.isdisjoint(result.stderr.split())
