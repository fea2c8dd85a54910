"""Counts and times of events, proved, against signs of rates and against `count_events`."""

import random
from fractions import Fraction

import numpy as np
import pytest

from heavytop.analytic.motion import ClosedForm
from heavytop.errors import Impossible, Unseparated
from heavytop.exact import Exact
from heavytop.exact.balls import Interval
from heavytop.run.counts import count_events

from ..motions import MOTIONS, motion, named
from ..views import Bounds

EVENTS = ("turning", "reversal", "cusp")
TINY = Fraction(1, 10**30)


class Enclosed(Bounds):
    """Events and rates of a motion."""

    def count(self, event, t):
        """From the start to a time, both included."""
        span = (0, t) if float(Exact.of(t)) >= 0 else (t, 0)
        return self.motion.events(event).count(*span)

    def time(self, event, n):
        return Interval.of(self.motion.events(event).nth(n, self.digits))

    def rates(self, t):
        return tuple(self(name, t) for name in ("thetadot", "phidot", "psidot"))


def enclosed(begun, digits=40):
    return Enclosed(ClosedForm(begun.source), digits)


def changes(begun, end):
    """How often θ̇ and φ̇ change their signs from just after the start to an end, in doubles.

    A reversal is a change of sign of φ̇; nothing here knows where turning points or reversals are.
    """
    periods = abs(end) / begun.period if begun.period else 1.0
    at = begun.at(np.linspace(0, end, int(20_000 * (periods + 1)))[1:])
    signs = (np.sign(rate[np.abs(rate) > 0]) for rate in (at.thetadot, at.phidot))
    return [int(np.sum(one[1:] != one[:-1])) for one in signs]


def held(begun, end):
    """Counts to an end against signs, the start itself apart, and against `count_events`."""
    found = enclosed(begun)
    counted = {event: found.count(event, end) for event in EVENTS}
    if (there := count_events(begun, end)) is not None:
        for event, number in counted.items():
            assert there[event][0] <= number <= there[event][1], event
    if begun.nutates:
        at_start = {event: found.count(event, 0) for event in EVENTS}
        turning, reversal = changes(begun, end)
        assert counted["turning"] == turning + at_start["turning"]
        assert counted["reversal"] == reversal + at_start["reversal"]
        if begun.cusps:
            assert counted["reversal"] == 0
            assert 0 <= 2 * counted["cusp"] - counted["turning"] + 1 <= 2
        else:
            assert counted["cusp"] == 0
    return counted["reversal"]


def drawn(draw):
    """A motion of any kind, often at rest, without weight or with g < 0."""
    A = draw.randint(1, 9)
    rate = [0, 0, Fraction(draw.randint(-400, 400), 100)]
    theta = Fraction(draw.randint(20, 3100), 1000)
    return motion(
        A, Fraction(A * draw.randint(1, 190), 100), draw.choice([3, 1, -2, -5, 0]), theta, 0, 0,
        draw.choice(rate), draw.choice(rate), Fraction(draw.randint(-900, 900), 100),
    )  # fmt: skip


def test_random_tops():
    """A hundred of them, either direction of time."""
    draw, reversals = random.Random(0), 0
    for _ in range(100):
        begun = drawn(draw)
        end = draw.choice([1, -1]) * draw.uniform(0.2, 3.3) * (begun.period or 1.0)
        reversals += held(begun, end)
    assert reversals > 25


LOOPS, DROPPED = MOTIONS["loops"], MOTIONS["cusps"]
RISING, FALLING = (MOTIONS[f"reversing at the start, {way}"] for way in ("rising", "falling"))
UPSIDE_DOWN = (2, 1, -3, "2.6", 0, 0, 0, 0, 7)
FREE = (1, 1, 0, "pi/2", 0, 0, 0, 3, 4)  # T = 2π/5


def changes_sign(found, rate, t):
    before, after = (found.rates(t + Fraction(side, 10**15))[rate] for side in (-1, 1))
    return before.upper * after.lower < 0 or before.lower * after.upper < 0


@pytest.mark.parametrize(("args", "first"), [
    (LOOPS, (1, 0, 0)), (RISING, (0, 1, 0)), (FALLING, (0, 1, 0)), (DROPPED, (1, 0, 1)),
    (UPSIDE_DOWN, (1, 0, 1)), (FREE, (1, 0, 0)), (MOTIONS["rising"], (0, 0, 0)),
    (MOTIONS["hanging upside down"], (0, 0, 0)),
])  # fmt: skip
def test_just_before_and_just_after_an_event(args, first):
    """1e-30 s decide; times are in order, none is left out, and there rates change their signs.

    A start exactly on a turning point, a reversal or a cusp counts.
    """
    found = enclosed(motion(*args), 50)
    for event, number in zip(EVENTS, first, strict=True):
        assert [found.count(event, t) for t in (-TINY, 0, TINY)] == [number] * 3
        if number:
            assert found.time(event, 0).middle == found.time(event, 0).spread == 0
        if not found.count(event, 4 * found.period.middle):
            with pytest.raises(Impossible, match=f"{event} 0 does not happen"):
                found.time(event, 0)
            continue
        for way, numbers in ((1, range(6)), (-1, range(-1, -6, -1))):
            here = found.count(event, 0) if way < 0 else 0
            for n in numbers:
                t = found.time(event, n)
                already = here + (n if way > 0 else -1 - n)
                if t.middle:
                    assert found.count(event, t.middle - way * TINY) == already
                assert found.count(event, t.middle + way * TINY) == already + 1
                if event == "cusp":
                    assert max(abs(rate.mid) for rate in found.rates(t.middle)[:2]) < 1e-35
                else:
                    rate = ("turning", "reversal").index(event)
                    assert changes_sign(found, rate, t.middle)


def test_near_a_cusp_what_is_and_what_is_not():
    """φ̇₀ = ±1e-30: a loop has two reversals within 1e-15 of a period, a wave has none."""
    for side, reversals in ((-1, 5), (1, 0)):
        begun = motion(2, 1, 3, "0.5", 0, 0, 0, side * TINY, 7)
        found = enclosed(begun, 60)
        end = Fraction(begun.period * 3) - Fraction(1, 100)
        # the loop is at the start: half of it lies before
        assert [found.count(event, end) for event in EVENTS] == [6, reversals, 0]
        if reversals:
            first = found.time("reversal", 0)
            assert 0 < first.lower < first.upper < 1e-14 * begun.period
            assert found.time("reversal", -1).middle < 0


@pytest.mark.parametrize("gMR", [2, -2])
def test_an_axis_that_tends_to_the_vertical_turns_once(gMR):
    """At the start, after it or before it; further events do not happen."""
    theta, side = ("pi/3", 1) if gMR > 0 else ("2*pi/3", -1)
    for way, n in ((1, 0), (-1, -1)):
        rates = {"thetadot": Fraction(way * side, 2), "phidot": 1, "psidot": Fraction(5 * side, 2)}
        found = enclosed(motion(2, 1, gMR, theta, **rates))
        t = found.time("turning", n).middle
        assert t * way > 0
        lowest = found.theta_max if gMR > 0 else found.theta_min
        assert found("theta", t).mid == pytest.approx(lowest.mid, abs=1e-15)
        ends = (100 * way, -100 * way, t - way * TINY, t + way * TINY)
        assert [found.count("turning", end) for end in ends] == [1, 0, 0, 1]
        for event, other in (("turning", -1 - n), ("turning", 1), ("reversal", 0), ("cusp", 0)):
            with pytest.raises(Impossible, match="does not happen"):
                found.time(event, other)
    at_rest = enclosed(named("separatrix"))
    assert at_rest.count("turning", 0) == at_rest.count("turning", -9) == 1
    assert at_rest.time("turning", 0).middle == 0


@pytest.mark.parametrize(("args", "each"), [
    (LOOPS, (2, 2, 0)), (RISING, (2, 2, 0)), (DROPPED, (2, 0, 1)), (FREE, (2, 2, 0)),
])  # fmt: skip
def test_a_million_million_periods_away(args, each):
    """Counts are what the period, to 60 digits, says."""
    found, period = enclosed(motion(*args)), enclosed(motion(*args), 60).period
    part, far = period.middle / 1000, 10**12 * period.middle
    for event, number in zip(EVENTS, each, strict=True):
        first, few = found.count(event, 0), found.count(event, part)
        assert found.count(event, far + part) == number * 10**12 + few
        assert found.count(event, part - far) == number * 10**12 + first - few
    moved = found.time("turning", 2 * 10**12).middle - found.time("turning", 0).middle
    assert abs(moved - far) < 10**12 * period.spread + TINY


def test_an_end_that_is_exactly_an_event_cannot_be_told_from_its_sides():
    """T = 2π/5 without weight: after a period, no bits tell the end from the turning point."""
    found = enclosed(motion(*FREE))
    found.motion.limit = 512
    with pytest.raises(Unseparated, match="an event and the end of the span differ by less"):
        found.count("turning", Exact.of("2*pi/5"))
    assert found.count("turning", Exact.of("2*pi/5") - Exact.of("1e-60")) == 2
    assert found.count("turning", Exact.of("2*pi/5") + Exact.of("1e-60")) == 3
    assert found.time("turning", 2).mid == pytest.approx(2 * np.pi / 5, rel=1e-15)


def test_a_list_of_too_many_events_and_another_event_are_refused():
    with pytest.raises(Impossible, match="10000000 are the most"):
        named("loops").events("turning").times(0, 10**30)
    with pytest.raises(Impossible, match="event: turning, reversal or cusp, not 'cups'"):
        named("loops").events("cups")
