"""What ``heavytop classify`` promises: what it says, what it imports, and what it refuses."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from decimal import Decimal
from typing import Any

import pytest
from typer.testing import CliRunner, Result

import heavytop as ht
import heavytop.results.classification
from heavytop.cli import Exit, app
from heavytop.report.run import between
from heavytop.scene.scene import shipped_scenes

# This is 0, as the square of √2 + √3 is 5 + 2√6, and no identity that the package knows shows it.
NOTHING = "sqrt(5 + 2*sqrt(6)) - sqrt(2) - sqrt(3)"
THRESHOLD = "2*sqrt(3.28e-4*0.0456)/6.60e-5"


def classify(scene: object, *options: object) -> Result:
    return CliRunner().invoke(app, ["classify", str(scene), *map(str, options)])


def changed(**changes: object) -> list[str]:
    """Options that change a scene: top__A=1 is --set top.A=1."""
    pairs = (f"{key.replace('__', '.')}={value}" for key, value in changes.items())
    return [word for pair in pairs for word in ("--set", pair)]


def document(scene: object, *options: object) -> dict[str, Any]:
    result = classify(scene, "--json", *options)
    assert result.exit_code == 0, result.stderr
    assert result.stderr == ""
    found: dict[str, Any] = json.loads(result.stdout, parse_constant=no_such_constant)
    return found


def no_such_constant(name: str) -> float:
    raise AssertionError(f"{name} in JSON")


class TestDocument:
    def test_its_parts(self):
        found = document("sicm-kicked")
        assert list(found) == [
            "schema", "command", "scene", "motion", "constants", "facts", "enclosure",
        ]  # fmt: skip
        assert found["schema"] == "heavytop/classify/1"
        assert list(found["motion"]) == [
            "kind", "tags", "certified", "margin", "theta_min", "theta_max", "period",
            "precession", "spin", "why", "margin_enclosure", "open_tags", "bound",
        ]  # fmt: skip
        assert list(found["constants"]) == ["E", "E_prime", "p_phi", "p_psi"]
        assert list(found["enclosure"]) == [
            "roots", "theta_min", "theta_max", "period", "precession", "spin",
        ]  # fmt: skip

    @pytest.mark.parametrize("scene", ["sicm-kicked", "sicm-dropped", "steady-fast", "sleeping"])
    def test_a_run_says_the_same(self, scene):
        result = CliRunner().invoke(app, ["run", scene, "--json"])
        ran, known = json.loads(result.stdout), document(scene)
        assert ran["motion"] == {name: known["motion"][name] for name in ran["motion"]}
        assert (ran["scene"], ran["constants"]) == (known["scene"], known["constants"])

    @pytest.mark.parametrize("scene", shipped_scenes())
    def test_every_number_lies_in_its_enclosure(self, scene):
        found = document(scene)
        motion = found["motion"]
        low, high = motion["margin_enclosure"]
        assert low <= motion["margin"] <= high
        for name in ("theta_min", "theta_max", "period", "precession", "spin"):
            bounds = found["enclosure"][name]
            assert (bounds is None) == (motion[name] is None), name
            if bounds is not None:
                low, high = map(float, bounds)
                assert low - abs(low) * 1e-15 <= motion[name] <= high + abs(high) * 1e-15, name

    def test_set_changes_the_scene(self):
        assert document("sicm-kicked", *changed(start__phidot=0))["motion"]["kind"] == "cusps"
        tiny = document("sicm-kicked", *changed(start__phidot="1e-40"))["motion"]
        assert (tiny["kind"], tiny["certified"]) == ("waves", True)


class TestTable:
    def test_says_all_of_it(self):
        text = classify("sicm-kicked").stdout
        for line in (
            "loops, proved",
            "|p_phi| < |p_psi| and E' > gMR p_phi/p_psi",
            "0.1 and 0.5172313182384348 rad",
            "0.54289551818821996 s",
            "-15 to 12.338715433 rad/s",
            "reverses at θ = 0.148027354547 rad",
            "from |ω₃| = 117.194006936 rad/s on",
        ):
            assert line in text

    @pytest.mark.parametrize("scene", shipped_scenes())
    def test_every_scene_has_one(self, scene):
        result = classify(scene)
        assert result.exit_code == 0, result.stderr
        kind = str(ht.Motion(ht.load_scene(scene).top, ht.load_scene(scene).start).kind)
        assert f"{kind}, proved" in result.stdout
        assert "nan" not in result.stdout
        assert "None" not in result.stdout

    def test_tags_and_constant_tilt(self):
        text = classify("steady-betsch").stdout
        assert "slow, closed-orbit" in text
        assert "1.0471975511965977 rad (60.00°), constant" in text

    def test_quiet_and_verbose(self):
        assert classify("sleeping", "-q").stderr == ""
        assert "sleeping" in classify("sleeping", "-v").stderr

    @pytest.mark.parametrize(
        ("bounds", "shown"),
        [
            (("0", "0"), "0"),
            (("-1e-30", "1e-30"), "0"),
            (("0.09999999999999999999999", "0.1000000000000000000001"), "0.1"),
            (("3.141592653589793238462", "3.141592653589793238463"), "3.1415926535897932"),
            (("0.1234", "0.1240"), "0.124"),
            (("1.588154609233922e-151", "1.588154609233924e-151"), "1.58815460923392e-151"),
            (("-4283.68206602", "-4283.68206600"), "-4283.682066"),
            (("1e300", "1e300"), "1e+300"),
        ],
    )
    def test_no_digit_is_shown_that_is_not_known(self, bounds, shown):
        text = between(*bounds)
        assert text == shown
        unit = Decimal(1).scaleb(Decimal(text).as_tuple().exponent)
        assert all(abs(Decimal(text) - Decimal(bound)) <= unit for bound in bounds)


class TestUndecided:
    """A number that is 0, which cannot be proved, is no failure: what is known of it is said."""

    def test_the_document(self):
        motion = document("sicm-kicked", *changed(start__phidot=NOTHING))["motion"]
        assert (motion["kind"], motion["certified"]) == ("undecided", False)
        assert 0 < Decimal(motion["bound"]) < Decimal("1e-1000")

    def test_the_table(self):
        result = classify("sicm-kicked", *changed(start__phidot=NOTHING))
        assert result.exit_code == 0
        assert "undecided, |x| < " in result.stdout
        assert "proved;" not in result.stdout

    def test_a_run_says_so_too(self):
        options = changed(start__phidot=NOTHING)
        result = CliRunner().invoke(app, ["run", "sicm-kicked", *options])
        assert result.exit_code == 0, result.stderr
        assert "undecided" in result.stdout


class TestWhatItImports:
    @pytest.mark.processes
    def test_neither_the_integrator_nor_the_symbols(self):
        code = (
            "import sys\n"
            "from heavytop.cli import app\n"
            "app(['classify', 'sicm-kicked'], standalone_mode=False)\n"
            "print(*sys.modules, file=sys.stderr)"
        )
        result = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        )
        assert "loops" in result.stdout
        slow = {"heyoka", "sympy", "scipy", "matplotlib", "xarray"}
        assert slow.isdisjoint(result.stderr.split())


BAD = [
    (["sicm-kiked"], Exit.BAD_SCENE, "sicm-kicked"),
    (["/"], Exit.BAD_SCENE, "directory"),
    (["no\0name"], Exit.BAD_SCENE, ""),
    ([], Exit.USAGE, "SCENE"),
    (["sicm-kicked", "--no-such-option"], Exit.USAGE, "no-such-option"),
    (["sicm-kicked", "-o", "out"], Exit.USAGE, "-o"),
    (["sicm-kicked", "--set", "start.phidot"], Exit.USAGE, "KEY=VALUE"),
    *(
        (["sicm-kicked", *changed(**change)], Exit.USAGE, rule)
        for change, rule in (
            ({"top__A": 0}, "greater than 0"),
            ({"top__gMR": "nan"}, "finite"),
            ({"start__phidto": 1}, "unknown key"),
        )
    ),
]


class TestBadInput:
    @pytest.mark.parametrize(("arguments", "code", "said"), BAD)
    @pytest.mark.parametrize("json_too", [False, True])
    def test_is_refused_by_name(self, arguments, code, said, json_too):
        options = ["--json"] if json_too else []
        result = CliRunner().invoke(app, ["classify", *arguments, *options])
        assert result.exit_code == code
        assert result.stdout == ""
        assert said in result.stderr
        assert "Traceback" not in result.stderr

    def test_impossible_constants(self, tmp_path):
        path = tmp_path / "impossible.toml"
        path.write_text(
            "format = 1\n[top]\nA = 1\nC = 1\ngMR = 1\n[span]\ntime = 1\n[start]\n"
            'E = 0\np_phi = 1\np_psi = 1\ntheta = 1\nbranch = "falling"\n',
            encoding="utf-8",
        )
        result = classify(path)
        assert result.exit_code == Exit.BAD_SCENE
        assert f"{path}:9: start.E" in result.stderr
        assert "at least" in result.stderr

    def test_steady_where_nothing_is_steady(self):
        result = classify("steady-betsch", *changed(start__omega3=1))
        assert result.exit_code == Exit.USAGE
        assert "at least" in result.stderr

    @pytest.mark.parametrize(
        ("error", "code"),
        [(KeyboardInterrupt(), Exit.INTERRUPTED), (ZeroDivisionError("by nothing"), Exit.BUG)],
    )
    def test_what_fails_inside(self, monkeypatch, error, code):
        def fail(_):
            raise error

        monkeypatch.setattr(heavytop.results.classification, "classified", fail)
        result = classify("sicm-kicked")
        assert result.exit_code == code
        assert "Traceback" not in result.stderr
        assert ("Traceback" in classify("sicm-kicked", "--debug").stderr) is True


EXTREME = [
    {"start__psidot": 0, "start__phidot": 0},
    {"start__omega3": 0},
    {"top__gMR": 0},
    {"top__gMR": 0, "start__theta": 0, "start__thetadot": 3},
    {"top__gMR": 0, "start__psidot": 0, "start__phidot": 0},
    {"start__theta": 0},
    {"start__theta": "pi"},
    {"start__theta": "pi", "start__thetadot": 3},
    {"start__theta": "pi", "start__phidot": "1e300"},
    {"start__theta": 0, "start__thetadot": "1e-300"},
    {"start__theta": 0, "start__psidot": 0, "start__phidot": 0},
    {"start__theta": "1e-300"},
    {"start__theta": "pi - 1e-300"},
    {"start__theta": "pi/2", "start__omega3": 0},
    {"top__gMR": "1e300"},
    {"top__gMR": "-1e300"},
    {"top__A": "1e-300", "top__C": "1e-300"},
    {"top__A": "1e-300", "top__C": "1e-300", "top__gMR": "1e300"},
    {"top__C": "1e-300"},
    {"start__phidot": "1e300"},
    {"start__psidot": "1e300"},
    {"start__thetadot": "1e300"},
    {"start__phi": "1e300", "start__psi": "-1e300"},
    {"start__theta": 0, "start__omega3": THRESHOLD},
    {"start__theta": 0, "start__omega3": f"{THRESHOLD} + 1e-100"},
    {"start__theta": 0, "start__omega3": THRESHOLD, "start__thetadot": "1e-50"},
    {"want__digits": 5000},
]


class TestExtremes:
    """A number that is possible is classified, however odd: no NaN, no bug, within a second."""

    @pytest.mark.parametrize("change", EXTREME, ids=str)
    def test_has_a_verdict_and_a_table(self, change):
        found = document("sicm-kicked", *changed(**change))
        motion = found["motion"]
        assert motion["certified"]
        assert motion["kind"] != "undecided"
        assert 0 <= motion["margin"] <= 1
        assert all(math.isfinite(value) for value in numbers_in(found))
        result = classify("sicm-kicked", *changed(**change))
        assert result.exit_code == 0, result.stderr
        assert not any(word in result.stdout for word in ("nan", "inf ", "None"))


def numbers_in(value: object) -> list[float]:
    if isinstance(value, dict):
        return [x for each in value.values() for x in numbers_in(each)]
    if isinstance(value, list):
        return [x for each in value for x in numbers_in(each)]
    return [float(value)] if isinstance(value, int | float) and not isinstance(value, bool) else []


def test_a_mean_rate_outside_its_range_says_why():
    """φ jumps by π at a pole: its mean rate holds that, its rates do not."""
    told = " ".join(classify("through-top").stdout.split())
    assert told.count("with its jumps by π at the pole") == 2
    assert "jumps" not in classify("sicm-kicked").stdout
