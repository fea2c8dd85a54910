"""Once around the focus–focus point of the diagram: φ and ψ come back a turn more."""

import numpy as np
import pytest

import heavytop as ht
from heavytop.analytic.energy_momentum import energy_momentum
from heavytop.analytic.monodromy import ellipse
from heavytop.numbers.decimals import context

from ..motions import BOOK, INVERTED

FALL = {
    "falls": (BOOK, "0.004"),
    "falls, backwards": (BOOK, "-0.004"),
    "spherical pendulum": (BOOK, 0),
    "inverted, falls": (INVERTED, "0.005"),
}
SLEEPS, THRESHOLD = "0.00924", "sqrt(4*3.28e-4*0.0456)"  # p_psi


def diagram_of(name):
    return energy_momentum(*FALL[name])


@pytest.mark.parametrize("name", FALL)
def test_once_around_the_focus_focus_point_is_one_turn(name):
    diagram = diagram_of(name)
    found = diagram.circuit()
    side = -1 if diagram.g > 0 else 1
    assert (found.winding, found.spin_winding) == (1, side)
    assert found.monodromy == ((1, 0, 0), (0, 1, 0), (-1, -side, 1))
    assert abs(found.precession[-1] - found.precession[0] - 2 * np.pi) < 1e-12
    assert found.period[-1] == found.period[0]
    assert 0 < found.largest_step < np.pi / 2
    np.testing.assert_allclose(np.unwrap(found.principal_precession), found.precession, rtol=1e-14)


def test_other_ways_around():
    """Backwards −1, twice 2; loops that do not enclose the point 0, across the lines or not."""
    diagram = diagram_of("falls")
    around = diagram.around(diagram.maximal_loop / 2)
    assert diagram.circuit(lambda s: around(-s), points=16).winding == -1
    assert diagram.circuit(lambda s: around(2 * s), points=32).winding == 2
    unit, weight = np.sqrt(3.28e-4 * 0.0456), 0.0456
    for centre, radii, winding in (
        ((0.004 + 0.2 * unit, 2.2 * weight), (0.4 * unit, 0.3 * weight), 0),  # over p_phi = p_psi
        ((0.0, 3.5 * weight), (1.2 * unit, 0.7 * weight), 0),  # across both lines
        ((0.0, 0.5 * weight), (0.2 * unit, 0.4 * weight), 0),  # across the line of cusps
        ((0.004, 1.4 * weight), (0.3 * unit, 0.7 * weight), 1),  # the point is aside in it
    ):
        found = diagram.circuit(ellipse(centre, radii), points=16)
        assert (found.winding, found.spin_winding) == (winding, -winding)


def test_above_the_threshold_nothing_can_be_gone_around():
    diagram = energy_momentum(BOOK, SLEEPS)
    assert (diagram.focus_focus, diagram.maximal_loop, diagram.isolated) == (None, 0.0, False)
    found = diagram.circuit(ellipse((0.0, 5 * 0.0456), (0.011, 2.5 * 0.0456)), points=16)
    assert (found.winding, found.spin_winding) == (0, 0)
    with pytest.raises(ht.ImpossibleStart, match="E_prime: at least"):
        diagram.circuit(diagram.around(0.01))
    for p_psi in (SLEEPS, THRESHOLD):
        with pytest.raises(ht.ImpossibleStart, match="focus-focus point at least"):
            energy_momentum(BOOK, p_psi).circuit()


def test_close_to_the_threshold_the_turns_are_still_told():
    """There Δφ turns many times in the steps with which a loop begins, and these are halved."""
    found = energy_momentum(ht.Top(1, "1e-3", 1), "1.98").circuit()
    assert (found.winding, found.spin_winding) == (1, -1)
    assert len(found.s) > 60
    assert found.largest_step < np.pi / 2


@pytest.mark.parametrize("name", ["falls", "inverted, falls"])
def test_the_derivatives_along_the_loop_add_up_to_a_turn(name):
    """No jump is counted: rates of change at 64 places, and the trapezoidal rule."""
    diagram, ctx = diagram_of(name), context(60)
    A, weight = (abs(x.mpf(ctx)) for x in (diagram.top.A, diagram.top.gMR))
    size, step, total = diagram.maximal_loop / 2, ctx.mpf("1e-15"), np.zeros(3)

    def angles(s):
        p = diagram.standing.p_phi + size * ctx.sqrt(A * weight) * ctx.cos(s)
        energy = diagram.standing.E_prime + size * weight * ctx.sin(s)
        form = diagram.advance(p, energy, digits=40)
        return np.array([form.period, form.precession, form.spin])

    for k in range(64):
        s = 2 * ctx.pi * (k + ctx.mpf("0.1")) / 64
        change = (angles(s + step) - angles(s - step)) / (2 * step)
        total += change.astype(float) * 2 * np.pi / 64
    turned = 2 * np.pi * np.array([0, 1, -1 if diagram.g > 0 else 1])
    assert np.all(abs(total - turned) < 1e-12)


@pytest.mark.parametrize(
    ("act", "says"),
    [
        (lambda d: d.circuit(lambda s: (0.01 * s, 0.1)), "closed"),
        (lambda d: d.circuit(points=2), "3 points"),
        (lambda _: energy_momentum(ht.Top(1, 1, 1), 1).circuit(ellipse((1.0, 1.0), (0.0, 0.0))),
         "avoid the critical set"),
    ],
)  # fmt: skip
def test_refusals_say_what_would_be_right(act, says):
    with pytest.raises(ht.ImpossibleStart, match=says):
        act(diagram_of("falls"))


def test_a_loop_that_runs_too_close_to_a_critical_point_is_refused(monkeypatch):
    diagram = diagram_of("falls")  # p_psi is no double: the point itself is missed by 1e-17
    across = ellipse((diagram.standing.p_phi + 1e-4, 0.0456), (1e-4, 0.005))
    monkeypatch.setattr("heavytop.analytic.monodromy.MOST", 60)
    narrow = energy_momentum(ht.Top(1, "1e-3", 1), "1.99")
    for act in (lambda: diagram.circuit(across, points=8), narrow.circuit):
        with pytest.raises(ht.ImpossibleStart, match="farther from critical points"):
            act()
