"""Tags: what else holds of a motion, each proved or left open."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any, Final

from heavytop.classification.criteria import (
    Given,
    Term,
    miss_of_bottom,
    miss_of_top,
    over_bottom,
    over_top,
)
from heavytop.classification.judge import (
    FEW_BITS,
    Criterion,
    Judge,
    Sign,
    UndecidedError,
    ball_sign,
    exact_sign,
)
from heavytop.classification.kind import Kind
from heavytop.numbers import sqrt
from heavytop.numbers.intervals import working

NEAR_SEPARATRIX: Final = Fraction(1, 10**6)
"""1 − m below which a motion is near-separatrix: T is then the logarithm to 6 digits."""

_STILL = frozenset({Kind.AT_REST, Kind.SLEEPING, Kind.HANGING})
_UNNODDING = _STILL | {Kind.SEPARATRIX, Kind.UNIFORM_PRECESSION}
_SPINLESS = frozenset({Kind.AT_REST, Kind.PLANAR_PENDULUM})
_SQUARED = NEAR_SEPARATRIX * (1 - NEAR_SEPARATRIX)
_NEAR: Final = _SQUARED**2 / (1 - _SQUARED) ** 3  # m′²m²/(1 − m′m)³ where 1 − m = NEAR_SEPARATRIX


def found(judge: Judge, kind: Kind) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The tags that hold, and those that could be neither proved nor disproved."""
    holding, unknown = [], []
    for tag, holds in TAGS.items():
        try:
            if holds(judge, kind):
                holding.append(tag)
        except UndecidedError:
            unknown.append(tag)
    return tuple(holding), tuple(unknown)


def _spherical_pendulum(judge: Judge, kind: Kind) -> bool:
    return kind not in _SPINLESS and judge.rates["omega3"] == 0


def _spherical_top(judge: Judge, _: Kind) -> bool:
    return judge.top.A == judge.top.C or exact_sign(judge.top.A - judge.top.C) == 0


def _start_at_rest(judge: Judge, kind: Kind) -> bool:
    across = 0 if judge.pole else judge.rates["phidot"]
    return kind not in _STILL and judge.rates["thetadot"] == across == 0


def _closed_orbit(judge: Judge, kind: Kind) -> bool:
    """Whether the axis is known to run along a closed curve: a circle, or to and fro."""
    if kind is Kind.PLANAR_PENDULUM:
        return judge.sign(_over_highest(judge)) != 0
    circle = kind in (Kind.FORCE_FREE, Kind.UNIFORM_PRECESSION)
    return circle and not _start_at_rest(judge, kind)


def _over_highest(judge: Judge) -> Criterion:
    return over_top if judge.rates["gMR"] > 0 else over_bottom


def _inverted(judge: Judge, _: Kind) -> bool:
    return judge.rates["gMR"] < 0


def _spin_reversal(judge: Judge, kind: Kind) -> bool:
    return kind not in (*_STILL, Kind.UNIFORM_PRECESSION) and _reverses(judge)


def _near_separatrix(judge: Judge, kind: Kind) -> bool:
    if kind in _UNNODDING or judge.rates["gMR"] == 0:
        return False
    if kind is Kind.PLANAR_PENDULUM and judge.sign(_over_highest(judge)) == 0:
        return False
    return judge.sign(away_from_one) < 0 and judge.sign(upper_roots_nearer) > 0


TAGS: Final[dict[str, Callable[[Judge, Kind], bool]]] = {
    "spherical-pendulum": _spherical_pendulum,
    "spherical-top": _spherical_top,
    "spin-reversal": _spin_reversal,
    "closed-orbit": _closed_orbit,
    "near-separatrix": _near_separatrix,
    "inverted-gravity": _inverted,
    "start-at-rest": _start_at_rest,
}


# --- near the separatrix: 1 − m from the cubic's invariants, without its roots -----------------


def _cubic(x: Given) -> tuple[Term, Term, Term, Term]:
    """Coefficients of A² f(u), constant first; 2E' = 2K + 2 gMR cosθ."""
    energy = x.A * (x.kinetic + 2 * x.gMR * x.cos)
    p_phi, p_psi, pull = p_phi_of(x), x.p_psi, x.A * x.gMR
    return (
        energy - p_phi * p_phi,
        2 * (p_phi * p_psi - pull),
        -energy - p_psi * p_psi,
        2 * pull,
    )


def away_from_one(x: Given) -> tuple[Term, ...]:
    """Negative where m′²m²/(1 − m′m)³ < its value at 1 − m = m′ = 1e-6: disc a₃²/(a₂² − 3a₃a₁)³.

    The roots' differences are d = u₃ − u₁, m d and m′ d, so that the discriminant is
    d⁶ (m m′)² and the sum of squares of the differences 2 d² (1 − m m′).
    """
    a0, a1, a2, a3 = _cubic(x)
    disc = (
        18 * a3 * a2 * a1 * a0 - 4 * a2 * a2 * a2 * a0 + a2 * a2 * a1 * a1
        - 4 * a3 * a1 * a1 * a1 - 27 * a3 * a3 * a0 * a0
    )  # fmt: skip
    spread = a2 * a2 - 3 * a3 * a1
    return (
        _NEAR.denominator * (disc * a3 * a3),
        -_NEAR.numerator * (spread * spread * spread),
    )


def upper_roots_nearer(x: Given) -> tuple[Term, ...]:
    """Of the sign of 2u₂ − u₁ − u₃ in the upright top: positive where 1 − m < ½."""
    a0, a1, a2, a3 = _cubic(x)
    return 2 * a2 * a2 * a2, -9 * a3 * a2 * a1, 27 * a3 * a3 * a0


# --- spin reversal: ψ̇ changes sign inside the nutation ------------------------------------------


def _reverses(judge: Judge) -> bool:
    """Whether q(u) = A ψ̇ (1 − u²) = ω3 A − p_φ u − ω3 (A − C) u² has a zero where f > 0.

    q(∓1) = p_ψ ± p_φ: there is one zero between the poles where |p_φ| > |p_ψ|, and elsewhere, as
    C ≤ 2A, none.
    """
    between = 0 if judge.pole else judge.sign(miss_of_top) * judge.sign(miss_of_bottom)
    if between <= 0 or _stands(judge):
        return False
    try:
        with working(FEW_BITS):
            return _f_at_zero(judge.few, _told, lambda x: x.sqrt()) > 0
    except UndecidedError:
        return _f_at_zero(judge.exact, exact_sign, sqrt) > 0


def _stands(judge: Judge) -> bool:
    """Whether the start is a turning point with ψ̇ = 0: the zero of q, and no inner one."""
    return judge.rates["thetadot"] == 0 and exact_sign(judge.start.psidot) == 0


def _told(ball: Any) -> Sign:
    sign = ball_sign(ball)
    if sign is None:
        raise UndecidedError(ball)
    return sign


def _f_at_zero(x: Given, sign: Callable[[Any], Sign], root: Callable[[Any], Any]) -> Sign:
    """The sign of f at the zero of q between the poles, in the form that does not cancel."""
    p_phi, free = p_phi_of(x), x.omega3 * x.A
    reach = root(p_phi * p_phi + 4 * free * x.omega3 * (x.A - x.C))
    u = 2 * free / (p_phi + sign(p_phi) * reach)
    drop = p_phi - x.p_psi * u
    energy = x.kinetic + 2 * x.gMR * (x.cos - u)
    return sign(x.A * energy * (1 - u * u) - drop * drop)


def p_phi_of(x: Given) -> Term:
    """Momentum about the vertical, A φ̇ sin²θ + p_ψ cosθ."""
    return x.A * x.phidot * x.sin2 + x.p_psi * x.cos
