"""Random runs by every door: in doubles by each form's name, in more digits, and continued.

Each is held against the closed form at more digits than it has. A miss is a count of events that
is not the true one, the time of one, or a digit that was asked for and is not there, where the call
said nothing. Reversals are counted here by the signs of φ̇ at the turning points and at the ends.
Runs of few digits go over 1 to 1e5 periods, by auto and by name, half of them with samples that
are whole periods apart.
"""

from __future__ import annotations

import argparse
import math
import random
import warnings
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

import fuzz
import numpy as np
from digits import Digits

import heavytop as ht
from heavytop.errors import BadScene, EndedEarly

ALL = ("turning", "reversal", "cusp")
FORMS = ("axis", "attitude", "cubic", "routh", "subsystem", "lagrange")
REGULAR = ("axis", "attitude", "cubic", "auto")  # at the poles
STEPS = 30_000  # of forms that are singular there
SPARE = 20  # digits of what is held against, beyond those of a run
FEW = (2, 3, 4, 6, 9, 12)  # digits
MOST_LATE = 500  # events whose times are looked at
LOOKED_AT = 30  # samples, and times between
ON_A_POLE = 1e-18  # of 1 ∓ u: nearer, rounding of the time decides the side of a pass
COUNTED = 300  # periods up to which reversals are counted
WAYS = ("doubles", "more", "extended", "few")


def misses(seed: int, count: int, ways: tuple[str, ...] = WAYS) -> list[str]:
    """Return a line for each scene on which a call is wrong, and does not say so."""
    return [*found_misses(seed, count, ways)]


def found_misses(seed: int, count: int, ways: tuple[str, ...]) -> Iterator[str]:
    """Yield them as they are found."""
    for number, scene in enumerate(fuzz.scenes(seed, count)):
        way = ways[number // 8 % len(ways)]  # each family goes every way
        lines = WAY[way](scene, random.Random(f"{way} {scene.name}"))
        about = f"{scene.top}, {scene.start}, {scene.time} s"
        yield from (f"{scene.name} {way} {line}; {about}" for line in lines)


def _doubles(scene: ht.Scene, _draw: random.Random) -> Iterator[str]:
    for form in FORMS:
        yield from _judged(form, _wanting(scene, form, 12), lambda s, f=form: _run(s, f))


def _more(scene: ht.Scene, draw: random.Random) -> Iterator[str]:
    form, digits = draw.choice(REGULAR), draw.choice((14, 15, 20, 24, 30, 40))
    run: Callable[[ht.Scene], Any] = lambda s: _run(s, form)  # noqa: E731
    yield from _judged(f"{form} {digits}", _wanting(scene, form, digits), run)


def _extended(scene: ht.Scene, draw: random.Random) -> Iterator[str]:
    form, digits = draw.choice((*FORMS, "auto")), draw.choice((8, 12, 12, 20))
    part = draw.choice((0.5, 0.01)) * float(scene.time)

    def run(whole: ht.Scene) -> Any:
        with warnings.catch_warnings():  # of the part
            warnings.simplefilter("ignore")
            first = _run(_like(whole, part), form)
        return ht.extend(first, whole.time, samples=16)

    yield from _judged(f"{form} {digits}", _wanting(scene, form, digits), run)


def _few(scene: ht.Scene, draw: random.Random) -> Iterator[str]:
    motion = ht.Motion(scene.top, scene.start)
    if motion.period is None:
        return
    form, digits = draw.choice(("auto", "auto", *FORMS)), draw.choice(FEW)
    periods = 10 ** draw.uniform(0, 5 if form in REGULAR else 3)
    wants = [("theta",), ("theta", "phi"), ("axis",), ("theta", "psi"), ("theta", "phi", "psi")]
    span, samples = {"periods": periods}, 401
    if draw.random() < 0.5:
        span, samples = {"periods": round(periods)}, 1 + max(1, round(periods / 256))
        span = {"periods": (samples - 1) * max(1, round(periods / (samples - 1)))}
    asked = ht.Scene(
        scene.top, scene.start, **span,
        quantities=wants[0] if form == "cubic" else draw.choice(wants),
        events=draw.choice((("turning",), ALL if periods < COUNTED else (), ())), samples=samples,
        digits=digits, name=scene.name,
    )  # fmt: skip
    projected = form in ("axis", "attitude") and draw.random() < 0.3
    limit = None if form in REGULAR else STEPS
    run: Callable[[ht.Scene], Any] = lambda s: ht.propagate(  # noqa: E731
        s, formulation=form, projected=projected, step_limit=limit
    )
    how = f"{form}{' projected' if projected else ''} {digits} digits {asked.quantities} {span}"
    yield from _judged(how, asked, run)


WAY = {"doubles": _doubles, "more": _more, "extended": _extended, "few": _few}


def _run(scene: ht.Scene, form: str) -> Any:
    limit = None if form in REGULAR else STEPS
    return ht.propagate(scene, formulation=form, step_limit=limit)


def _wanting(scene: ht.Scene, form: str, digits: int) -> ht.Scene:
    wants = ("theta",) if form == "cubic" else ("theta", "phi", "psi")
    return ht.Scene(
        scene.top, scene.start, time=scene.time, quantities=wants, events=ALL, samples=9,
        digits=digits, name=scene.name,
    )  # fmt: skip


def _like(scene: ht.Scene, time: float) -> ht.Scene:
    return ht.Scene(
        scene.top, scene.start, time=time, quantities=scene.quantities, events=ALL, samples=9,
        digits=scene.digits, name=scene.name,
    )  # fmt: skip


def _judged(what: str, scene: ht.Scene, run: Callable[[ht.Scene], Any]) -> Iterator[str]:
    """Yield what is wrong with a run, and was not said."""
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        try:
            found = run(scene)
        except (BadScene, EndedEarly):  # which says so
            return
        except Exception as error:
            yield f"{what}: raised {type(error).__name__}: {error}"
            return
    said = [each.message for each in heard if issubclass(each.category, ht.DoubtfulWarning)]
    if not any(isinstance(each, ht.MissedDigitsWarning) for each in said):
        yield from (f"{what}: {line}" for line in _digits_missed(scene, found) if not said)
    if not said:
        yield from (f"{what}: {line}" for line in _events_missed(scene, found))
        yield from (f"{what}: {line}" for line in _events_late(scene, found))


def _digits_missed(scene: ht.Scene, found: Any) -> Iterator[str]:
    motion = ht.Motion(scene.top, scene.start)
    form = Digits(motion, scene.digits + SPARE)
    ctx, bound = form.ctx, 10.0**-scene.digits
    passing = str(motion.kind) in ("through-top", "through-bottom", "planar-pendulum")
    end = form(ctx.mpf(found.t[-1]))
    sizes = {
        name: 1 if name == "axis" else max(1, abs(getattr(end, name))) for name in scene.quantities
    }
    if found.decimals:
        samples = [*found.decimals.samples]
    else:
        some = range(len(found.t) - 1, -1, -max(1, len(found.t) // LOOKED_AT))
        samples = [*map(found.samples.at, some)]
        draw = random.Random(scene.name)
        between = found(float(found.t[-1]) * np.array([draw.random() for _ in range(LOOKED_AT)]))
        samples += map(between.at, range(LOOKED_AT))
    for sample in samples:
        exact = form(ctx.mpf(sample.t))
        for name in scene.quantities:
            mine, true = getattr(sample, name), getattr(exact, name)
            if name != "axis" and mine != mine:  # on a pole, in more digits
                continue
            if name == "axis":
                off = ctx.norm([ctx.mpf(x) - y for x, y in zip(mine, true, strict=True)])
            else:
                off = ctx.mpf(mine) - true
            if passing and name in ("phi", "psi"):  # either way round; on a pole, of either side
                turn = ctx.pi if 1 - abs(exact.u) < ON_A_POLE else 2 * ctx.pi
                off -= turn * ctx.nint(off / turn)
            if not abs(off) <= bound * sizes[name]:
                yield f"{name} off by {float(off):.1e} of {bound:.0e} at {float(sample.t):.6g} s"
                return


def _events_missed(scene: ht.Scene, found: Any) -> Iterator[str]:
    blur = 1e-9 if found.decimals is None else 10.0**-scene.digits
    motion = Digits(ht.Motion(scene.top, scene.start), 100)
    end = (
        scene.periods.mpf(motion.ctx) * motion.period
        if scene.time is None
        else scene.time.mpf(motion.ctx)
    )
    counts = [true_counts(scene, end, side * blur) for side in (-1, 1)]
    if None in counts:
        return
    for name in scene.events:
        low, high = (each[name] for each in counts)
        if not low <= found.events.count(name) <= high:
            yield f"{found.events.count(name)} {name}, not {low}" + f" to {high}" * (low < high)


def _events_late(scene: ht.Scene, found: Any) -> Iterator[str]:
    """Times of turning points, in doubles: by 10^-digits (T + 1/|θ̈|), with θ̈ of the closed form."""
    motion, turning = ht.Motion(scene.top, scene.start), found.events.of("turning")
    form = Digits(motion, 40)
    if found.decimals or form.period is None or not len(turning):
        return
    ctx, half, first = form.ctx, form.period / 2, form.lower_turning
    allowed = []
    for at in (form(first), form(first + half)):  # all others are like these
        sine = ctx.sqrt(abs((1 - at.u) * (1 + at.u)))
        allowed.append(1.01 * 10.0**-scene.digits * (form.period + sine / abs(at.uddot)))
    for k in {*range(0, len(turning), max(1, len(turning) // MOST_LATE)), len(turning) - 1}:
        t = ctx.mpf(float(turning.t[k])) + ctx.mpf(float(turning.t_low[k]))
        n = int(ctx.nint((t - first) / half))
        late = t - first - n * half
        if not abs(late) <= allowed[n % 2]:
            yield f"turning point {k} late by {float(late):.1e} of {float(allowed[n % 2]):.1e} s"
            return


def true_counts(scene: ht.Scene, end: Any, slack: float) -> dict[str, int] | None:
    """Return how many events there are up to so much of a period and of the span beyond its end."""
    motion = ht.Motion(scene.top, scene.start)
    form = Digits(motion, 100)
    ctx, first, period = form.ctx, form.lower_turning, form.period
    if period is None or str(motion.kind) == "undecided":
        return None
    sign = 1 if end >= 0 else -1
    late, tiny = max(abs(end) + slack * (abs(end) + period), 0), ctx.mpf(10) ** -60 * period
    low, half = math.ceil((-tiny - sign * first) / (period / 2)), period / 2
    turning = []
    while (t := sign * first + low * half) <= late:
        turning.append((t, low % 2 == 0))
        low += 1
    cusps = sum(not lower for _, lower in turning) if str(motion.kind) == "cusps" else 0
    reversals = 0
    if "reversal" in scene.events and str(motion.kind) in ("loops", "waves", "force-free"):
        ways = [form(sign * t).phidot for t in (tiny, *(t for t, _ in turning if t > tiny), late)]
        reversals = sum((a > 0) != (b > 0) for a, b in pairwise(ways))
        reversals += scene.start.phidot.sign() == 0
    return {"turning": len(turning), "reversal": reversals, "cusp": cusps}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=500)
    parser.add_argument("--ways", default=",".join(WAYS))
    given = parser.parse_args()
    count, ways = 0, tuple(given.ways.split(","))
    for line in found_misses(given.seed, given.count, ways):
        print(line, flush=True)
        count += 1
    print(f"{count} misses in {given.count} scenes")


if __name__ == "__main__":
    main()
