"""Find: problems whose answers are known, and tops as people have them; sweep: rows of motions."""

import csv
import io
import math
import random
from fractions import Fraction

import numpy as np
import pytest

import heavytop as ht
from heavytop.scene.quantities import read_units, show_units
from heavytop.scene.scene import read_scene
from heavytop.studies.find import FOUND_FACTS, find, read_range

pytestmark = pytest.mark.filterwarnings("ignore::heavytop.ImpossibleBodyWarning")

KICKED = ht.load_scene("sicm-kicked")
DROPPED = ht.load_scene("sicm-dropped")
FACTS = ["round", "theta_max", "round_estimate", "ratio"]
KEYS = ["start.psidot", "start.phidot", "start.theta", "start.thetadot", "top.gMR", "top.C"]
ASKED = ["period", "theta_min", "theta_max", "amplitude", "precession", "spin", "round"]


def scene(top, start):
    return read_scene(f"format = 1\n[top]\n{top}\n[start]\n{start}\n")


def values(found):
    return [solution.value for solution in found.solutions]


def problem(seed):
    """A scene, a key, the value that is to be found again, and a fact."""
    chance = random.Random(seed)
    numbers = {"theta": chance.uniform(0.2, 2.9), "thetadot": chance.gauss(0, 1)}
    numbers |= {"phidot": chance.gauss(0, 2), "psidot": chance.uniform(3, 12)}
    A = math.exp(chance.uniform(-1, 1))
    top = ht.Top(A, A * chance.uniform(0.2, 1.8), chance.choice((-1, 1)) * chance.uniform(0.5, 3))
    made, key = ht.Scene(top, ht.State(**numbers)), chance.choice(KEYS)
    table, _, name = key.partition(".")
    return made, key, float(getattr(getattr(made, table), name)), chance.choice(ASKED)


SEEDS = [*range(12), *(pytest.param(n, marks=pytest.mark.slow) for n in range(12, 100))]


@pytest.mark.parametrize("seed", SEEDS)
def test_a_value_is_found_again_from_what_it_gives(seed):
    """In a range around the value, backwards, from it, up to it, or of that value alone."""
    made, key, value, name = problem(seed)
    wanted = FOUND_FACTS[name][0](ht.Motion(made.top, made.start))
    tilt = key == "start.theta"
    width, most = (min(0.3, value / 2), 3.14) if tilt else (0.3 * abs(value), math.inf)
    low, high = value - width * random.Random(seed).random(), min(value + width / 2, most)
    ends = [(low, high), (high, low), (value, high), (low, value), (value, value)][seed % 5]
    found = find(made, f"{key}={ends[0]!r}:{ends[1]!r}", f"{name} = {wanted!r}")
    low, high = sorted(ends)
    assert any(a - 1e-9 <= value <= b + 1e-9 for a, b in (s.bracket for s in found.solutions))
    for solution in found.solutions:
        assert solution.facts[name] == pytest.approx(wanted, rel=1e-7, abs=1e-9)
        a, b = (_fact(made, key, x, name) - wanted for x in solution.bracket)
        assert min(a, b) <= 0 <= max(a, b) or abs(a) + abs(b) < 1e-12
    if low == high:
        assert [solution.bracket for solution in found.solutions] == [(value, value)]
        return
    off = np.array([_fact(made, key, x, name) for x in np.linspace(low, high, 60)]) - wanted
    jumps = np.abs(np.diff(off))
    crossings = (np.diff(np.sign(off)) != 0) & (jumps < 20 * np.median(jumps) + 1e-12)
    assert len(found.solutions) >= np.count_nonzero(crossings)


def _fact(made, key, x, name):
    changed = made.changed(key, float(x))
    return FOUND_FACTS[name][0](ht.Motion(changed.top, changed.start)) or 0.0


@pytest.mark.parametrize("wish", [f"{'<'[: k % 2]}= {0.7 + k / 7!r}" for k in range(12)])
def test_the_ends_of_a_bracket_are_proved_to_be_on_two_sides(wish):
    """By p_ψ²/4A gMR, which is rational."""
    (solution,) = find(DROPPED, "start.psidot=0:400", f"ratio {wish}").solutions
    A, C, gMR = map(Fraction, ("3.28e-4", "6.60e-5", "0.0456"))
    low, high = ((C * Fraction(x)) ** 2 / (4 * A * gMR) for x in solution.bracket)
    assert low < Fraction(wish.split()[1]) < high < low + Fraction("1e-14")
    assert solution.proved


DOUBLE = scene("A = 1\nC = 1\ngMR = 1", 'theta = "pi/3"\npsidot = "2/sqrt(3)*(1 - 1e-25)"')
FAST = scene("A = 1\nC = 1e-8\ngMR = 1", "theta = 1\nomega3 = 5e8")


@pytest.mark.parametrize(("made", "vary", "so_that", "proved"), [
    (DROPPED, "psidot=20:300", "round = 0.6687013802368704", [False]),  # 3.6e-18 below the least
    (DROPPED, "psidot=117.19400693596921:200", "ratio = 1", [False]),  # and it is 1 before it
    (DROPPED, "psidot=50:117.19400693596913", "ratio >= 1", [False]),  # and behind it
    (DOUBLE, "phidot=1.1:1.2", "kind = separatrix", [False]),  # two conditions, 1e-25 apart
    (FAST, "phidot=3.2:3.3", "spin = 584204449.6", []),  # it jumps by 2π there
])  # fmt: skip
def test_what_no_proof_encloses_is_not_called_proved(made, vary, so_that, proved):
    assert [each.proved for each in find(made, f"start.{vary}", so_that).solutions] == proved


def test_all_solutions_are_found_also_two_that_no_sample_tells_apart():
    """θ_max over φ̇ has a least value at the steady precession: just above it there are two."""
    steady = ht.State.steady(DROPPED.top, "0.1", omega3=140)
    level = scene("A = 3.28e-4\nC = 6.6e-5\ngMR = 0.0456", "theta = 0.1\nomega3 = 140")
    # below it θ falls from 0.1, above it rises to it
    assert len(find(level, "start.phidot=4:9", "theta_max = 0.1000001").solutions) == 1
    below, above = values(find(level, "start.phidot=0:9", "amplitude = 1e-7"))
    assert below < float(steady.phidot) < above


def test_what_no_value_has_is_said_with_the_range():
    for vary, so_that, why in (
        ("start.psidot=100:400", "round = 60 s", "none between 100 and 400 rad/s: the round goes"),
        ("start.psidot=150:400", "kind = waves", "there are cusps"),
        ("start.theta=0:0", "round = 1", "the round does not exist"),
    ):
        found = find(DROPPED, vary, so_that)
        assert (found.solutions, why in dict(found.facts())[""]) == ((), True)
    assert find(DROPPED, "start.psidot=150:400", "theta_max <= 1 rad").holds == ((150, 400),)
    assert len(find(DROPPED, "top.gMR=-1:1.5", "ratio >= 2").holds) == 2  # at 0 there is none


def kicked(phidot):
    return ht.Motion(DROPPED.top, DROPPED.changed("start.phidot", phidot).start)


def test_boundaries_of_kinds():
    cusps = find(DROPPED, "start.phidot=-20:20", "kind = cusps")
    assert [kicked(x).kind for x in cusps.solutions[1].bracket] == ["waves", "loops"]
    for ends in ("-20:20", "-20:41", "0:20", "-7:13"):  # 0 is a sample, an end, or between samples
        assert values(find(DROPPED, f"start.phidot={ends}", "kind = cusps"))[0] == 0
    assert not find(KICKED, "start.theta=0:3", "kind = cusps").solutions  # at 0 it sleeps
    through = find(DROPPED, "start.phidot=1:30", "kind = through-top")
    known = (kicked(x).constants for x in values(through))
    assert max(float(each.p_phi - each.p_psi) for each in known) < 1e-15
    loops = find(DROPPED, "start.phidot=-20:40", "kind = loops")
    assert (len(loops.solutions), loops.holds[0], values(loops)[0]) == (3, (-20, 0), 0)
    steady = find(DROPPED, "start.phidot=0.5:40", "kind = uniform-precession")
    rates = [ht.State.steady(DROPPED.top, "0.1", psidot=140, which=w) for w in ("slow", "fast")]
    assert values(steady) == pytest.approx([float(each.phidot) for each in rates], rel=1e-12)


def test_ranges_have_units_and_may_be_of_any_number():
    ends = [*map(float, read_range("psidot = 1 : 2 rev/s : 2")[1:3])]
    assert ends == pytest.approx([2 * math.pi, 4 * math.pi])
    heavy = scene("mass = 1\ndistance = 0.1\ngravity = 9.81\nA_cm = 0.01\nC_cm = 0.01",
                  "theta = 1\npsidot = 60")  # fmt: skip
    (found,) = find(heavy, "top.distance=1 cm:50 cm", "theta_max = 70 deg").solutions
    assert heavy.changed("top.distance", found.value).top.mass == 1


WHEEL = ('mass = 2.1\ndistance = "18 cm"\ngravity = 9.81\nA = "2.1*(0.3^2/2 + 0.18^2)"\n'
         'C = "2.1*0.3^2"', 'theta = "90 deg"\npsidot = 10\nphidot = 0')  # fmt: skip


@pytest.mark.reference
def test_the_spin_of_a_wheel_by_the_time_of_a_round():
    """Steady, 100 rpm has a round of 3.5 s, and 260 rpm one of 8.728 s (textbook 8.719)."""
    steady = scene(WHEEL[0], 'theta = "90 deg"\nsteady = "slow"\npsidot = 10')
    (found,) = find(steady, "start.psidot=10 rpm:1000 rpm", "round_estimate = 8.719 s").solutions
    assert found.value * 30 / math.pi == pytest.approx(260, abs=0.02)
    for rpm, seconds in ((100, 3.5), (260, 8.728)):
        vary = f"start.psidot={rpm - 60} rpm:300 rpm"
        (found,) = find(scene(*WHEEL), vary, f"round = {seconds} s").solutions
        assert found.value * 30 / math.pi == pytest.approx(rpm, abs=0.5 if rpm == 100 else 0.02)


# --- sweep ---------------------------------------------------------------------------------


def test_rows_are_the_facts_of_each_motion_with_the_formula_beside():
    found = ht.sweep(DROPPED, "start.psidot=100:400:4", FACTS)
    for row, psidot in zip(found.rows, (100, 200, 300, 400), strict=True):
        motion = ht.Motion(DROPPED.top, ht.State("0.1", psidot=psidot))
        p, exact = 6.6e-5 * psidot, (psidot, motion.kind, motion.round, motion.theta_max)
        assert (row["start.psidot"], row["kind"], row["round"], row["theta_max"]) == exact
        by_formula = [2 * math.pi * p / 0.0456, p**2 / (4 * 3.28e-4 * 0.0456)]
        assert [row["round_estimate"], row["ratio"]] == pytest.approx(by_formula, rel=1e-14)
    assert found.document()["over"] == "start.psidot"


def test_csv_and_charts_are_in_the_units_asked_for():
    found = ht.sweep(DROPPED, "start.psidot=100:400:3", FACTS)
    assert found.to_csv().startswith("start.psidot [rad/s],kind,round [s]")
    with show_units(read_units("deg, rpm,ms")):
        header, *rows = csv.reader(io.StringIO(found.to_csv()))
        assert header == ["start.psidot [rpm]", "kind", "round [ms]", "theta_max [deg]",
                          "round_estimate [ms]", "ratio"]  # fmt: skip
        row, values = found.rows[0], [float(x) for x in (rows[0][0], *rows[0][2:4])]
        wanted = [100 * 30 / math.pi, 1000 * row["round"], math.degrees(row["theta_max"])]
        assert values == pytest.approx(wanted, rel=1e-15)
        first, *others = found.figure().axes
        assert [ax.get_ylabel() for ax in (first, *others)] == ["[ms]", "[deg]", "[1]"]
        assert first.lines[0].get_xdata()[0] == pytest.approx(wanted[0], rel=1e-15)


def test_where_there_is_no_scene_a_row_says_so_and_values_are_exact():
    steady = scene("A = 1\nC = 1\ngMR = 1", 'theta = 0.5\nsteady = "slow"\nomega3 = 9')
    slow, fast = ht.sweep(steady, "start.omega3=0.5:5:2", ["round"]).rows
    (least,) = values(find(steady, "start.omega3=0:300", "round = 11 s"))  # beside no scene
    assert least == pytest.approx(2 * math.pi / 11 * math.cos(0.5) + 5.5 / math.pi, rel=1e-14)
    assert (slow["kind"], slow["round"], fast["kind"]) == (None, None, "uniform-precession")
    with pytest.warns(ht.FoldedTiltWarning, match="360 deg is outside"):
        rows = ht.sweep(DROPPED, "start.theta=0:360 deg:5", ["round"]).rows
    assert [row["kind"] for row in rows] == ["sleeping", "cusps", "hanging", "cusps", "sleeping"]
