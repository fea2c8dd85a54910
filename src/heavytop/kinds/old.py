"""Kinds of motion: which of them one motion is, by signs of a few numbers, and by how much.

The three generic kinds need no roots: with u_c = a/b, f(u_c) = 2 (h − g u_c)(1 − u_c²), so the
motion loops where |a| < |b| and h > g a/b, has cusps where |a| < |b| and h = g a/b, and waves
otherwise, for either sign of g. A number counts as zero below 1e-40 of the terms it is the sum
of, at 60 digits: good evidence and no proof, which is why no verdict here is `certified`.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from heavytop.kinds.kind import WHY, Kind, Verdict
from heavytop.theory.nutation import (
    Course,
    Nutation,
    course,
    distance_from_asymptote,
    miss_of_bottom,
    miss_of_top,
    nutation,
    unsteadiness,
    upright,
)
from heavytop.theory.precision import (
    STANDARD_DIGITS,
    Number,
    context,
    relative,
    threshold,
    vanishes,
)
from heavytop.theory.reduced import Reduced

NEAR_SEPARATRIX = 1e-6
"""1 − m below which a motion is tagged near-separatrix: T is then the logarithm to 6 digits."""


@dataclass(slots=True)
class _Judge:
    """Tells zeros from other numbers, and remembers the narrowest of its decisions."""

    motion: Reduced
    margin: float = 1.0
    scale: Number = field(init=False)

    def __post_init__(self) -> None:
        r = self.motion
        self.scale = abs(r.g) + r.kinetic0 + r.b**2

    def small(self, size: Number) -> bool:
        """Whether a relative size counts as zero."""
        verdict = bool(size <= threshold(self.motion.ctx))
        if not verdict:
            self.margin = min(self.margin, float(size))
        return verdict

    def zero(self, total: Number, *terms: Number) -> bool:
        """Whether a sum vanishes beside its terms."""
        return self.small(relative(total, *terms))

    def none(self, square: Number) -> bool:
        """Whether the square of a rate vanishes beside those of the whole motion."""
        return self.small(self.motion.ctx.sqrt(relative(square, self.scale)))


def classify(reduced: Reduced, *, spherical: bool | None = None) -> Verdict:
    """The kind, the tags and the margin of one motion.

    Parameters
    ----------
    reduced : Reduced
        The motion, built from exact numbers.
    spherical : bool, optional
        Whether A = C; by default told from κ, which cannot tell when p_ψ = 0.

    Examples
    --------
    >>> start = Reduced.from_angles(context(60), 2, 1, 3, 1, 0, 0, 0, 0, 4)
    >>> verdict = classify(start)
    >>> str(verdict.kind), verdict.tags
    ('cusps', ('start-at-rest',))
    """
    motion = reduced.refined(context(STANDARD_DIGITS))
    judge = _Judge(motion)
    kind, detail = _kind(motion, judge)
    if spherical is None:
        spherical = bool(motion.b) and vanishes(motion.ctx, motion.kappa, motion.b)
    tags = (*detail, *_tags(motion, kind, spherical))
    return Verdict(kind, tags, (), False, judge.margin, (0.0, 1.0), WHY[kind])


def _kind(motion: Reduced, judge: _Judge) -> tuple[Kind, tuple[str, ...]]:
    upheld = judge.none(motion.kinetic0)
    polar = upheld and not motion.sin2
    spinless = judge.none(motion.b**2)
    weightless = judge.zero(motion.g, judge.scale) if judge.scale else True
    if upheld and spinless and (polar or weightless):
        return Kind.AT_REST, ()
    if weightless:
        return Kind.FORCE_FREE, ()
    if polar:
        return _vertical(motion, judge)
    if spinless and judge.none(motion.drift0**2):
        return Kind.PLANAR_PENDULUM, (_pendulum(motion, judge),)
    return _reaching_a_pole(motion, judge)


def _vertical(motion: Reduced, judge: _Judge) -> tuple[Kind, tuple[str, ...]]:
    if motion.g * motion.u0 < 0:
        return Kind.HANGING, ()
    stiffness, fall = motion.b**2, 4 * abs(motion.g)
    if judge.zero(stiffness - fall, stiffness, fall):
        return Kind.SLEEPING, ("marginal",)
    return Kind.SLEEPING, ("stable" if stiffness > fall else "unstable",)


def _pendulum(motion: Reduced, judge: _Judge) -> str:
    over = upright(motion)
    lift = over.g * over.one_minus_u0
    spare = over.kinetic0 - lift  # h − g
    if judge.zero(spare, over.kinetic0, lift):
        return "asymptotic"
    return "rotating" if spare > 0 else "swinging"


def _reaching_a_pole(motion: Reduced, judge: _Judge) -> tuple[Kind, tuple[str, ...]]:
    if judge.small(distance_from_asymptote(motion)):
        return Kind.SEPARATRIX, ()
    k, g = motion.kinetic0, motion.g
    if judge.small(miss_of_top(motion)) and k > g * motion.one_minus_u0:
        return Kind.THROUGH_TOP, ()
    if judge.small(miss_of_bottom(motion)) and k > -g * motion.one_plus_u0:
        return Kind.THROUGH_BOTTOM, ()
    if judge.small(unsteadiness(motion)):
        return Kind.UNIFORM_PRECESSION, (_speed(motion, judge),)
    return _generic(motion, judge), ()


def _speed(motion: Reduced, judge: _Judge) -> str:
    """The two rates at one tilt have the product g/cos θ, so that Ω² |cos θ| < |g| is the slower.

    Where there is one speed only (θ = π/2, a double root, equal and opposite) it is single.
    """
    ctx, u0, omega = motion.ctx, motion.u0, motion.drift0 / motion.sin2
    if vanishes(ctx, u0, 1):
        return "single"
    own, other = omega**2 * abs(u0), abs(motion.g)
    if judge.zero(own - other, own, other):
        return "single"
    return "slow" if own < other else "fast"


def _generic(motion: Reduced, judge: _Judge) -> Kind:
    """The sign of h − g a/b = (b k − g j)/b, with a = j + b u₀ and h = k + g u₀."""
    if not motion.P_plus * motion.P_minus < 0:
        return Kind.WAVES
    lead, pull = motion.b * motion.kinetic0, motion.g * motion.drift0
    if judge.zero(lead - pull, lead, pull):
        return Kind.CUSPS
    return Kind.LOOPS if (lead - pull) * motion.b > 0 else Kind.WAVES


def _tags(motion: Reduced, kind: Kind, spherical: bool) -> tuple[str, ...]:
    judge = _Judge(motion)
    still = kind in (Kind.AT_REST, Kind.SLEEPING, Kind.HANGING)
    found = {
        "spherical-pendulum": kind not in (Kind.AT_REST, Kind.PLANAR_PENDULUM)
        and judge.none(motion.b**2),
        "spherical-top": spherical,
        "spin-reversal": _spin_reverses(motion),
        "near-separatrix": _near_separatrix(motion),
        "inverted-gravity": motion.g < 0,
        "start-at-rest": not still and judge.none(motion.kinetic0),
    }
    return tuple(tag for tag, holds in found.items() if holds)


def _nutation(motion: Reduced) -> Nutation | None:
    return nutation(motion) if course(motion) is Course.NUTATING else None


def _near_separatrix(motion: Reduced) -> bool:
    roots = _nutation(motion)
    return roots is not None and bool(roots.mc < NEAR_SEPARATRIX)


def _spin_reverses(motion: Reduced) -> bool:
    """Whether ψ̇ (1 − u²) = b + κ − a u − κ u² takes both signs between the turning points."""
    if (roots := _nutation(motion)) is None:
        return False
    a, b, kappa = motion.a, motion.b, motion.kappa
    low, high = roots.roots[1:] if roots.mirrored else roots.roots[:2]
    places = [low, high]
    if kappa and low < -a / (2 * kappa) < high:
        places.append(-a / (2 * kappa))
    values = [b + kappa - a * u - kappa * u * u for u in places]
    return bool(min(values) < 0 < max(values))
