"""The exact solution through a state: a table of one period of it, then by symmetry.

The caller gives the approximate period; the exact one is twice the time between two turning points,
which are zeros of the event function in the table. A nutating motion then repeats itself up to
rotations by the advances of phi and psi, which are read off the solution after one period. Nothing
here uses the elliptic closed form.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np
from flint import acb, arb

from heavytop.certificate.events import zeros
from heavytop.certificate.system import CERTIFIED, QuadraticSystem, TooCoarse, pair, upper_double
from heavytop.certificate.table import TABLE_ERROR, SolutionTable
from heavytop.equations.formulation import Formulation
from heavytop.exact.balls import working
from heavytop.exact.pairs import UNIT, Array, Words, add, multiply, two_product

ROTATED: Final = 1e-28  # error of a rotated state: far above 2^-104 and that of `pair`
FEW_TURNS: Final = 256  # multiples of an angle whose sines and cosines are kept
TURN_ERROR: Final = 1e-30  # rad: largest error of the angle of rotation after the last period
SWUNG: Final = 0.7  # largest relative change of a pair of states between samples: below pi/4
PIECE_HALVINGS: Final = 48  # of a piece, and samples: where more are needed, the axis is at a pole
MOST_LOOKS: Final = 400_000
# bits, and `order` and `fine` of the table
SETTINGS: Final = ((192, 24, 16), (384, 40, 32), (1024, 90, 64))


class Argument(NamedTuple):
    """The argument of a pair of states, with all its turns [rad].

    Attributes
    ----------
    times, angles : ndarray
        Times of the table, and the argument there; up to the next time it changes by less than
        pi/4.
    advance : float
        Its growth in a period.
    """

    times: Array
    angles: Array
    advance: float


class Flow:
    """The exact solution through a start, in the unit of time of a run.

    Parameters
    ----------
    form : Formulation
        The axis form or the attitude form, without angles.
    constants : mapping from str to float
    start : sequence of float
        The state at time 0: exactly these doubles.
    end : float
        The last time; negative for a run back in time.
    period : float, optional
        The approximate period; None where the solution is to be tabulated up to the end.

    Attributes
    ----------
    system : QuadraticSystem
    rests : bool
        Whether nothing moves: the right-hand sides vanish at the start, exactly.
    table : SolutionTable
    exact_period : arb or None
    period : tuple of float or None
        As a double-double; None where none was given.

    Raises
    ------
    TooCoarse
        1024 bits are not enough, or the period is another one.
    ValueError
        A run back in time has no period.
    """

    def __init__(
        self,
        form: Formulation,
        constants: Mapping[str, float],
        start: Sequence[float],
        end: float,
        period: float | None = None,
    ) -> None:
        self.form, self.constants, self.start, self.end = form, dict(constants), start, end
        self.pairs = CERTIFIED[form.name].pairs
        self.system = QuadraticSystem.of(form, constants, _rate(form, constants, start))
        for self.bits, order, fine in SETTINGS:
            with working(self.bits):
                try:
                    self._solve(period, order, fine)
                    break
                except TooCoarse:
                    if self.bits == SETTINGS[-1][0]:
                        raise

    def _solve(self, period: float | None, order: int, fine: int) -> None:
        """Make the table, and find the period in it."""
        rates = self.system.rates([arb(x) for x in self.start], arb(1))
        self.rests = all(rate == 0 for rate in rates)
        span = 0.0 if self.rests else self.end if period is None else period
        if span < 0:
            raise ValueError("back in time, and no period is known")
        self.table = SolutionTable(self.system, self.start, span, order, fine)
        self.bounds = self.table.bounds
        self.exact_period: arb | None = None
        self.period: tuple[float, float] | None = None
        if period is not None:
            self._find_period()

    def _find_period(self) -> None:
        """Find the period, and the angles by which pairs of states turn in it.

        Raises
        ------
        TooCoarse
            They are not known well enough, or the solution after a period is not the rotated start.
        """
        turning = zeros(self, "turning")
        T = 2 * (turning[1] - turning[0]) if len(turning) > 1 else arb("inf")
        if not len(self.table.pieces) * self.table.piece > T:  # beyond the table
            raise TooCoarse("the period is longer than was said")
        last, start = self.table.ball(T), [arb(v) for v in self.start]
        # the distance of a ball from the double-double of it
        self.off_a_period = upper_double(arb(T.rad()) + abs(T) * arb(2) ** -104)
        self.exact_period, self.period = T, pair(T)
        self.angles = self._angles(last)
        turns = math.ceil(abs(self.end) / self.period[0]) + 2
        wide = max(upper_double(arb(angle.rad())) for angle in self.angles.values())
        self._few = min(FEW_TURNS, turns)
        if not (turns + self._few) * wide <= TURN_ERROR:
            raise TooCoarse("the angles after many periods")
        self._first = {turn: self._rotations(turn, range(self._few)) for turn in self.angles}
        for (i, j), turn in self.pairs.items():
            z = acb(start[i], start[j]) * acb(0, self.angles[turn]).exp()
            start[i], start[j] = z.real, z.imag
        off = self.system.norm([v - w for v, w in zip(last, start, strict=True)])
        if not off < 1e6 * TABLE_ERROR * self.bounds.size:
            raise TooCoarse(f"after a period the solution is {float(off):.1e} off")

    def _angles(self, last: Sequence[arb]) -> dict[tuple[int, int], arb]:
        """Return the angles by which pairs of states have turned, by those that are not zero."""
        known = {}
        for (i, j), turn in self.pairs.items():
            if self.start[i] or self.start[j]:
                z = acb(last[i], last[j]) / acb(self.start[i], self.start[j])
                known[turn] = z.arg() if z.real > 0 else (-z).arg() + arb.pi()
        zero = arb(0)
        both = known.get((1, 1), known.get((1, 0), zero) + known.get((0, 1), zero))
        one = known.get((1, 0), both - known.get((0, 1), zero))
        angles = {(1, 1): both, (1, 0): one, (0, 1): known.get((0, 1), both - one)}
        return {turn: angles[turn] for turn in self.pairs.values()}

    # --- phi and psi with their turns -------------------------------------------------------------

    @cached_property
    def arguments(self) -> tuple[Argument, ...]:
        """The arguments of alpha and beta, or of the axis, from which phi and psi follow.

        Raises
        ------
        TooCoarse
            The axis comes too near to a pole.
        """
        phi, psi = self.constants["phi_0"], self.constants["psi_0"]
        with working(self.bits):
            if self.form.name == "axis":
                return (self._argument(0, 1, phi, math.pi / 2),)
            return self._argument(0, 3, (phi + psi) / 2), self._argument(1, 2, (phi - psi) / 2)

    def _argument(self, i: int, j: int, begun: float, ahead: float = 0.0) -> Argument:
        """Follow the argument of a pair of states; plus `ahead` it is `begun` at the start."""
        times, z = self._sample_argument(i, j)
        angles = np.unwrap(np.angle(z))
        angles += _nearest(angles[0] + ahead, begun) - angles[0]
        if self.period is None:
            return Argument(times, angles, 0.0)
        last = angles[np.searchsorted(times, self.period[0], "right") - 1]
        advance = float(self.angles[self.pairs[i, j]])
        return Argument(times, angles, _nearest(advance, last - angles[0]))

    def _sample_argument(self, i: int, j: int) -> tuple[Array, Any]:
        """Return times, and a pair of states there as complex numbers with small relative changes.

        Raises
        ------
        TooCoarse
            The pair comes too near to zero.
        """
        times: Array = self.table.piece * np.arange(len(self.table.pieces) + 1.0)
        for _ in range(PIECE_HALVINGS):
            states, _ = self.table.at((times, np.zeros_like(times)))
            z, spacing = states[i] + 1j * states[j], np.diff(times)
            far = self.bounds.speed * spacing > SWUNG * np.abs(z[:-1])
            if not far.any():
                return times[:-1], z[:-1]
            times = np.sort(np.append(times, (times[:-1] + spacing / 2)[far]))
            if times.size > MOST_LOOKS:
                break
        raise TooCoarse("the axis comes too near to a pole")

    def angles_near(self, t: Array) -> dict[str, Array]:
        """Return phi and psi at times to a quarter of a turn; of the axis form phi alone.

        Raises
        ------
        TooCoarse
            The axis comes too near to a pole.
        """
        n, (since, _) = self._places((t, np.zeros_like(t)))
        found = [
            angles[np.maximum(np.searchsorted(times, since, "right") - 1, 0)] + n * advance
            for times, angles, advance in self.arguments
        ]
        if self.form.name == "axis":
            return {"phi": found[0]}
        turned = self.constants["kappa"] * t
        return {"phi": found[0] + found[1], "psi": found[0] - found[1] + turned}

    @property
    def largest_angle(self) -> float:
        """A bound of phi, and of psi without its uniform part, over the run [rad]."""
        turns = 0.0 if self.period is None else math.floor(self.end / self.period[0])
        ends = ((np.abs(a), np.abs(a + turns * advance)) for _, a, advance in self.arguments)
        return math.pi / 2 + sum(float(np.max(each)) for each in ends)

    # --- values -----------------------------------------------------------------------------------

    def at(self, t: Words) -> tuple[Array, Array]:
        """Return the solution at times, two words of shape (n, k) each, and a bound of its error.

        The bound is in the norm.

        Parameters
        ----------
        t : pair of ndarrays, shape (k,)
            As double-doubles.
        """
        n, since = self._places(t)
        states = np.array(self.table.at(since))
        late = 256 * UNIT**2 * (np.abs(t[0]) + self.table.piece)
        if n.any():
            late = late + np.abs(n) * self.off_a_period
            turned = {turn: self._split_rotation(turn, n) for turn in self.angles}
            for places, turn in self.pairs.items():
                z = _times(turned[turn], states[:, places].swapaxes(0, 1))
                states[:, places] = z.swapaxes(0, 1)
        return states, self.table.lost + self.bounds.size * ROTATED + self.bounds.speed * late

    def _places(self, t: Words) -> tuple[Array, Words]:
        """Return the numbers of whole periods before times, and the times since their ends."""
        n, since = np.zeros_like(t[0]), t
        if self.rests:  # all states are that of the start
            return n, (n, n)
        if self.period is not None:
            high, low = self.period
            for _ in range(2):  # the first quotient may be rounded to a wrong whole number
                n = n + np.floor(since[0] / high)
                whole = two_product(n, high)
                since = add(t, (-whole[0], -(whole[1] + n * low)))
        return n, since

    def _split_rotation(self, turn: tuple[int, int], n: Array) -> Array:
        """Return the rotations by n times an angle, as products of two with few different n."""
        many = np.floor(n / self._few)
        some = (n - self._few * many).astype(np.intp)
        whole, back = np.unique(many, return_inverse=True)
        far = self._rotations(turn, (self._few * whole).tolist())
        return _times(far[..., back], self._first[turn][..., some])

    def _rotations(self, turn: tuple[int, int], n: Sequence[float]) -> Array:
        """Return the complex numbers of rotations by multiples of an angle, as `_times` has it."""
        with working(self.bits):
            found = [(int(k) * self.angles[turn]).sin_cos() for k in n]
            return np.array([[pair(c), pair(s)] for s, c in found]).transpose(1, 2, 0)


def _nearest(angle: float, near: float) -> float:
    """Return an angle plus the whole turns that bring it nearest to another one."""
    return angle + 2 * math.pi * round((near - angle) / (2 * math.pi))


def _times(a: Array, b: Array) -> Array:
    """Return products of complex numbers: real and imaginary parts, each of two words."""
    minus = multiply(a[1], b[1])
    real = add(multiply(a[0], b[0]), (-minus[0], -minus[1]))
    return np.array([real, add(multiply(a[0], b[1]), multiply(a[1], b[0]))])


def _rate(form: Formulation, constants: Mapping[str, float], start: Sequence[float]) -> float:
    """Return the rate, a power of two, by which states that are rates are divided in the norm.

    The smaller the symmetric part of the Jacobian, the slower errors grow; but with a rate far
    below those of the motion the rounding of rates would count too much.
    """
    jacobian = QuadraticSystem.of(form, constants, 1.0).jacobian([arb(v) for v in start])
    rates = 2.0 ** np.arange(-40, 41)
    weights = np.where(form.is_rate, 1 / rates[:, None], 1.0)
    entries = np.array([[float(x) for x in row] for row in jacobian.tolist()])
    scaled = entries * weights[:, :, None] / weights[:, None, :]
    fastest = np.sqrt((scaled**2).sum(axis=(1, 2)).min())
    growth = ((scaled + scaled.transpose(0, 2, 1)) ** 2).sum(axis=(1, 2))
    return float(rates[np.argmin(np.where(rates >= fastest / 8, growth, np.inf))])
