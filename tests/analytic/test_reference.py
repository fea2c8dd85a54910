"""Exact values as files: every digit is proved."""

import json
from decimal import Decimal
from fractions import Fraction

import pytest

from heavytop import ForeignFile, Motion, load_scene
from heavytop.analytic.reference import EVENT_QUANTITIES, read_times, reference
from heavytop.scene.scene_file import shipped_scenes

from ..commands import document, printed

KICKED = load_scene("sicm-kicked")


def unit(text):
    """One unit of the last digit of a decimal."""
    return Fraction(Decimal(1).scaleb(Decimal(text).as_tuple().exponent))


def off(text, finer):
    """How far a decimal is from a finer one, in units of its last digit."""
    return abs(Fraction(text) - Fraction(finer)) / unit(text)


@pytest.mark.parametrize("name", shipped_scenes())
def test_every_digit_is_that_of_a_finer_computation(name):
    scene = load_scene(name)
    coarse, fine = (reference(scene, "-0.3:1.7:0.5", list(EVENT_QUANTITIES), n) for n in (12, 40))
    for column, texts in coarse.columns.items():
        for text, finer in zip(texts, fine.columns[column], strict=True):
            assert off(text, finer) <= 1, column
            assert column == "t" or off(text, str(Fraction(finer) + 2 * unit(text))) > 1
    for text in coarse.columns["theta"]:
        assert len(text) == len("0.") + 12 if text[0] == "0" else len(text) == 12 + len(".")


def test_events_between_two_times_and_before_the_start():
    exact = reference(KICKED, [-1, 1], ["theta"], events=["turning", "reversal", "cusp"])
    turning = [float(t) for kind, t in exact.events if kind == "turning"]
    assert turning == pytest.approx([k * 0.542895518188 / 2 for k in range(-3, 4)], abs=1e-11)
    forth = Motion(KICKED.top, KICKED.start).events("reversal").count(0, 1)
    assert sum(kind == "reversal" and float(t) >= 0 for kind, t in exact.events) == forth
    assert not reference(load_scene("at-rest"), [0, 1], ["theta"], events=["cusp"]).events


def test_whole_turns_have_all_their_digits():
    late = reference(KICKED, [10**11], ["phi"], digits=2).columns["phi"]
    assert off(late[0], reference(KICKED, [10**11], ["phi"], digits=40).columns["phi"][0]) <= 1


def test_times_from_a_file(tmp_path):
    path = tmp_path / "times.csv"
    path.write_text("x,t\n1,0.5\n2,1e-3\n", "utf-8")
    assert reference(KICKED, read_times(str(path))).columns["t"] == ("0.5", "0.001")
    path.write_text("\ufefft\n\n0.5\n", "utf-8")  # as Excel writes it
    assert read_times(str(path)) == ["0.5"]
    for text in ("x\n1\n", "", 't,x\n\n"1', 't\n"0\n1\n', "t\n0\n0,5\n", "t\n0,5\n1,5\n"):
        path.write_text(text, "utf-8")
        with pytest.raises(ForeignFile, match="column t"):
            read_times(str(path))
    with pytest.raises(ForeignFile, match="No such file"):
        read_times(str(tmp_path / "none"))


def test_the_command_writes_what_it_prints(tmp_path):
    words = ("reference", "sicm-kicked", "--times", "0:2:1")
    head, *rows = printed(*words, "--quantities", "theta,axis", "--digits", 15).splitlines()
    assert head == "t,theta,axis_x,axis_y,axis_z"
    assert rows[2].startswith("2,0.426943705309657,")
    for ending in ("csv", "json", "CSV", "Json"):
        printed(*words, "-o", tmp_path / f"x.{ending}")
        assert (tmp_path / f"x.{ending}").stat().st_size
    found = document(*words)
    assert found["schema"] == "heavytop/reference/1"
    assert found["columns"] == json.loads((tmp_path / "x.json").read_text())["columns"]
