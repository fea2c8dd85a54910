"""Defects of steps: bounds that hold, and that a planted error widens."""

from fractions import Fraction

import numpy as np
import pytest
from flint import arb

from heavytop.certificate.bounds import _attitude_outputs, bound
from heavytop.certificate.steps import STEP_MARGIN, defects
from heavytop.exact.balls import working

from ..certificates import flow_of, run_of

RNG = np.random.default_rng(7)
EXACT = dict.fromkeys(("axis", "theta", "phi"), 0.0)  # outputs without rounding


def steps_of(trajectory):
    own, flow = flow_of(trajectory)
    steps, _ = own.steps(trajectory.orbit.checkpoints[0], min(trajectory.orbit.steps, 40))
    return own, flow, steps


def exact_defect(system, steps, k, s):
    """|p' - f(p)| of step k at a time, in rational numbers, in the norm of the system."""
    c = [[Fraction(x) for x in row] for row in steps.coefficients[:, :, k].T]
    s = Fraction(s)
    p = [sum(x * s**i for i, x in enumerate(row)) for row in c]
    rate = [sum(i * x * s ** (i - 1) for i, x in enumerate(row) if i) for row in c]
    y = [*p, 1]  # behind all states is the factor that is 1
    f = [sum(Fraction(a) * y[j] * y[m] for a, j, m in row) for row in system.terms]
    off = [Fraction(w) * (x - y) for w, x, y in zip(system.weights, rate, f, strict=True)]
    return float(sum(x * x for x in off)) ** 0.5


@pytest.mark.parametrize("form", ["axis", "attitude"])
def test_no_defect_is_larger_than_its_bound(form):
    _, flow, steps = steps_of(run_of("sicm-kicked", form))
    bounds = defects(flow.system, steps)
    for k in (0, 7, 23):
        for part in (0.0, 0.3, 0.9, 1.0):
            assert 0 < exact_defect(flow.system, steps, k, part * steps.length[k]) <= bounds[k]
    assert bounds.max() < 1e-12


def test_a_wrong_coefficient_widens_the_bound():
    _, flow, steps = steps_of(run_of("sicm-kicked"))
    _, before = bound(flow, steps, {}, EXACT)
    c = steps.coefficients.copy()
    c[3, 0, 11] += 1e-7  # of the third order, in the twelfth step
    wrong = steps._replace(coefficients=c)
    _, after = bound(flow, wrong, {}, EXACT)
    off = 1e-7 * abs(steps.length[11]) ** 3
    assert before["axis"] < 3e-15
    assert after["axis"] >= 0.99 * off > 1e3 * before["axis"]
    assert defects(flow.system, wrong)[11] > 1e4 * defects(flow.system, steps)[11]


def test_the_polynomials_are_evaluated_beyond_the_digits_of_a_double():
    _, _, steps = steps_of(run_of("sicm-kicked"))
    step = np.array([0, 5, 9, 9])
    since = np.array([0.01, 0.02, 0.03, steps.length[9]])
    (high, low), twice, plain = steps.at(step, since)
    for i, (k, s) in enumerate(zip(step, since, strict=True)):
        for n in range(3):
            row = [Fraction(x) for x in steps.coefficients[:, n, k]]
            exact = sum(x * Fraction(float(s)) ** m for m, x in enumerate(row))
            assert abs(Fraction(high[n, i]) + Fraction(low[n, i]) - exact) <= twice[n, i] < 1e-19
            plainly = np.polynomial.polynomial.polyval(s, steps.coefficients[:, n, k])
            assert abs(Fraction(float(plainly)) - exact) <= plain[n, i]


@pytest.mark.parametrize(("form", "read"), [("axis", 3), ("attitude", 4)])
def test_no_step_is_faster_or_bends_more_than_its_bound(form, read):
    _, _, steps = steps_of(run_of("sicm-kicked", form))
    order = len(steps.coefficients)
    for part in np.linspace(0, 1, 9):
        s = part * steps.length
        for k, bound_of in ((1, steps.speed), (2, steps.bend)):
            factors = np.array([np.prod(np.arange(m, m - k, -1)) for m in range(k, order)])
            powers = s ** np.arange(order - k)[:, None]
            found = (factors[:, None, None] * steps.coefficients[k:] * powers[:, None]).sum(axis=0)
            size = np.sqrt((found[:read] ** 2).sum(axis=0))
            assert np.all(size <= bound_of)
            assert np.any(size > bound_of / 4)


def test_numpys_arctan2_is_off_by_at_most_one_unit_in_the_last_place():
    y, x = 2.0 ** RNG.uniform(-30, 30, (2, 20_000)) * RNG.choice([-1, 1], (2, 20_000))
    with working(128):
        for a, b, found in zip(y, x, np.arctan2(y, x), strict=True):
            off = abs(arb.atan2(arb(float(a)), arb(float(b))) - arb(float(found)))
            assert off < np.spacing(abs(found))


def test_the_axis_of_a_quaternion_is_rounded_within_its_bound():
    q = RNG.normal(size=(4, 300))
    q /= np.sqrt((q * q).sum(axis=0))
    states = np.concatenate((q, np.zeros((2, 300))))
    rounding = _attitude_outputs(states, 0 * states, np.zeros(300))["axis"].rounding
    a, b, c, d = q
    mine = 2 * a * c + 2 * b * d, -2 * a * b + 2 * c * d, a**2 - b**2 - c**2 + d**2
    for k in range(300):
        e, f, g, h = (Fraction(x) for x in q[:, k])
        true = 2 * e * g + 2 * f * h, 2 * g * h - 2 * e * f, e * e - f * f - g * g + h * h
        square = sum((Fraction(x[k]) - y) ** 2 for x, y in zip(mine, true, strict=True))
        assert float(square) ** 0.5 <= rounding[k] < 6e-16


@pytest.mark.parametrize("periods", [3.3, -3.3, 7.123456789])
def test_the_steps_reach_from_the_start_to_the_end_without_a_gap(periods):
    trajectory = run_of("sicm-kicked", periods=periods)
    own, _ = flow_of(trajectory)
    steps, _ = own.steps(trajectory.orbit.checkpoints[0], trajectory.orbit.steps)
    begun = [Fraction(a) + Fraction(b) for a, b in zip(steps.begun, steps.begun_low, strict=True)]
    ends = [t + Fraction(x * STEP_MARGIN) for t, x in zip(begun, steps.length, strict=True)]
    forward = 1 if periods > 0 else -1
    assert begun[0] == 0
    for t, before in zip(begun[1:], ends, strict=False):
        assert forward * t <= forward * before or forward * t > forward * Fraction(own.end)
    ends = [t for t, x in zip(ends, steps.length, strict=True) if x]  # what begins later is none
    assert forward * ends[-1] >= forward * Fraction(own.end) * Fraction(own.integrator.pace)
    assert abs(ends[-1] - Fraction(own.end) * Fraction(own.integrator.pace)) < 1e-14
