"""Making a fold: the scene's exact numbers, integrated with as many bits as it takes."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from time import perf_counter

from heavytop.errors import BadScene, Fault
from heavytop.integration.bits import enough
from heavytop.integration.folding import Folding
from heavytop.integration.precise import Unfinished
from heavytop.numbers import PI, Exact
from heavytop.numbers.decimals import Context, Number, context
from heavytop.run.estimates import FOLDED_REACH, MOST_TURNS, needed_to_fold
from heavytop.run.folds.nodding import Nodding
from heavytop.run.folds.starting import constants, state
from heavytop.run.folds.uniform import Uniform
from heavytop.scene.scene import Scene

MOST_HALVES = 2.0**52  # that the next double to a number of them is another
FOR_EVER = 1e300  # seconds
MOST_BITS = 4096
SPARE_DIGITS = 12


@dataclass(frozen=True, slots=True)
class Cost:
    """What a fold took: nothing, where theta is constant.

    Attributes
    ----------
    bits : int
        Of the numbers that were integrated.
    steps : int
    closure : float
        How well the second half of the nutation repeats the first: the error, measured.
    compile_s, integrate_s : float
        Wall-clock time of the parts, of all attempts [s].
    """

    bits: int = 0
    steps: int = 0
    closure: float = 0.0
    compile_s: float = 0.0
    integrate_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Made:
    """What a motion is folded onto, the end of the scene, and how far it is good [s]."""

    course: Nodding | Uniform
    span: Number
    reach: float
    cost: Cost


def uniform(scene: Scene, digits: int) -> Made:
    """Return the uniform rotation of a scene whose theta is constant."""
    start, end = scene.start, scene.time
    assert end is not None  # periods have been refused
    upright = start.theta.sign() == 0 or (start.theta - PI).sign() == 0
    rates = (Exact.of(0), start.omega3) if upright else (start.phidot, start.psidot)
    ctx = context(digits + math.ceil(math.log10(MOST_TURNS)) + SPARE_DIGITS)
    theta, phi, psi, phidot, psidot = (
        x.mpf(ctx) for x in (start.theta, start.phi, start.psi, *rates)
    )
    fastest = max(abs(float(rate)) for rate in rates)
    reach = min(MOST_TURNS / fastest, FOR_EVER) if fastest else FOR_EVER
    return Made(Uniform(ctx, theta, (phi, psi), (phidot, psidot)), end.mpf(ctx), reach, Cost())


def nodding(scene: Scene, digits: int) -> Made:
    """Return half a nutation of a scene, from an integration with as many bits as it takes.

    Raises
    ------
    BadScene
        It takes more than 4096 bits, or more steps than `Folding` takes.
    """
    bits = enough(needed_to_fold(digits))
    compiling = integrating = 0.0
    while bits <= MOST_BITS:
        course, seconds = _integrated(scene, bits)
        compiling, integrating = compiling + course.engine.compile_s, integrating + seconds
        end, nutation = _end(scene, course), course.nutation
        halves = min(max(FOLDED_REACH, float(1 + abs(end / course.half))), MOST_HALVES)
        needed = needed_to_fold(digits, halves) + nutation.lost_bits
        if needed <= bits:
            cost = Cost(bits, nutation.steps, nutation.closure, compiling, integrating)
            return Made(course, end, _reach(course, halves), cost)
        if math.isinf(needed):
            raise _refusal(scene, f"half a nutation takes more than {MOST_BITS} bits")
        bits = enough(needed)
    raise _refusal(scene, f"half a nutation takes {bits} bits, and {MOST_BITS} are the most")


def _refusal(scene: Scene, rule: str) -> BadScene:
    return BadScene((Fault(scene.name, None, "fold", "", rule),))


def _reach(course: Nodding, halves: float) -> float:
    """Return the farthest time to which so many half-periods, and all turns, are counted [s]."""
    turns = max(1.0, *(abs(float(gain)) / (4 * math.pi) for gain in course.gains))
    return float(course.half) * min(halves, MOST_TURNS / turns)


def _end(scene: Scene, course: Nodding) -> Number:
    if scene.time is not None:
        return scene.time.mpf(course.ctx)
    assert scene.periods is not None
    return scene.periods.mpf(course.ctx) * course.period


def _integrated(scene: Scene, bits: int) -> tuple[Nodding, float]:
    """Return half a nutation in numbers of so many bits, and how long it took [s]."""
    ctx = context(int(bits * math.log10(2)) + SPARE_DIGITS)
    named = constants(scene)
    engine = Folding(bits, dict(zip(named, _rounded(ctx, named.values()), strict=True)))
    start = _rounded(ctx, state(scene))
    began = perf_counter()
    try:
        nutation = engine.nutation(start, _turns_at_once(scene))
    except Unfinished as reason:
        raise _refusal(scene, str(reason)) from None
    spent = perf_counter() - began
    values = {name: ctx.mpf(text) for name, text in engine.parameter_texts().items()}
    values |= {f"{angle}_0": named[f"{angle}_0"].mpf(ctx) for angle in ("phi", "psi")}
    return Nodding(ctx, engine, nutation, values), spent


def _rounded(ctx: Context, numbers: Iterable[Exact]) -> list[str]:
    """Return exact numbers, each rounded once."""
    return [ctx.nstr(x.mpf(ctx), ctx.dps) for x in numbers]


def _turns_at_once(scene: Scene) -> bool:
    """Tell whether the start is a turning point: at rest in theta, or on a pole."""
    theta = scene.start.theta
    return 0 in (scene.start.thetadot.sign(), theta.sign(), (theta - PI).sign())
