"""The least that will do: formulation, precision, projection and folding for what a scene wants."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from heavytop.analytic.motion import Motion
from heavytop.integration.bits import DOUBLE, LONG_DOUBLE, enough
from heavytop.run.digits import SPARE, bits_for, needed_to_fold
from heavytop.run.estimates import LOCAL, UNIT, Estimate, duration, estimate, growth, periods_of
from heavytop.scene.scene import Scene

KNOWN: Final = frozenset({"class", "period"})  # without integrating
TILT: Final = frozenset({"theta", "rates"})
TURNING: Final = frozenset({"phi", "psi", "attitude"})
BESIDE_A_POLE: Final = 0.02  # rad, where the attitude form begins to be faster
FOLD_AFTER_S: Final = 20.0  # of integration
PATIENCE_S: Final = 20.0  # for more than doubles
LONG_S: Final = 60.0  # before which somebody should be told


@dataclass(frozen=True, slots=True)
class Choice:
    """How a scene is best integrated.

    Attributes
    ----------
    projected, folded : bool
    bits : int
    estimate : Estimate
    reasons : tuple of str
    """

    projected: bool
    folded: bool
    bits: int
    estimate: Estimate
    reasons: tuple[str, ...]


def least_formulation(scene: Scene, motion: Motion, span: float) -> tuple[str, str]:
    """The least formulation that gives what a scene wants, and why.

    Parameters
    ----------
    scene : Scene
    motion : Motion
    span : float
        The end [s].

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> scene = load_scene("sicm-kicked", ['want.quantities=["theta"]'])
    >>> least_formulation(scene, Motion(scene.top, scene.start), 2.0)[0]
    'cubic'
    """
    wants = frozenset(scene.quantities) - KNOWN
    if not wants:
        return "none", "class and period follow from the closed form: nothing is integrated"
    nearest = min(motion.from_top, motion.from_bottom)
    if not wants <= TILT:
        return _with_angles(scene, motion, wants, nearest)
    height = min(nearest, nearest**2)  # of the cubic, whose errors are absolute: it sets the period
    if 10.0**-scene.digits * height < UNIT * LOCAL * growth(motion, span):
        near = f"{nearest:.1e} rad from a pole theta would lose digits in the cubic form"
        return "axis", f"axis: only theta is wanted, but {near}"
    return "cubic", "cubic: only theta is wanted, and it has two states and a quadratic right side"


def _with_angles(
    scene: Scene, motion: Motion, wants: frozenset[str], nearest: float
) -> tuple[str, str]:
    """The axis form, or where angles turn quickly past a pole, or with the spin, the attitude."""
    if motion.nutates and wants & TURNING and nearest < BESIDE_A_POLE:
        near = f"{nearest:.1e} rad from a pole phi and psi turn quickly"
        return "attitude", f"attitude: {near}; its equations are regular, its turns are proved"
    turned = abs(float(motion.reduced.kappa)) * abs(float(scene.time or 0))
    if "attitude" in wants and turned * 2 * UNIT > 10.0**-scene.digits:
        return "attitude", f"attitude: it takes out the spin, {turned:.1e} rad, exactly"
    return "axis", "axis: quadratic, regular at the poles, and no angle grows in the state"


def choice(scene: Scene, motion: Motion, span: float, formulation: str) -> Choice:
    """What a formulation needs, so that the scene's digits are met at the end of the span.

    Parameters
    ----------
    scene : Scene
    motion : Motion
    span : float
        The end [s].
    formulation : str

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> scene = load_scene("sicm-kicked")
    >>> motion = Motion(scene.top, scene.start)
    >>> [(c.projected, c.bits) for c in (choice(scene, motion, t, "axis") for t in (2, 1e3))]
    [(False, 53), (True, 53)]
    """
    bound = 10.0**-scene.digits
    bits = bits_for(scene.digits, motion, span, growing=formulation == "lagrange")
    plain = estimate(scene, motion, span, formulation, projected=False, bits=bits)
    if _folds(scene, motion, plain):
        count = periods_of(motion, span)
        long = f"which would take {duration(plain.seconds)}"
        why = f"folded: one period answers for all {count:.3g}, {long}"
        folding = enough(needed_to_fold(scene.digits, 2 * count))
        return Choice(False, True, folding, Estimate(1.0, bound / 10), (why,))
    if bits > DOUBLE or plain.error <= bound:
        return Choice(False, False, bits, plain, ())
    if formulation in PROJECTABLE:
        pinned = estimate(scene, motion, span, formulation, projected=True, bits=bits)
        if pinned.error <= bound:
            why = f"projected: else {_off('would', plain.error)}, of 1e-{scene.digits} allowed"
            return Choice(True, False, bits, pinned, (why,))
    return _finer(scene, motion, span, formulation, plain)


def _finer(scene: Scene, motion: Motion, span: float, formulation: str, plain: Estimate) -> Choice:
    """More bits, where doubles will not do; or doubles, where that would take too long."""
    needed = DOUBLE + math.log2(plain.error) + scene.digits * math.log2(10)
    bits = LONG_DOUBLE if needed <= LONG_DOUBLE else enough(needed + SPARE)
    long = estimate(scene, motion, span, formulation, projected=False, bits=bits)
    lost = f"in doubles {_off('would', plain.error)}, of 1e-{scene.digits} allowed"
    if long.seconds <= PATIENCE_S:
        return Choice(False, False, bits, long, (lost,))
    projected = formulation in PROJECTABLE
    best = estimate(scene, motion, span, formulation, projected=projected, bits=DOUBLE)
    why = f"{_off('will', best.error)}: more bits would take {duration(long.seconds)}"
    return Choice(projected, False, DOUBLE, best, (why,))


def _off(verb: str, error: float) -> str:
    if error < 1:
        return f"the end {verb} be off by about {error:.0e}"
    return f"every digit {verb} be lost"


PROJECTABLE: Final = frozenset({"axis", "attitude", "cubic"})


def _folds(scene: Scene, motion: Motion, plain: Estimate) -> bool:
    """Whether one period is worth more than all: few samples, no events, a very long span."""
    return _returns(motion) and not scene.events and plain.seconds > FOLD_AFTER_S


def _returns(motion: Motion) -> bool:
    return motion.regime != "asymptotic"


def patience(scene: Scene, motion: Motion, expected: Estimate) -> Iterator[str]:
    """Say how long a long integration takes, and what would be quicker.

    Parameters
    ----------
    scene : Scene
    motion : Motion
    expected : Estimate
    """
    if expected.seconds <= LONG_S or motion.kind == "at-rest":  # which takes a step or two
        return
    quicker = "" if scene.events else "; by auto it would be folded and take a second"
    if scene.events:
        quicker = "; without events (want.events = []) it would be folded and take a second"
    yield f"long: about {duration(expected.seconds)} in all{quicker if _returns(motion) else ''}"
