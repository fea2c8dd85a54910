"""The decision tree on arrays of doubles: the kinds of motion whose every sign is certain.

The kinds, their order and the margins are those of `heavytop.classification.tree`; the criteria are
the same functions. Each margin is a lower bound, found with the bounds on all roundings: it is
positive exactly where every sign on the way is certain, and where it is not, nothing is known.

Of the doubles only θ = 0 is a pole, so that what needs an exact cancellation, or θ = π, is left
open here: separatrix, through-bottom, uniform precession, and the kinds between two others.
"""

from __future__ import annotations

from functools import reduce
from typing import Final, NamedTuple

import numpy as np

from heavytop.classification import criteria
from heavytop.classification.bounded import Array, Bounded, Mask, total
from heavytop.classification.codes import DETAILS, NAMES, Codes
from heavytop.classification.criteria import Given, Sum
from heavytop.classification.kind import Kind
from heavytop.classification.screen_tags import put_tags
from heavytop.classification.starts import Starts

_ROUNDED: Final = 1 - 2.0**-46  # for at most 60 roundings on the way to a margin


class Screened(NamedTuple):
    """Codes of kinds and details, margins, and the bits of tags that hold and that are open.

    Where a margin is 0 nothing is known. Tags that were not asked for are all 0.
    """

    kind: Codes
    detail: Codes
    margin: Array
    tags: Codes
    open_tags: Codes


def screen(starts: Starts, tagged: bool = False) -> Screened:
    """The kinds of motion, as far as bounded arithmetic can tell them.

    Parameters
    ----------
    starts : Starts
        Possible tops and starts; of impossible ones nothing that is said means anything.
    tagged : bool
        Whether tags are asked for.
    """
    shape = np.broadcast_shapes(*(each.shape for each in starts.arrays))
    kind, detail, tags, unknown = (np.zeros(shape, np.uint8) for _ in range(4))
    found = Screened(kind, detail, np.empty(shape, np.float64), tags, unknown)
    with np.errstate(all="ignore"):  # nan is what is not known
        tree = _Tree(starts, found)
        tree.generic()
        tree.special()
        np.multiply(found.margin, _ROUNDED, out=found.margin)
        np.copyto(found.margin, 0, where=~(found.margin > 0))
        if tagged:
            put_tags(starts, tree.x, tree.shares.momentum, found.kind, (tags, unknown))
    return found


class _Shares:
    """Relative sizes, from below, of what vanishes in special kinds.

    They are those of momenta beside √(2AK + p_ψ² + A |gMR|), and sinθ.
    """

    def __init__(self, x: Given) -> None:
        weight = x.A * abs(x.gMR)
        self.momentum = momentum = np.sqrt((x.A * x.kinetic + weight).most + x.p_psi.most**2)
        self.theta_rate = (x.A * abs(x.thetadot)).least / momentum
        self.sine = x.sin2.sqrt().least
        self.across = (x.A * abs(x.phidot)).least * self.sine / momentum
        self.spin = x.p_psi.least / momentum
        self.weight = weight.sqrt().least / momentum

    @property
    def rest(self) -> Array:
        """Of at-rest: thetadot, phidot sinθ, omega3 and the torque are to vanish."""
        torque = _least(self.weight, self.sine)
        return _largest(self.theta_rate, self.across, self.spin, torque)

    @property
    def upright(self) -> Array:
        """Of an axis for ever on the vertical."""
        return _largest(self.theta_rate, self.sine)

    @property
    def plane(self) -> Array:
        """Of a motion in a plane."""
        return _largest(self.spin, self.across)


class _Tree:
    def __init__(self, starts: Starts, found: Screened) -> None:
        self.starts, self.found = starts, found
        self.x = starts.given()
        self.shares = _Shares(self.x)
        self.moves = _least(self.shares.rest, self.shares.weight)

    def generic(self) -> None:
        """Take every motion for a generic one: waves, cusps or loops."""
        x, shares = self.x, self.shares
        top, off_top = _judged(criteria.miss_of_top(x), criteria.momentum_beside(x, 1))
        bottom, off_bottom = _judged(criteria.miss_of_bottom(x), criteria.momentum_beside(x, -1))
        steady = _largest(shares.theta_rate, _judged(criteria.unsteadiness(x))[1])
        looping, off_cusp = _judged(criteria.looping(x), criteria.lift_beside(x))
        between = (top < 0) & (bottom > 0) | (top > 0) & (bottom < 0)  # |p_φ| < |p_ψ|
        cusps = between & self.starts.still & self.starts.level
        loops = between & ((looping < 0) == (bottom < 0))  # p_ψ is of the sign of P₊
        least = _least(self.moves, shares.upright, shares.plane, steady, off_top, off_bottom)
        self.found.margin[...] = least
        np.minimum(least, off_cusp, out=self.found.margin, where=between & ~cusps)
        self.found.kind[...] = _WAVES
        np.copyto(self.found.kind, _LOOPS, where=loops)
        np.copyto(self.found.kind, _CUSPS, where=cusps)

    def special(self) -> None:
        """Put the special kinds that doubles can be proved to have over it, the first last."""
        starts, spinless = self.starts, self.x.p_psi.most == 0
        pole, weightless = starts.pole, starts.gMR == 0
        planar = starts.level & spinless
        for where, put in (
            (pole, self._through_top),
            (planar, self._planar),
            (pole & starts.still, self._upright),
            (weightless, self._force_free),
            (planar & starts.still & (pole | weightless), self._rest),
        ):
            if where.any():
                put(where)

    def _through_top(self, where: Mask) -> None:
        """From the top; where V is highest below, the separatrix that leads there is missed."""
        x, shares = self.x, self.shares
        miss = _judged(criteria.miss_of_bottom(x), criteria.momentum_beside(x, -1))[1]
        asymptote = _largest(miss, _judged(criteria.over_bottom(x))[1])
        asymptote = np.where(self.starts.gMR < 0, asymptote, 1.0)
        least = _least(self.moves, shares.upright, shares.plane, asymptote)
        self._put(where, Kind.THROUGH_TOP, least)

    def _planar(self, where: Mask) -> None:
        x, up = self.x, self.starts.gMR > 0
        (top, off_top), (bottom, off_bottom) = (
            _judged(over(x)) for over in (criteria.over_top, criteria.over_bottom)
        )
        over, off = np.where(up, top, bottom), np.where(up, off_top, off_bottom)
        self._put(where, Kind.PLANAR_PENDULUM, _least(self.moves, self.shares.upright, off))
        self._tell(where, over, "rotating", "swinging")

    def _upright(self, where: Mask) -> None:
        up = self.starts.gMR > 0
        self._put(where & ~up, Kind.HANGING, self.moves)
        stiffness, off = _judged(criteria.stiffness(self.x))
        self._put(where & up, Kind.SLEEPING, _least(self.moves, off))
        self._tell(where & up, stiffness, "stable", "unstable")
        np.copyto(self.found.detail, 0, where=where & ~up)

    def _force_free(self, where: Mask) -> None:
        self._put(where, Kind.FORCE_FREE, self.shares.rest)

    def _rest(self, where: Mask) -> None:
        known = self.shares.momentum == self.shares.momentum  # not nan: nothing was out of range
        self._put(where, Kind.AT_REST, known.astype(float))

    def _put(self, where: Mask, kind: Kind, margin: Array) -> None:
        np.copyto(self.found.kind, NAMES.index(kind), where=where)
        np.copyto(self.found.margin, margin, where=where)
        np.copyto(self.found.detail, 0, where=where)

    def _tell(self, where: Mask, over: Array, above: str, below: str) -> None:
        np.copyto(self.found.detail, DETAILS.index(above), where=where & (over > 0))
        np.copyto(self.found.detail, DETAILS.index(below), where=where & (over < 0))


def _least(*sizes: Array) -> Array:
    """The smallest of some sizes; nan where one of them is."""
    return reduce(np.minimum, sizes)


def _largest(*sizes: Array) -> Array:
    return reduce(np.maximum, sizes)


def _judged(terms: Sum, beside: Bounded | None = None) -> tuple[Array, Array]:
    """A sum, and from below its size beside its terms: positive where its sign is certain."""
    whole, scale = total(terms), sum(term.most for term in terms)
    if beside is not None:
        scale = scale + beside.most
    return whole.value, whole.least / scale


_WAVES, _LOOPS, _CUSPS = (NAMES.index(kind) for kind in (Kind.WAVES, Kind.LOOPS, Kind.CUSPS))
