"""Derivatives of T, Δφ and Δψ by the numbers of the top and of its start."""

from __future__ import annotations

import warnings
from typing import Final

from heavytop.analytic.motion import Motion
from heavytop.errors import FoldedTiltWarning, Impossible, ImpossibleStart, ImpossibleTop
from heavytop.exact import Exact
from heavytop.exact.decimals import Number
from heavytop.scene.state import State
from heavytop.scene.top import Top

DIFFERENTIATED: Final = ("period", "precession", "spin")
DIFFERENCE_DIGITS: Final = 130  # of the closed form on either side
DIFFERENCE_STEP: Final = Exact.of("1e-40")  # over the natural size of a number


def sensitivities(top: Top, start: State) -> dict[str, dict[str, float]]:
    """Return the derivatives of T, Δφ and Δψ by every number of a top and of its start.

    Parameters
    ----------
    top : Top
        The top.
    start : State
        Its start.

    Returns
    -------
    dict of dict of float
        Under "period", "precession" and "spin" dT/dx [s per unit of x], dΔφ/dx and dΔψ/dx [rad per
        unit of x], by the name of each x: A and C [kg m²], gMR [J], theta [rad], thetadot, phidot
        and the spin that the start gives, psidot or omega3 [rad/s]. They are partial derivatives:
        one number varies, the others are constant.

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
        step = Exact.of(abs(float(value)) + least.get(x, 1 / motion.period)) * DIFFERENCE_STEP
        low, high = (_turns(numbers, x, value + by) for by in (-step, step))
        ctx = low[0].context
        width, *rises = (after - before for before, after in zip(low, high, strict=True))
        for quantity, rise in zip(DIFFERENTIATED, rises, strict=True):
            circles = 0 if quantity == "period" else ctx.nint(rise / (2 * ctx.pi))
            found[quantity][x] = float((rise - 2 * ctx.pi * circles) / width)
    return found


def _turns(numbers: dict[str, Exact], x: str, value: Exact) -> list[Number]:
    """A number, and T, Δφ and Δψ of the motion with it; the given number where it is impossible."""
    A, C, gMR, *start = (numbers | {x: value}).items()
    try:
        with warnings.catch_warnings(action="error", category=FoldedTiltWarning):
            motion = Motion(Top.of_numbers(A[1], C[1], gMR[1]), State(**dict(start)))
    except (ImpossibleTop, ImpossibleStart, FoldedTiltWarning):  # such as C < 0, theta < 0
        return _turns(numbers, x, numbers[x])
    turns = [motion.mpf(quantity, DIFFERENCE_DIGITS) for quantity in DIFFERENTIATED]
    return [value.mpf(turns[0].context), *turns]
