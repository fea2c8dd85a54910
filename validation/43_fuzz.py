"""Random scenes where numbers break: no call is wrong beyond what it says of itself.

Over 16 decades, at the poles and past them, beside cusps. Every number of more digits, every count
of events and every turn is held against the closed form; a miss is what is wrong and was not said.
"""

from __future__ import annotations

import math
import random
import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
from tools import Digits, main

import heavytop as ht
from heavytop.claims import proof
from heavytop.errors import Impossible

# --- scenes ----------------------------------------------------------------------------------

FAMILIES = ("any", "pole-start", "close-pass", "cusp-kick", "sleeper", "steady", "planar", "fast")


def scenes(seed: int, count: int, families: tuple[str, ...] = FAMILIES) -> Iterator[ht.Scene]:
    """Yield random scenes, each named by its family, seed and number; the span is a few nods."""
    for number in range(count):
        family = families[number % len(families)]
        yield scene(family, random.Random(f"{family} {seed} {number}"), f"{family}-{seed}-{number}")


def scene(family: str, draw: random.Random, name: str) -> ht.Scene:
    """Return one random scene of a family: the same for the same state of `draw`."""
    while True:
        try:
            top = _top(draw)
            start = _START[family](draw, top)
            time = _rate(top, start) ** -1 * draw.uniform(0.5, 40) * draw.choice((1, 1, -1))
            return ht.Scene(top, start, time=time, name=name)
        except Impossible:
            continue


def _top(draw: random.Random) -> ht.Top:
    A = 10 ** draw.uniform(-8, 8)
    C = A * draw.choice((draw.uniform(0.02, 2), 10 ** draw.uniform(-4, 0), 1.0))
    sign = draw.choice((1, 1, 1, -1))
    return ht.Top(A, C, sign * A * 10 ** draw.uniform(-4, 4))


def _slow(top: ht.Top) -> float:
    """Return the rate of the pendulum that the top would be without spin [rad/s]."""
    return math.sqrt(abs(float(top.gMR)) / float(top.A))


def _rate(top: ht.Top, start: ht.State) -> float:
    """Return about how fast it nods [rad/s]."""
    spin = float(top.C) / float(top.A) * abs(float(start.omega3))
    return _slow(top) + spin + abs(float(start.phidot)) + abs(float(start.thetadot))


def _sleeping(top: ht.Top) -> float:
    """Return the spin rate from which on it sleeps [rad/s]."""
    return 2 * float(top.A) / float(top.C) * _slow(top)


def _signed(draw: random.Random, low: float, high: float) -> float:
    return draw.choice((-1, 1)) * 10 ** draw.uniform(low, high)


def _tiny_tilt(draw: random.Random) -> float:
    tilt = 10 ** draw.uniform(-12, -1)
    return tilt if draw.random() < 0.75 else math.pi - tilt


def _any(draw: random.Random, top: ht.Top) -> ht.State:
    slow = _slow(top)
    return ht.State(
        theta=draw.uniform(0.01, 3.13),
        phi=draw.uniform(-3, 3),
        psi=draw.uniform(-3, 3),
        thetadot=slow * _signed(draw, -3, 1),
        phidot=slow * _signed(draw, -3, 1),
        psidot=_sleeping(top) * _signed(draw, -2, 1),
    )


def _pole_start(draw: random.Random, top: ht.Top) -> ht.State:
    slow = _slow(top)
    return ht.State(
        theta=0 if draw.random() < 0.6 else "pi",
        phi=draw.uniform(-7, 7),
        psi=draw.uniform(-7, 7),
        thetadot=slow * 10 ** draw.uniform(-3, 1),
        psidot=draw.choice((0.0, _sleeping(top) * _signed(draw, -3, 1))),
    )


def _close_pass(draw: random.Random, top: ht.Top) -> ht.State:
    slow = _slow(top)
    return ht.State(
        theta=_tiny_tilt(draw),
        phi=draw.uniform(-3, 3),
        thetadot=slow * draw.choice((0.0, _signed(draw, -3, 1))),
        phidot=slow * draw.choice((0.0, _signed(draw, -3, 1))),
        psidot=_sleeping(top) * _signed(draw, -3, 0.5),
    )


def _cusp_kick(draw: random.Random, top: ht.Top) -> ht.State:
    return ht.State(
        theta=draw.choice((draw.uniform(0.05, 3.0), 10 ** draw.uniform(-6, -1))),
        phidot=_slow(top) * draw.choice((0.0, _signed(draw, -15, -9), _signed(draw, -9, -1))),
        psidot=_sleeping(top) * _signed(draw, -0.5, 0.7),
    )


def _sleeper(draw: random.Random, top: ht.Top) -> ht.State:
    near = 1 + _signed(draw, -12, -1)
    return ht.State(
        theta=10 ** draw.uniform(-12, -2),
        phidot=_slow(top) * draw.choice((0.0, _signed(draw, -6, 0))),
        psidot=_sleeping(top) * near * draw.choice((-1, 1)),
    )


def _steady(draw: random.Random, top: ht.Top) -> ht.State:
    theta, omega3 = draw.uniform(0.1, 1.5), _sleeping(top) * 10 ** draw.uniform(0.1, 0.7)
    A, C, gMR = (float(x) for x in (top.A, top.C, top.gMR))
    p_psi = C * omega3
    root = math.sqrt(abs(p_psi**2 - 4 * A * gMR * math.cos(theta)))
    phidot = 2 * gMR / (p_psi + root) * (1 + _signed(draw, -14, -2))
    return ht.State.kicked(theta=theta, omega3=omega3, phidot=phidot)


def _planar(draw: random.Random, top: ht.Top) -> ht.State:
    slow = _slow(top)
    theta = draw.choice((0, "pi/3", "2*pi/3", "pi/2", "pi", draw.uniform(0, math.pi)))
    return ht.State(
        theta=theta, phi=draw.uniform(-3, 3), psi=1.0, thetadot=slow * _signed(draw, -2, 1)
    )


def _fast(draw: random.Random, top: ht.Top) -> ht.State:
    return ht.State(
        theta=draw.choice((draw.uniform(0.05, 3.0), _tiny_tilt(draw))),
        thetadot=_slow(top) * draw.choice((0.0, _signed(draw, -3, 2))),
        phidot=_slow(top) * draw.choice((0.0, _signed(draw, -3, 2))),
        psidot=_sleeping(top) * _signed(draw, 1, 4),
    )


_START = {
    "any": _any,
    "pole-start": _pole_start,
    "close-pass": _close_pass,
    "cusp-kick": _cusp_kick,
    "sleeper": _sleeper,
    "steady": _steady,
    "planar": _planar,
    "fast": _fast,
}


# --- runs by name, in more digits and continued ----------------------------------------------
# A run of few digits goes over 1 to 1e5 periods, by auto and by name, half of them with samples
# that are whole periods apart. Reversals are counted here by the signs of φ̇ at the turning points.

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


def run_misses(seed: int, count: int, ways: tuple[str, ...] = WAYS) -> list[str]:
    """Return a line for each scene on which a call is wrong, and does not say so."""
    return [*found_misses(seed, count, ways)]


def found_misses(seed: int, count: int, ways: tuple[str, ...]) -> Iterator[str]:
    """Yield them as they are found."""
    for number, scene in enumerate(scenes(seed, count)):
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
        except (ht.BadScene, ht.EndedEarly):  # which says so
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
    if not found.in_doubles:
        known = found.in_mpmath()
        samples = [*map(known.at, range(len(known.t)))]
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
    blur = 1e-9 if found.in_doubles else 10.0**-scene.digits
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
    if not found.in_doubles or form.period is None or not len(turning):
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


# --- turns near the poles --------------------------------------------------------------------
# Scenes whose phi and psi turn fast, by auto, by the attitude and by the axis form. A run is wrong
# where something in it is nan, where phi or psi is off by more than the error of the axis explains
# at its tilt, where `run_errors` says less than it is off, and by auto where digits are missed and
# that is not said.

TURNING = ("pole-start", "close-pass", "planar", "sleeper", "any")
FOLLOWING = ("auto", "attitude", "axis")
TRUE_DIGITS = 40
PATIENCE_S = 2.0  # of a run, as it is estimated
TURNED = 0.1  # rad; a lost turn is 6.28
EXPLAINED = 50.0  # how many times as far as the axis at its tilt an angle may be off
WITNESSED = 1e-13  # relative: what the witness in doubles may itself be off
ANGLES = ("theta", "phi", "psi")


def turn_misses(seed: int, count: int) -> list[str]:
    """Return a line for each run of the scenes that is wrong beyond what it says of itself."""
    return [
        f"{scene.name} {formulation}: {wrong}"
        for scene in scenes(seed, count, TURNING)
        for formulation in FOLLOWING
        for wrong in _turned_wrong(replace(scene, quantities=ANGLES, samples=12), formulation)
    ]


def _turned_wrong(scene: ht.Scene, formulation: str) -> Iterator[str]:
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            if ht.plan(scene, formulation).seconds > PATIENCE_S:
                return
            run = ht.propagate(scene, formulation=formulation, step_limit=200_000)
        except (ht.BadScene, ht.EndedEarly):
            return  # and says so
    told = [str(each.message) for each in said if issubclass(each.category, ht.DoubtfulWarning)]
    try:
        truth = _truth(run)
    except ht.NoClosedForm:
        return
    yield from _not_numbers(run)
    exact = {x: np.array([float(getattr(e, x)) for e in truth]) for x in ANGLES}
    axis = np.array([[float(x) for x in e.axis] for e in truth])
    off = {x: np.abs(getattr(run.samples, x) - exact[x]) for x in ANGLES}
    strayed = np.linalg.norm(run.axis - axis, axis=1)
    sine = np.sin(exact["theta"])
    known = EXPLAINED * (strayed.max() + 1e-15 * sine.max()) / np.maximum(sine, 1e-300)
    for name in ("phi", "psi"):
        if (lost := off[name][(known < 1) & (off[name] > known + TURNED)]).size:
            turns, astray = lost.max() / (2 * np.pi), strayed.max()
            yield f"{name} off by {turns:.3g} turns, the axis by {astray:.1e}"
    claimed = ht.run_errors(run)
    for name in ANGLES:
        size = max(1.0, np.abs(exact[name]).max())
        says, most = getattr(claimed, name), np.nanmax(off[name])
        if says is not None and not most <= 1.5 * says + WITNESSED * size:
            yield f"{name} off by {most:.1e}, run_errors says {says:.1e}"
        if formulation == "auto" and not told and most > 2 * 10.0**-scene.digits * size:
            yield f"{name} off by {most:.1e}, without a warning"


def _not_numbers(run: ht.Trajectory) -> Iterator[str]:
    s = run.samples
    parts = {x: getattr(s, x) for x in (*ANGLES, "thetadot", "phidot", "psidot", "quaternion")}
    for name, part in (parts | {"phi of an event": run.events.phi}).items():
        if not np.isfinite(part).all():
            yield f"{name} is nan {np.count_nonzero(~np.isfinite(part))} times"


def _truth(run: ht.Trajectory) -> list:
    from heavytop.run.own_motion import own_motion

    times = [float(t) for t in run.t]
    if not run.in_doubles:
        times = run.in_mpmath().t
    form = Digits(own_motion(run), TRUE_DIGITS)
    return [form(form.ctx.mpf(t)) for t in times]


# --- many tops at once -----------------------------------------------------------------------
# Wrong is an axis or a θ farther off than `Ensemble.error` says, or than is asked without a mark,
# or a wrong number of events without a mark.

WATCHED = ("turning", "reversal")
NAMES = ("A", "C", "gMR", "theta", "thetadot", "phi", "phidot", "psi", "psidot", "time")
GROUP = 400
MANY_DIGITS = 12


def many_misses(
    seed: int, count: int, formulation: str = "axis", stretch: float = 1.0
) -> list[str]:
    """One line for each top that is wrong beyond what the run says of it."""
    found: list[str] = []
    every = list(scenes(seed, count))
    for at in range(0, count, GROUP):
        found += _group(every[at : at + GROUP], formulation, stretch)
    return found


def _group(some: list[ht.Scene], formulation: str, stretch: float) -> list[str]:
    tops = [_columns(scene, stretch) for scene in some]
    columns = {name: np.array([top[name] for top in tops]) for name in NAMES}
    run = ht.propagate_many(**columns, formulation=formulation, events=WATCHED, digits=MANY_DIGITS)
    lines = []
    for i, (scene, top) in enumerate(zip(some, tops, strict=True)):
        if said := _wrong_of_many(run, i, top):
            lines.append(f"{scene.name} by {formulation}: {said}")
    return lines


def _columns(scene: ht.Scene, stretch: float) -> dict[str, float]:
    parts = [
        *(getattr(scene.top, n) for n in NAMES[:3]),
        *(getattr(scene.start, n) for n in NAMES[3:9]),
    ]
    return dict(zip(NAMES, map(float, (*parts, scene.time)), strict=True)) | {
        "time": float(scene.time) * stretch
    }


def _wrong_of_many(run: ht.Ensemble, i: int, top: dict[str, float]) -> str:
    """What is wrong of one top, in words; or nothing."""
    given = {name: top[name] for name in NAMES[3:9]}
    motion = ht.Motion(ht.Top(*(top[name] for name in NAMES[:3])), ht.State(**given))
    from heavytop.run.events import tally

    try:
        exact = motion.at(top["time"], 40)
        counted = tally(motion, top["time"], WATCHED)
    except ht.HeavyTopError:  # no closed form to hold it against
        return ""
    off = abs(run.final.theta[i] - float(exact.theta))
    across = np.linalg.norm(run.final.axis[i] - [float(x) for x in exact.axis])
    off = max(off, across) if np.isfinite(across) else off
    allowed = 10.0**-MANY_DIGITS * max(1.0, float(exact.theta))
    if off > run.error[i]:
        return f"off by {off:.1e}, and {run.error[i]:.1e} is said"
    if not run.missed[i] and not off <= allowed:
        return f"off by {off:.1e}, and not marked"
    for event in WATCHED:
        number = run.count(event)[i]
        least, most = (0, 0) if counted is None else counted[event]
        if motion.kind == "separatrix" and event == "turning":  # which has one, or none
            most = 1
        if not run.missed[i] and not least <= number <= most:
            return f"{number} {event} points, not {least}, and not marked"
    return ""


# --- what is claimed -------------------------------------------------------------------------


def held(what, misses, seed, count):
    wrong = list(misses(seed, count))
    print(*wrong, sep="\n")
    return f"{what}: {count} random cases, silently wrong", len(wrong), 0


@proof(minutes=6)
def runs(seed=0, count=504):
    yield held("runs by name, in more digits and continued", run_misses, seed, count)


@proof(minutes=3)
def turns(seed=0, count=504):
    yield held("turns near the poles", turn_misses, seed, count)


@proof(minutes=1)
def many(seed=0, count=4032):
    yield held("many tops at once", many_misses, seed, count)


if __name__ == "__main__":
    main()
