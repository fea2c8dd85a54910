"""In more than doubles phi and psi have the turns of the closed form, however near a separatrix;
and what misses its digits all the same is said."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import numpy as np
import pytest

import heavytop as ht
from heavytop.errors import BadScene, DoubtfulWarning, EndedEarly, MissedDigitsWarning, Outcome
from heavytop.integration.high_precision import Unfinished
from heavytop.run.trajectory import Decimals
from heavytop.run.verify import missed_digits

ALLOWED = 1e-11  # of an angle or of 1: the digits asked for hold at the end, and near it
SLOW = ht.Top(1, 1, 1)


def _scene(start, periods, top=SLOW, digits=14, **more):
    state = ht.State(**start)
    wants = {"quantities": ("phi", "psi"), "events": (), "samples": 5} | more
    return ht.Scene(top, state, periods=periods, digits=digits, **wants)


def _held(trajectory):
    """Hold samples, events and a time between against the closed form of the exact numbers."""
    decimals = trajectory.decimals
    motion = ht.Motion(trajectory.scene.top, trajectory.scene.start)
    middle = (decimals.samples[1].t + 2 * decimals.samples[2].t) / 3
    looked_at = (*decimals.samples, *(e.sample for e in decimals.events[-4:]))
    for sample in (*looked_at, *decimals.at([middle])):
        exact = motion.at(sample.t, digits=40)
        for name in ("phi", "psi"):
            seen, known = getattr(sample, name), getattr(exact, name)
            assert abs(seen - known) <= ALLOWED * max(1, abs(known)), (name, sample.t)


BESIDE = {"theta": "1.7601238236122326e-12", "phidot": "4.36", "omega3": "872.07"}
FAST = ht.Top("3.28e-4", "3.28e-6", "0.04559856")


@pytest.mark.parametrize(
    ("start", "periods", "formulation", "more"),
    [
        ({"theta": "1e-9", "omega3": "1.2"}, "-2.3", "axis", {}),
        ({"theta": "1e-9", "omega3": "1.2"}, "3.8", "attitude", {}),
        # in long doubles over many strides; and on the vertical within the rounding of doubles
        ({"theta": "1e-3", "thetadot": "0.01", "phidot": "0.3", "omega3": "3"}, "30", "axis", {}),
        ({"theta": "1e-25", "omega3": "1.2"}, "0.6", "axis", {}),
        ({"theta": "1e-25", "omega3": "1.2"}, "0.6", "attitude", {}),
        (BESIDE, "0.9", "attitude", {"top": FAST, "events": ("turning",)}),
    ],
)
def test_turns_near_the_separatrix(start, periods, formulation, more):
    trajectory = ht.propagate(_scene(start, periods, **more), formulation=formulation)
    assert bool(trajectory.decimals.events) == ("events" in more)
    _held(trajectory)


def _drawn(draw):
    r, g = draw.choice(("0.5", "1", "1.9")), draw.choice(("1", "-1", "-50"))
    rate = math.sqrt(abs(float(g)))
    critical, e = 2 * rate / float(r), 10 ** draw.uniform(-12, -2)
    theta = math.pi - e if g[0] == "-" else e
    start = {"theta": theta, "omega3": draw.uniform(0.1, 0.97) * critical}
    start["phidot"] = draw.choice((0.0, start["omega3"] * float(r) / 2, rate))
    start["thetadot"] = draw.choice((0.0, 10 ** draw.uniform(-12, -3)))
    periods = draw.choice((1, -1)) * round(draw.uniform(0.5, 2), 3)
    return _scene({k: repr(v) for k, v in start.items()}, repr(periods), top=ht.Top(1, r, g))


@pytest.mark.parametrize("seed", range(4))
def test_turns_of_random_motions_near_the_separatrix(seed):
    scene = _drawn(random.Random(seed))
    _held(ht.propagate(scene, formulation=("axis", "attitude")[seed % 2]))


def _turned_once_more(trajectory):
    turned = replace(trajectory.decimals.samples[-1], phi=trajectory.decimals.samples[-1].phi + 6.3)
    samples = (*trajectory.decimals.samples[:-1], turned)
    return replace(trajectory, decimals=replace(trajectory.decimals, samples=samples))


def test_a_wrong_turn_is_known_in_decimals_and_in_doubles():
    precise = ht.propagate(_scene({"theta": "1", "omega3": "3"}, "2"))
    assert missed_digits(precise) == {}
    assert missed_digits(_turned_once_more(precise))["phi"] == pytest.approx(6.3)
    double = ht.propagate(_scene({"theta": "1", "omega3": "3"}, "2", digits=12, samples=50))
    assert missed_digits(double) == {}
    seen = double.orbit.samples
    late = np.where(np.arange(50) == 49, 2 * np.pi, 0.0)
    states = np.column_stack((seen.states[:, :-1], seen.states[:, -1] + late))
    orbit = replace(double.orbit, samples=seen._replace(states=states))
    assert missed_digits(replace(double, orbit=orbit))["phi"] == pytest.approx(2 * np.pi)


def test_missed_digits_are_warned_of(monkeypatch):
    monkeypatch.setattr("heavytop.run.verify.missed_digits", lambda _: {"phi": 0.5})
    assert issubclass(MissedDigitsWarning, DoubtfulWarning)
    scene = _scene({"theta": "1", "omega3": "3"}, "2")
    for formulation in ("auto", "attitude"):
        with pytest.warns(MissedDigitsWarning, match="14 digits .* by phi 5.0e-01"):
            ht.propagate(scene, formulation=formulation)


def test_a_singular_precise_run_ends_early(monkeypatch):
    def singular(*_):
        raise Unfinished("beyond the finite numbers")

    monkeypatch.setattr(Decimals, "walk", singular)
    with pytest.raises(EndedEarly) as early:
        ht.propagate(_scene({"theta": "1", "omega3": "3"}, "2"))
    assert early.value.outcome is Outcome.SINGULAR


def test_rates_whose_squares_no_double_holds_are_refused():
    with pytest.raises(BadScene, match=r"rates of 1.0e\+300 rad/s"):
        ht.propagate(_scene({"theta": "1e-9", "omega3": "1e300"}, "2"))
