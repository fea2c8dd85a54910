"""Ends in arrays are those of Motion at 40 digits, and say how well they are known."""

import numpy as np
import pytest

import heavytop as ht
from heavytop.analytic.ends import ends_many
from heavytop.run.counts import count_events

from ..starts import nasty, regular, top_and_state

EVENTS = ("turning", "reversal")


def started(numbers, seed):
    """Starts by Euler's angles, and some nutations each, forwards or backwards."""
    random, numbers = np.random.default_rng(seed), dict(numbers)
    size = numbers["theta"].size
    if "omega3" in numbers:
        numbers["psidot"] = numbers.pop("omega3") - numbers["phidot"] * np.cos(numbers["theta"])
    numbers |= {"phi": random.uniform(-3, 3, size), "psi": random.uniform(-3, 3, size)}
    rate = np.sqrt(1 + abs(numbers["gMR"]) / numbers["A"]) + abs(numbers["psidot"])
    return numbers, random.uniform(-40, 40, size) / rate


def motion_of(start, i):
    return ht.Motion(*top_and_state({name: float(column[i]) for name, column in start.items()}))


def off(found, start, time, i):
    """How far off the axis is, and φ and ψ where a tilt shows them, relative to max(1, |x|)."""
    exact = motion_of(start, i).at(float(time[i]), 40)
    theta, phi, psi = (float(getattr(exact, name)) for name in ("theta", "phi", "psi"))
    sine, turned = np.sin(theta), (abs(found.phi[i] - phi), abs(found.psi[i] - psi))
    rounding = 1e-15 + 4e-16 * sine * abs(phi)
    across = np.hypot(found.theta[i] - theta, sine * min(turned[0], 2.0))
    angles = max(x / max(1, abs(y)) for x, y in zip(turned, (phi, psi), strict=True))
    return across - rounding, angles if sine > 1e-9 else 0.0


@pytest.mark.parametrize("starts", [nasty, regular])
def test_ends_and_counts_are_those_of_a_motion_and_of_the_tally(starts):
    """Within their own doubt, which is no more than thirty times too large; with all turns."""
    given = (np.random.default_rng(2), 500)
    start, time = started(starts(*given, "psidot") if starts is nasty else starts(*given), 3)
    found, held = ends_many(start, time), 0
    known = np.flatnonzero(np.isfinite(found.theta))
    assert known.size > (250 if starts is nasty else 490)
    across, angles = np.transpose([off(found, start, time, i) for i in known])
    assert (across <= found.doubt[known]).all()
    assert (across / found.doubt[known]).max() > 1 / 30
    assert max(across.max(), angles.max()) < 1e-11
    for i in range(500):
        counts = count_events(motion_of(start, i), float(time[i]), EVENTS)
        for event in EVENTS:
            least, most = found.counts[event][:, i]
            if np.isfinite(least):
                assert least <= counts[event][0] <= counts[event][1] <= most <= least + 2
                held += 1
    assert held > (400 if starts is nasty else 900)


def test_beside_a_cusp_reversals_are_left_open():
    """A kick from below that leads to a cusp above, but for a rounding: 2 reversals or none."""
    kicks = 2 * 0.0456 / (6.6e-5 * 140) * (1 + np.linspace(-1e-14, 1e-14, 60))
    start = {"A": 3.28e-4, "C": 6.6e-5, "gMR": 0.0456, "theta": 0.1, "thetadot": 0.0}
    start |= {"phi": 0.0, "psi": 0.0, "phidot": kicks, "psidot": 140 - kicks * np.cos(0.1)}
    start = {name: np.broadcast_to(x, 60) for name, x in start.items()}
    assert np.isnan(ends_many(start, np.full(60, 2.0)).counts["reversal"]).all()


@pytest.mark.parametrize("time", [5.0, -5.0])
def test_an_exact_pass_of_a_pole_is_a_jump(time):
    """A planar pendulum that goes round, and a top that passes the upper vertical each time."""
    start = {"A": 1.0, "C": 1.0, "gMR": 1.0, "theta": 1.0, "phi": 0.1, "psi": 0.2}
    start |= {"thetadot": [3.0, 0.5], "phidot": [0.0, 2.0], "psidot": [0.0, 2.0]}
    start = {name: np.broadcast_to(np.asarray(x, float), 2) for name, x in start.items()}
    found = ends_many(start, np.full(2, time))
    for i in range(2):
        exact = motion_of(start, i).at(time)
        assert found.phi[i] == pytest.approx(float(exact.phi), abs=1e-13)
        assert found.psi[i] == pytest.approx(float(exact.psi), abs=1e-13)
        assert abs(found.phi[i]) > 3  # it did pass


def test_a_row_is_the_same_bits_in_any_company():
    start, time = started(regular(np.random.default_rng(6), 200), 7)
    whole = ends_many(start, time)
    for i in range(0, 200, 11):
        one = slice(i, i + 1)
        alone = ends_many({name: x[one] for name, x in start.items()}, time[one])
        for name in ("theta", "phi", "psi", "doubt"):
            assert getattr(alone, name) == getattr(whole, name)[i]
