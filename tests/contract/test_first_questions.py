"""What is asked of Python first is answered: formats, events of one kind, short texts."""

from decimal import Decimal

import numpy as np
import pytest
from matplotlib.figure import Figure

import heavytop as ht
from heavytop.errors import NotANumber
from heavytop.integration.outputs import invariants
from heavytop.plots.figures import FIGURES, effective_potential, phase_plane, save

TOP = ht.Top("3.28e-4", "6.60e-5", "0.0456")
MOTION = ht.Motion(TOP, ht.State("0.1", phidot=-15, psidot=140))
KICKED = ht.load_scene("sicm-kicked")


@pytest.fixture(scope="module")
def run():
    return ht.propagate(KICKED)


@pytest.mark.parametrize("spec", [".4f", "", ">12.3e", ".6g"])
def test_a_constant_is_formatted_as_a_float_is(spec):
    E = MOTION.constants.E
    assert float(format(E, spec)) == pytest.approx(float(E), rel=1e-3)
    assert f"{E:.4f}" == f"{float(E):.4f}"


def test_a_constant_shows_more_digits_than_a_float_has():
    E = MOTION.constants.E
    assert str(E).startswith(f"{E:.40f}"[:40])
    assert f"{E:.40f}"[:30] != f"{float(E):.40f}"[:30]


def test_events_of_one_kind(run):
    reversals = run.events.of("reversal")
    kinds = np.array(run.events.kind)
    assert len(reversals) == run.events.count("reversal") > 0
    assert np.array_equal(reversals.t, run.events.t[kinds == "reversal"])
    assert np.array_equal(run(reversals.t).states.shape, reversals.states.shape)
    assert len(run.events.of("turning")) == run.events.count("turning")
    assert set(run.events.of("theta_min").kind) == {"theta_min"}
    with pytest.raises(ValueError, match="kind: one of theta_min"):
        run.events.of("reversals")


def test_invariants_are_in_the_units_that_they_say(run):
    constants = MOTION.constants.floats
    found = run.invariants
    assert float(TOP.A) * found["energy"][0] == pytest.approx(constants["E_prime"], rel=1e-12)
    for name in {"p_phi", "p_psi"} & found.keys():
        assert float(TOP.A) * found[name][0] == pytest.approx(constants[name], rel=1e-12)
    for told in (ht.Trajectory.invariants.__doc__, invariants.__doc__):
        assert "p_psi/A" in told.replace("``", "")


def test_facts_are_asked_of_the_package():
    assert ht.facts(MOTION).omega3 == pytest.approx(140 - 15 * np.cos(0.1))
    with pytest.raises(ht.WrongType, match=r"motion: a Motion .*, not a Scene"):
        ht.facts(KICKED)


def test_a_second_number_is_not_taken_for_a_rate_of_tilt():
    with pytest.raises(TypeError, match="positional"):
        ht.State(0.1, 140)


@pytest.mark.parametrize(
    ("what", "told"),
    [(MOTION, "scene = a Motion: a Scene (Scene(motion.top"), (TOP, "scene = a Top: a Scene")],
)
def test_what_is_no_scene_is_called_by_its_type(what, told):
    with pytest.raises(ht.BadScene) as refusal:
        ht.propagate(what)
    assert told in str(refusal.value)


@pytest.mark.parametrize(
    ("changes", "told"),
    [("start.phidot=-14", '"start.phidot=-14"'), ({"a": 1}, "a table"), (None, "None"), (3, "3")],
)
def test_changes_in_python_are_not_called_by_an_option(changes, told):
    with pytest.raises(ht.BadScene) as refusal:
        ht.load_scene("sicm-kicked", changes)
    assert str(refusal.value).startswith(f"heavytop: overrides = {told}: a list of texts")


@pytest.mark.parametrize("what", [TOP, KICKED.start, KICKED, MOTION, ht.load_scene("steady-fast")])
def test_what_is_shown_can_be_read_and_be_made_again(what):
    assert len(str(what)) < 240
    assert "Exact" not in str(what) + repr(what)
    assert eval(repr(what), {name: getattr(ht, name) for name in ht.__all__}) == what


@pytest.mark.parametrize("suffix", ["svg", "png", "pdf"])
def test_a_figure_is_saved_by_the_name_of_a_file(suffix, tmp_path):
    for name in "ab":
        save(Figure(), str(tmp_path / f"{name}.{suffix}"))
    one, other = ((tmp_path / f"{name}.{suffix}").read_bytes() for name in "ab")
    assert one == other != b""
    assert b"CreationDate" not in one  # which two of one second share


@pytest.mark.parametrize("draw", [effective_potential, phase_plane])
def test_what_is_no_run_is_not_drawn(draw):
    with pytest.raises(ht.WrongType, match=r"trajectory: a Trajectory .*, not a Motion"):
        draw(Figure().subplots(), MOTION)
    for page in FIGURES.values():
        with pytest.raises(ht.WrongType, match="trajectory: a Trajectory"):
            page(MOTION)


def test_the_dot_at_the_start_is_not_hidden_by_a_mark():
    axes = FIGURES["overview"](ht.propagate(KICKED)).axes
    for ax in axes:
        [dot] = [line for line in ax.lines if line.get_markersize() == 3]
        marks = [line for line in ax.lines if line.get_label().startswith("turning point")]
        assert all(dot.get_zorder() > mark.get_zorder() for mark in marks)
        assert marks


def test_a_start_without_spin_reads_back_with_what_a_kick_holds():
    start = ht.State(theta=1, omega3=0)
    assert repr(start) == "State(theta='1', omega3='0')"
    assert ht.State(theta="1", omega3="0") == start != ht.State(theta=1)


def test_changes_that_are_no_list_are_refused():
    for changes in (np.array([0.5, 1.0]), np.array([])):
        with pytest.raises(ht.BadScene, match="a list of texts"):
            ht.load_scene("sicm-kicked", changes)


def test_a_decimal_exponent_without_end_is_refused_at_once():
    folded = ht.fold(ht.load_scene("sicm-kicked"))
    with pytest.raises(NotANumber, match="magnitude"):
        folded(Decimal("1e-99999999"))


@pytest.mark.parametrize("formulation", ["auto", "axis", "attitude"])
def test_more_bits_than_a_double_counts_are_too_many(formulation):
    scene = ht.load_scene("planar-asymptotic", ["span.time=1e290", "want.digits=18"])
    with pytest.raises(ht.BadScene, match="bits"):
        ht.plan(scene, formulation)
