"""How the period and what turns in it change with the top and with its start."""

from __future__ import annotations

import warnings
from typing import Any, Final

from heavytop.analytic.motion import Motion
from heavytop.errors import FoldedTiltWarning, Impossible, ImpossibleStart, ImpossibleTop
from heavytop.exact import Exact
from heavytop.scene.state import State
from heavytop.scene.top import Top

DIFFERENTIATED: Final = ("period", "precession", "spin")
DIFFERENCE_DIGITS: Final = 130  # of the closed form on either side
DIFFERENCE_STEP: Final = Exact.of("1e-40")  # of a number's natural size


def sensitivities(top: Top, start: State) -> dict[str, dict[str, float]]:
    """Return the derivatives of T, Δφ and Δψ by every number of a top and of its start.

    Parameters
    ----------
    top : Top
        What spins.
    start : State
        How it starts.

    Returns
    -------
    dict of dict of float
        Under "period", "precession" and "spin" dT/dx [s per unit of x], dΔφ/dx and dΔψ/dx [rad per
        unit of x], by the name of each x: A and C [kg m²], gMR [J], theta [rad], thetadot, phidot
        and the spin that the start gives, psidot or omega3 [rad/s]. When one of them varies, the
        others are held.

    Raises
    ------
    WrongType
        `top` is no Top, or `start` no State.
    Impossible
        Nothing nutates: there is no period; or C = 0, and there is no spin.
    NoClosedForm
        As for `Motion.at`.

    Notes
    -----
    They are central differences of the closed form at 130 digits, over 1e-40 of the natural size of
    x; one-sided where the other side is impossible. Where the axis passes exactly through a pole,
    Δφ jumps by 2π from one side of it to the other; its derivatives do not.

    Accuracy: ``tests/analytic/test_sensitivities.py`` holds them to 1e-13 of derivatives under the
    integrals of elementary quadrature, and to variational equations that were integrated.

    Examples
    --------
    >>> found = sensitivities(Top("3.28e-4", "6.6e-5", "0.0456"),
    ...                       State("0.1", phidot=-15, psidot=140))
    >>> round(found["period"]["phidot"], 9), round(found["precession"]["phidot"], 7)
    (-0.007692825, -0.0759131)
    """
    motion = Motion(top, start)
    if top.C.sign() == 0:
        raise Impossible([("C", "more than 0: a point mass has no spin")])
    if motion.period is None:
        raise Impossible([("start", f"one that nutates: {motion.kind} has no period")])
    numbers = {x: getattr(top, x) for x in ("A", "C", "gMR")}
    numbers |= {x: getattr(start, x) for x in ("theta", "thetadot", "phidot", start.held)}
    least = {"A": 0.0, "C": 0.0, "gMR": float(top.A) / motion.period**2, "theta": 1.0}
    found: dict[str, dict[str, float]] = {quantity: {} for quantity in DIFFERENTIATED}
    for x, value in numbers.items():
        size = abs(float(value)) + least.get(x, 1 / motion.period)
        slopes = _slopes(numbers, x, Exact.of(size) * DIFFERENCE_STEP)
        for quantity, slope in zip(DIFFERENTIATED, slopes, strict=True):
            found[quantity][x] = slope
    return found


def _slopes(numbers: dict[str, Exact], x: str, step: Exact) -> list[float]:
    """The slopes of T, Δφ and Δψ between the numbers with x less and more by a step."""
    ends, width = [], 2
    for by in (-step, step):
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", FoldedTiltWarning)
                ends.append(_turns(numbers | {x: numbers[x] + by}))
        except (ImpossibleTop, ImpossibleStart, FoldedTiltWarning):  # such as C < 0, theta < 0
            ends, width = [*ends, _turns(numbers)], 1
    ctx = ends[0][0].context
    period, *turned = (high - low for low, high in zip(*ends, strict=True))
    turned = [rise - 2 * ctx.pi * ctx.nint(rise / (2 * ctx.pi)) for rise in turned]
    return [float(rise / (width * step.mpf(ctx))) for rise in (period, *turned)]


def _turns(numbers: dict[str, Exact]) -> list[Any]:
    """T, Δφ and Δψ of the motion that some numbers make."""
    A, C, gMR, *start = numbers.items()
    motion = Motion(Top.of_numbers(A[1], C[1], gMR[1]), State(**dict(start)))
    return [motion.mpf(quantity, DIFFERENCE_DIGITS) for quantity in DIFFERENTIATED]
