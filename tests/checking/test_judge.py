"""The judge is judged: what was planted in a trajectory is reported, and nothing else."""

import json
from functools import partial

import numpy as np
import pytest

from heavytop import Motion, Scene, State, Top, check, load_scene
from heavytop.errors import Impossible
from heavytop.files import as_json
from heavytop.results.check import CHECKED_QUANTITIES
from heavytop.scene.quantities import ANGLES, RATES
from heavytop.scene.scene_file import shipped_scenes

from .made import SCENE, START, TIMES, TOP, angles, exact, vectors

PERIOD = Motion(TOP, START).period


approx = partial(pytest.approx, rel=0.02, abs=0)


@pytest.mark.parametrize("name", shipped_scenes())
def test_the_closed_form_itself_has_all_its_digits(name):
    scene = load_scene(name)
    motion = Motion(scene.top, scene.start)
    t = np.linspace(0, float(scene.time or scene.periods * motion.period), 801)
    found = check(vectors(motion.at(t), t), scene)
    assert found.digits > 14
    assert all(x.max < 1e-12 for x in map(found.errors.get, CHECKED_QUANTITIES) if x is not None)
    assert found.phase is None or abs(found.phase.last) < 1e-14
    assert found.growth["phase"] is found.slip is None
    assert found.conventions == found.alternatives == ()
    for count in filter(None, found.events.values()):
        if count.data is not None:
            assert count.exact <= count.data <= count.exact_most


def test_what_the_last_digit_of_the_start_does_is_rounding():
    t = np.linspace(0, 30_000, 6001)
    rounded = {name: float(getattr(START, name)) for name in (*ANGLES, *RATES)}
    found = check(vectors(Motion(TOP, State(**rounded)).at(t), t), SCENE)
    assert 1e-12 < found.errors["axis"].rms < found.condition
    assert found.method["sentence"] == "the error is that of rounding"


def test_a_steady_motion_beside_one_that_nutates_has_no_motor():
    at = Motion(TOP, State.steady(TOP, "0.4", psidot=120)).at(TIMES)
    other = Scene(TOP, State("0.4", phidot=5, psidot=120), time=3)
    assert not check({"t": TIMES} | {x: getattr(at, x) for x in ANGLES}, other).conventions


def rounded(table, form):
    """A table as it is read again, where its numbers are written so."""
    if form == "float32":
        return {name: x.astype(np.float32) for name, x in table.items()}
    return {name: np.array([float(form % each) for each in x]) for name, x in table.items()}


@pytest.mark.parametrize("form", ["%.6g", "%.3f", "%.5e", "float32"])
@pytest.mark.parametrize("fast", [1.0, 1 + 1e-4])
@pytest.mark.parametrize(("scene", "unit"), [(SCENE, np.asarray), (TOP, np.degrees)])
def test_what_the_rounding_of_numbers_does_is_told_from_an_error(form, fast, scene, unit):
    """Of times too, where an even step has no few decimals."""
    t = np.linspace(0, 20, 811)
    table = {name: unit(x) for name, x in angles(exact(fast * t)).items()} | {"t": t}
    found = check(rounded(table, form), scene)
    error, rounding = found.errors["axis"].rms, found.method["rounding"]
    assert ("rounding of the numbers" in found.method["sentence"]) == (error < 2 * rounding)
    if fast == 1.0:  # of a first row the rounding is one number, not the mean of many
        assert (0.8 if scene is SCENE else 0.1) < error / rounding < 2
    elif form != "%.3f":
        assert error > 3 * rounding


CHOSEN = [  # times of few decimals
    np.sort(np.random.default_rng(3).choice(300, 60, replace=False)) / 100,
    np.delete(np.arange(41) / 10, 5), np.delete(np.arange(320) / 64, 7),
    np.array([0.0, 2001, 4003, 7007, 9100, 13000, 15001]), np.r_[0:160, 200] / 1024,
]  # fmt: skip
FROZEN = {"axis": [0.0, 0, 1], "matrix": np.eye(3), "quaternion": [1.0, 0, 0, 0]}


def test_times_that_somebody_chose_and_what_never_changes_are_not_rounded():
    """Nor is the order told where one step is longer than the others."""
    tables = [{"t": t, "axis": exact(1.001 * t).axis} for t in CHOSEN]
    tables += [{"t": TIMES, name: np.array([x] * TIMES.size)} for name, x in FROZEN.items()]
    methods = [check(table, SCENE).method for table in tables]
    assert {(method["rounding"], method["order"]) for method in methods} == {(None, None)}


@pytest.mark.parametrize("column", ["theta", "axis"])
@pytest.mark.parametrize("ahead", [1e-9, -1e-3])
def test_a_constant_phase_error_is_measured(column, ahead):
    found = check({"t": TIMES, column: getattr(exact(TIMES + ahead), column)}, SCENE)
    assert (found.phase.last, " ahead at t = " in str(found)) == (approx(ahead), ahead > 0)
    assert found.growth["phase"] is None or abs(found.growth["phase"]) < 0.02


@pytest.mark.parametrize("power", [1, 2])
@pytest.mark.parametrize("size", [1e-8, -1e-2])
def test_the_growth_of_a_phase_error_is_measured(power, size):
    """Also where it grows beyond a whole period."""
    t = np.linspace(0, 200 * PERIOD, 8001)
    ahead = size * t * (t / t[-1]) ** (power - 1)
    found = check({"t": t, "theta": exact(t + ahead).theta}, SCENE)
    assert found.phase.last == approx(np.interp(found.phase.t, t, ahead))
    assert found.phase.t > 0.98 * t[-1]
    assert abs(found.growth["phase"] - power) < 0.05
    beyond = t[np.abs(ahead) > PERIOD / 20]
    assert (found.phase.lost is not None) == ("lost at" in str(found)) == (beyond.size > 0)
    assert beyond.size == 0 or abs(found.phase.lost - beyond[0]) < 20 * PERIOD


def test_where_there_is_no_phase_none_is_told():
    """A steady top, and rows once a period, which count no events either."""
    start = State.steady(TOP, "0.5", 200)
    found = check({"t": TIMES, "axis": exact(TIMES, TOP, start).axis}, Scene(TOP, start, time=3))
    assert (found.phase, found.events["turning"].data) == (None, 0)
    t = PERIOD * np.arange(3000)
    found = check({"t": t, "theta": exact(t * (1 + 1e-6)).theta}, SCENE)
    assert (found.phase, found.events["turning"].data) == (None, None)
    assert found.method["no_phase"]


@pytest.mark.parametrize("size", [1e-9, 1e-2])
def test_an_error_of_the_axis_is_measured(size):
    axis = exact().axis.copy()
    across = np.cross(axis[333], [0.6, 0, 0.8])
    axis[333] += size * across
    planted, found = size * np.linalg.norm(across), check({"t": TIMES, "axis": axis}, SCENE)
    off = found.errors["axis"]
    assert (off.max, off.rms * np.sqrt(TIMES.size)) == approx((planted, planted))
    assert off.t_max == TIMES[333]
    off = check({"t": 1000 * TIMES, "axis": axis}, SCENE).errors["axis"]
    assert off.t_max == pytest.approx(TIMES[333])  # milliseconds are undone
    assert abs(found.digits + np.log10(planted)) < 0.01


@pytest.mark.parametrize("size", [1e-8, 1e-3])
def test_errors_of_precession_and_spin_are_measured(size):
    table = angles(exact())
    table["phi"] = table["phi"] + size * TIMES / 3
    table["psi"] = table["psi"] - 2 * size * (TIMES / 3) ** 2
    reduced = table | {name: np.mod(table[name], 2 * np.pi) for name in ("phi", "psi")}
    for data in (table, reduced):
        found = check(data, SCENE).errors
        assert (found["phi"].max, found["psi"].max) == approx((size, 2 * size))
        assert found["theta"].max < 1e-14


@pytest.mark.parametrize("size", [1e-9, 1e-4])
def test_errors_of_energy_and_momenta_are_measured(size):
    """Rates that are too large by a part change E' and the momenta by what they are made of."""
    record, constants = exact(), Motion(TOP, START).constants.floats
    planted = size * float(TOP.A) * (record.thetadot**2).max()
    found = check(angles(record) | {"thetadot": record.thetadot * (1 + size)}, SCENE).errors
    assert found["energy"].max * max(abs(constants["E_prime"]), float(TOP.gMR)) == approx(planted)
    assert found["p_phi"].max < 1e-13
    found = check(angles(record) | {"psidot": record.psidot * (1 + size)}, SCENE)
    most, of = size * max(abs(record.psidot)), max(constants["p_phi"], constants["p_psi"])
    assert found.errors["p_psi"].max * of == approx(float(TOP.C) * most)
    assert "kg" not in str(found)  # they are parts of that momentum


# --- events --------------------------------------------------------------------------------------


def test_events_that_the_data_lack_are_told():
    """Cusps are loops in the data where the kick was a little stronger."""
    scene, other = load_scene("sicm-dropped"), load_scene("sicm-kicked", ["start.phidot=-0.5"])
    t = np.linspace(0, 5, 2001)
    found = check(vectors(Motion(other.top, other.start).at(t), t), scene).events
    assert (found["cusp"].data, found["reversal"].exact_most) == (0, 0)
    assert found["cusp"].exact > 10
    assert found["reversal"].data > 20


# --- where the start is from ---------------------------------------------------------------------


@pytest.mark.parametrize("columns", [angles, vectors])
def test_the_start_of_a_top_alone_is_that_of_the_first_row(columns):
    t = TIMES + 7
    found, later = (check(columns(exact(t), t), known) for known in (TOP, SCENE))
    assert (found.origin, later.origin) == ("first row", "scene")
    assert (found.data.rows, *found.data.span) == (t.size, t[0], t[-1])
    assert found.digits > 11.5
    assert later.digits > 13


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_a_start_is_fitted_where_there_are_no_rates(seed, script):
    scene = script("47_conventions").random_scene(np.random.default_rng(seed))
    t = np.linspace(2, 8, 601)
    mine = Motion(scene.top, scene.start).at(t)
    found = check({"t": t, "axis": mine.axis}, scene.top)
    assert found.origin == "fitted"
    assert found.digits > 10
    assert abs(found.scene.start.theta - mine.theta[0]) < 1e-9
    assert check({"t": t, "quaternion": mine.quaternion}, scene.top).errors["psi"].max < 1e-9
    assert abs(found.scene.start.omega3 - mine.omega3[0]) < 1e-6


def test_what_a_fitted_start_leaves_of_an_error_is_no_precision():
    found = check({"t": TIMES, "axis": exact(TIMES * (1 + 1e-6)).axis}, TOP)
    assert (found.origin, found.method["floor_digits"]) == ("fitted", None)


@pytest.mark.parametrize(("said", "data"), {
    "none follows from theta alone: give a scene with a start": {"theta": exact().theta},
    "a first row whose axis is not vertical": {"axis": np.tile([0.0, 0.0, 1.0], (TIMES.size, 1))},
    "no start fits these": {"axis": exact(TIMES, Top("4e-4", "6.6e-5", "0.0456")).axis},
}.items())  # fmt: skip
def test_what_no_start_fits_is_refused(said, data):
    with pytest.raises(Impossible, match=said):
        check({"t": TIMES} | data, TOP)


# --- what nobody could do better, and what is written --------------------------------------------


@pytest.mark.parametrize("name", ["sicm-kicked", "near-separatrix", "spherical-pendulum"])
def test_the_condition_is_what_small_changes_do(name):
    """By plain differences in doubles, from changes a million times as large."""
    scene = load_scene(name)
    t, tables = np.linspace(0, 5, 8), {"top": ("A", "C", "gMR")}
    tables["start"] = ("theta", "thetadot", "phidot", scene.start.held)

    def axes(x, part):
        top, start = (
            {n: float(getattr(getattr(scene, table), n)) * (1 + part * (n == x)) for n in names}
            for table, names in tables.items()
        )
        return exact(t, Top(**top), State(**start)).axis

    slopes = [(axes(x, 1e-8) - axes(x, -1e-8)) / 2e-8 for names in tables.values() for x in names]
    moved = sum((slope**2).sum(axis=1) for slope in slopes)
    found = check({"t": t, "theta": exact(t, scene.top, scene.start).theta}, scene)
    assert found.condition == approx(2.0**-53 * np.sqrt(moved.max()), rel=0.05)


def test_a_document_holds_all_that_is_said():
    table = vectors(exact(TIMES * (1 - 1e-7)))
    found = check({"Zeit": table.pop("t"), "Note": TIMES} | table, SCENE, {"t": "Zeit"})
    document = json.loads(as_json(found.document()))
    assert max(document["curves"]["axis"]) == document["errors"]["axis"]["max"]
    used = {"Zeit": "t", "Note": None, "quaternion": "quaternion", "omega": "omega"}
    assert document["data"]["columns"] == used


@pytest.mark.parametrize(("name", "rows", "end"), [
    *(("sicm-kicked", *each) for each in ((9, 0.008), (50, 0.002), (200, 0.005), (1000, 0.005))),
    ("simo-wong", 1000, 0.5),
])  # fmt: skip
def test_data_of_a_span_in_which_little_moves_have_no_convention(name, rows, end):
    scene = load_scene(name)
    t = np.linspace(0, end, rows)
    axis = Motion(scene.top, scene.start).at(t).axis
    for written, digits in ((axis, 14), (np.round(axis, 5), 4)):
        found = check({"t": t, "axis": written}, scene)
        assert (found.conventions, found.alternatives) == ((), ())
        assert found.digits > digits


def test_the_verdict_names_what_is_off():
    """A rate that is ω₃ beside exact angles, an origin of times, a clock, a start."""
    record, rows = exact(), 250 * TIMES
    omega3 = record.psidot + record.phidot * np.cos(record.theta)
    for data, said in (
        ({"t": TIMES, "theta": record.theta, "psidot": omega3}, "psidot is off by 0.07"),
        (angles(record) | {"psidot": omega3}, "psidot is off by 0.07"),
        ({"t": TIMES + 5, "theta": record.theta}, "Conventions: time-origin. The data have 1"),
        ({"t": rows, "axis": record.axis}, "the step is coarse, or the clock, "),
        ({"t": rows + 250, "axis": exact(TIMES + 1).axis}, "the start is"),
    ):
        assert said in str(check(data, SCENE)).partition("\n")[0]


def test_an_attitude_without_spin_is_no_method_of_first_order():
    record = exact()
    table = {"t": TIMES, "theta": record.theta, "phi": record.phi, "psi": np.zeros(TIMES.size)}
    assert check(table, SCENE).method["order"] is None


def test_angles_without_a_tilt_are_judged():
    record = exact()
    found = check({"t": TIMES, "phi": record.phi + 1e-3 * TIMES, "psi": record.psi}, SCENE)
    assert (found.errors["phi"]["max"], found.errors["theta"]) == (pytest.approx(3e-3), None)
    assert found.method["no_phase"] == "the data have no tilt"
