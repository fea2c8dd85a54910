"""Counts and times of events, proved, against signs of rates at many times and against `tally`."""

import random
from fractions import Fraction

import mpmath
import numpy as np
import pytest

import heavytop as ht
from heavytop.errors import Impossible, Unseparated
from heavytop.numbers import Exact
from heavytop.run.events import tally

from ..motions import SCENES, motion, named, shipped

EVENTS = ("turning", "reversal", "cusp")
TINY = Fraction(1, 10**30)
PER_PERIOD = 20_000


def enclosed(begun, digits=40, **limit):
    return ht.enclose(begun.top, begun.start, digits, **limit)


def changes(begun, end):
    """How often θ̇ and φ̇ change their signs from just after the start to an end, in doubles.

    A reversal is a change of sign of φ̇; nothing here knows where turning points or reversals are.
    """
    periods = abs(end) / begun.period if begun.period else 1.0
    t = np.linspace(0, end, int(PER_PERIOD * (periods + 1)))[1:]
    at = begun.at(t)
    signs = (np.sign(rate[np.abs(rate) > 0]) for rate in (at.thetadot, at.phidot))
    return [int(np.sum(one[1:] != one[:-1])) for one in signs]


def begins(begun):
    """Events at the start itself, which the signs after it do not show: turning and reversal."""
    start, on_pole = begun.start, begun.from_top * begun.from_bottom == 0
    at_rest = start.thetadot.sign() == 0
    reverses = start.phidot.sign() == 0 and not at_rest and begun.exact.reversal is not None
    turns = at_rest or (on_pole and begun.start.theta in (Exact.of(0), Exact.of("pi")))
    return turns, reverses


def counted(found, end):
    return tuple(found.count(event, end) for event in EVENTS)


def held(begun, end):
    """Counts to an end against signs and against `tally`."""
    found = counted(enclosed(begun), end)
    turning, reversal, cusp = found
    there = tally(begun, end)
    if there is not None:
        for event, number in zip(EVENTS, found, strict=True):
            least, most = there[event]
            assert least <= number <= most, event
    if not begun.nutates:
        return found
    by_sign = changes(begun, end)
    at_start = begins(begun)
    assert turning == by_sign[0] + at_start[0]
    assert reversal == by_sign[1] + at_start[1]
    if begun.rising.cusps:
        assert reversal == 0
        assert 0 <= 2 * cusp - turning + 1 <= 2
    else:
        assert cusp == 0
    return found


@pytest.mark.parametrize("end", [3.37, -2.21])
@pytest.mark.parametrize("name", SCENES)
def test_shipped_scenes(name, end):
    """Over a few periods, forwards and backwards."""
    begun = shipped(name)
    held(begun, end * (begun.period or 1.0))


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
    """Two hundred of them, either direction of time."""
    draw, reversals = random.Random(0), 0
    for _ in range(200):
        begun = drawn(draw)
        end = draw.choice([1, -1]) * draw.uniform(0.2, 3.3) * (begun.period or 1.0)
        reversals += held(begun, end)[1]
    assert reversals > 50


LOOPS = (2, 1, 3, "0.5", 0, 0, 0, -2, 5)
RISING = (2, 1, 3, "0.8", 0, 0, -1, 0, 5)  # φ̇₀ = 0 on the way up
FALLING = (2, 1, 3, "0.8", 0, 0, 1, 0, 5)
DROPPED = (2, 1, 3, "0.5", 0, 0, 0, 0, 7)
UPSIDE_DOWN = (2, 1, -3, "2.6", 0, 0, 0, 0, 7)
FREE = (1, 1, 0, "pi/2", 0, 0, 0, 3, 4)  # T = 2π/5
LEAST = Fraction(1, 10**12)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(
    ("args", "first"),
    [(LOOPS, (1, 0, 0)), (RISING, (0, 1, 0)), (FALLING, (0, 1, 0)), (DROPPED, (1, 0, 1)),
     (UPSIDE_DOWN, (1, 0, 1)), (FREE, (1, 0, 0)),
     ((2, 1, 3, "1.5", 0, 0, -1, "0.5", 3), (0, 0, 0))],
)  # fmt: skip
def test_the_start_is_an_event_that_counts(args, first, side):
    """Exactly on a turning point, a reversal or a cusp; an instant later nothing is added."""
    found = enclosed(motion(*args))
    assert counted(found, 0) == counted(found, side * LEAST) == first
    for event, number in zip(EVENTS, first, strict=True):
        if number:
            assert found.time(event, 0).middle == found.time(event, 0).spread == 0


def changes_sign(found, rate, t, beside):
    before, after = (found.rates(t + side * beside)[rate] for side in (-1, 1))
    return before.upper * after.lower < 0 or before.lower * after.upper < 0


@pytest.mark.parametrize("args", [LOOPS, RISING, FALLING, DROPPED, UPSIDE_DOWN, FREE,
                                  (2, 1, -3, "0.5", 0, 0, "0.3", -2, 5)])  # fmt: skip
def test_just_before_and_just_after_an_event(args):
    """1e-30 s decide; times are in order, none is left out, and there rates change their signs."""
    found = enclosed(motion(*args), 50)
    for event in EVENTS:
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
                    assert changes_sign(found, rate, t.middle, Fraction(1, 10**15))


def test_near_a_cusp_what_is_and_what_is_not():
    """φ̇₀ = ±1e-30: a loop has two reversals within 1e-15 of a period, a wave has none."""
    for side, reversals in ((-1, 6), (1, 0)):
        begun = motion(2, 1, 3, "0.5", 0, 0, 0, side * TINY, 7)
        found = enclosed(begun, 60)
        assert found.count("cusp", 0) == 0
        end = Fraction(begun.period * 3)
        assert found.count("turning", end - Fraction(1, 100)) == 6
        # the loop is at the start: half of it lies before
        assert found.count("reversal", end - Fraction(1, 100)) == max(reversals - 1, 0)
        if reversals:
            first = found.time("reversal", 0)
            assert 0 < first.lower < first.upper < 1e-14 * begun.period
            assert found.time("reversal", -1).middle < 0


@pytest.mark.parametrize("gMR", [2, -2])
def test_an_axis_that_tends_to_the_vertical_turns_once(gMR):
    """At the start, after it or before it; further events do not happen."""
    theta, spin = ("pi/3", 1) if gMR > 0 else ("2*pi/3", -1)
    spins = {"psidot": Fraction(5 * spin, 2), "phidot": 1}
    for thetadot in ("0.5", "-0.5"):
        falls = (thetadot[0] != "-") == (gMR > 0)
        begun = motion(2, 1, gMR, theta, thetadot=thetadot, **spins)
        assert begun.regime == "asymptotic"
        found = enclosed(begun)
        way, n = (1, 0) if falls else (-1, -1)
        t = found.time("turning", n)
        assert t.middle * way > 0
        assert found.theta(t.middle).mid == pytest.approx(
            found.theta_max.mid if gMR > 0 else found.theta_min.mid, abs=1e-15
        )
        assert found.count("turning", 100 * way) == 1
        assert found.count("turning", -100 * way) == 0
        assert found.count("turning", t.middle - way * TINY) == 0
        assert found.count("turning", t.middle + way * TINY) == 1
        assert found.count("reversal", 100) == found.count("cusp", 100) == 0
        for event, other in (("turning", -1 - n), ("turning", 1), ("reversal", 0), ("cusp", 0)):
            with pytest.raises(Impossible, match="does not happen"):
                found.time(event, other)
    at_rest = enclosed(motion(2, 1, 2, "pi/3", phidot="2/sqrt(3)", psidot="5/sqrt(3)"))
    assert at_rest.count("turning", 0) == at_rest.count("turning", -9) == 1
    assert at_rest.time("turning", 0).middle == 0


@pytest.mark.parametrize("name", ["uniform", "sleeping", "at rest"])
def test_a_constant_tilt_has_no_events(name):
    found = enclosed(named(name))
    for event in EVENTS:
        assert found.count(event, 10) == found.count(event, "-1e20") == 0
        with pytest.raises(Impossible, match="does not happen"):
            found.time(event, 0)


@pytest.mark.parametrize("args", [LOOPS, RISING, DROPPED, UPSIDE_DOWN, FREE])
def test_a_million_million_periods_away(args):
    """Counts are what the period, to 60 digits, says."""
    begun = motion(*args)
    found, period = enclosed(begun), enclosed(begun, 60).period
    each = {"turning": 2, "reversal": 2 if begun.exact.reversal is not None else 0}
    each |= {"cusp": 1 if begun.rising.cusps else 0}
    part = period.middle / 1000
    for event in EVENTS:
        first, few = found.count(event, 0), found.count(event, part)
        assert found.count(event, 10**12 * period.middle + part) == each[event] * 10**12 + few
        back = found.count(event, part - 10**12 * period.middle)
        assert back == each[event] * 10**12 + first - few
    far = found.time("turning", 2 * 10**12)
    here = found.time("turning", 0)
    assert abs(far.middle - here.middle - 10**12 * period.middle) < 10**12 * period.spread + TINY


def test_an_end_that_is_exactly_an_event_cannot_be_told_from_its_sides():
    """T = 2π/5 without weight: after a period, no bits tell the end from the turning point."""
    found = enclosed(motion(*FREE), limit=512)
    with pytest.raises(Unseparated, match="an event and the end of the span differ by less"):
        found.count("turning", Exact.of("2*pi/5"))
    assert found.count("turning", Exact.of("2*pi/5") - Exact.of("1e-60")) == 2
    assert found.count("turning", Exact.of("2*pi/5") + Exact.of("1e-60")) == 3
    assert found.time("turning", 2).mid == pytest.approx(2 * np.pi / 5, rel=1e-15)


def test_the_time_between_reversals_by_quadrature():
    """From a/b = u up to u₂ and back, by mpmath.quad of 1/√f: an authority outside FLINT."""
    begun = motion(*LOOPS)
    found, mp = enclosed(begun), mpmath.MPContext()
    mp.dps = 60
    form = begun.form(50)
    r = form.reduced
    u1, u2, u3 = map(mp.mpf, form.roots)
    g, stop = mp.mpf(r.g), mp.mpf(r.a) / mp.mpf(r.b)
    # u = u₂ − x², and so du/√(2g (u − u₁)(u₂ − u)(u₃ − u)) = 2 dx/√(2g (u − u₁)(u₃ − u))
    rate = lambda x: 2 / mp.sqrt(2 * g * (u2 - x * x - u1) * (u3 - u2 + x * x))  # noqa: E731
    above = 2 * mp.quad(rate, [0, mp.sqrt(u2 - stop)])
    times = [found.time("reversal", n).middle for n in range(3)]
    gaps = sorted((times[1] - times[0], times[2] - times[1]))
    T = mp.mpf(form.period)
    for gap, want in zip(gaps, sorted((above, T - above)), strict=True):
        assert abs(mp.mpf(gap.numerator) / gap.denominator - want) < mp.mpf(10) ** -35
