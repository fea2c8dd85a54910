"""The exact solution through a state: one period of it as proved polynomials, then by symmetry.

A period is cut into equal pieces. On each the solution is known by a Taylor polynomial in balls,
p, and by a bound of its distance from p: with the defect D = sup |p' - f(p)| and the logarithmic
norm m of the Jacobian, a distance a at the start of a piece becomes at most

    a exp(m s) + D (exp(m s) - 1)/m        (Dahlquist 1958, Lozinskii 1958).

The caller says how long a period is about; the period itself is twice the time between two
turning points, which are zeros of the event function on these polynomials. A motion that nutates
repeats itself then but for rotations: phi and psi advance, and with them the pairs of states that
turn. These rotations are read off the solution after one period. Nothing here uses the elliptic
closed form.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np
from flint import acb, acb_poly, arb, arb_poly
from numpy.typing import NDArray

from heavytop.certificate.balls import (
    TooCoarse,
    hull,
    larger,
    operator_norm,
    pair,
    sup,
    symmetric,
    up,
    upper,
)
from heavytop.certificate.system import CERTIFIED, QuadraticSystem
from heavytop.equations.formulation import Formulation
from heavytop.equations.lambdify import evaluated
from heavytop.exact.balls import working
from heavytop.exact.pairs import UNIT, add, multiply, two_product

Array = NDArray[np.float64]
Words = tuple[Array, Array]

KEPT_COEFFICIENTS: Final = 12  # coefficients of a piece that are kept,
LEADING_COEFFICIENTS: Final = 3  # of which the first have twice the digits
MARGIN: Final = 1e-4  # how far from the solution a run may be, for the norms to hold
TABLE_ERROR: Final = 1e-27  # what the table may be off, relative to the size of the states,
LOST_IN_PAIRS: Final = 1e-18  # and what is read from it in double-doubles
ROTATED: Final = 1e-28  # a state, by rounding and by rotation: far above 2^-104 and `pair`'s
WIDER: Final = 1 + 2.0**-20  # a piece, for what is bounded in it
FEW_TURNS: Final = 256  # of which sines and cosines are kept, or all that a short run has
TURN_ERROR: Final = 1e-30  # rad: how well the angle is known by which the last period is turned
BEFORE_START: Final = 1e-7  # of a piece before time 0, in which an event may be
MOST_PIECES: Final = 100_000
SWUNG: Final = 0.7  # of its size a pair of states moves between two looks: below pi/4 as an angle
FINEST_PIECE: Final = 2.0**-64  # of a piece: nearer to a pole angles are not followed
# bits, the order of the polynomials, and how many of them there are while what is fastest at the
# start turns by a radian: later something else may be faster
SETTINGS: Final = ((192, 24, 16), (384, 40, 32), (1024, 90, 64))


class Bounds(NamedTuple):
    """What holds along the solution, and within `MARGIN` of it, in the norm of the system.

    Attributes
    ----------
    growth : float
        Of the logarithmic norm of the Jacobian: how fast an error can grow.
    jacobian : float
        Of its norm: how fast an error can change.
    speed : float
        Of the right-hand side.
    size : float
        Of the state.
    """

    growth: float
    jacobian: float
    speed: float
    size: float


class Piece(NamedTuple):
    """A piece of the table: a polynomial for each state, and how far they may be off."""

    p: list[arb_poly]
    error: arb


class Argument(NamedTuple):
    """The argument of a pair of states, with all its turns [rad].

    Attributes
    ----------
    times, angles : ndarray
        Some times of the table, and what it is there; till the next it stays within pi/4.
    advance : float
        What it grows by in a period.
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
        Up to when; negative for a run back in time.
    period : float, optional
        What its period is about; None where it is to be tabulated up to the end.

    Attributes
    ----------
    system : QuadraticSystem
    period : tuple of float or None
        As a double-double; None where none was given.
    bounds : Bounds

    Raises
    ------
    TooCoarse
        1024 bits do not do, or the period is another one.
    ValueError
        A run back in time has no period that leads there.
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
        for self.bits, self.order, self.fine in SETTINGS:
            try:
                with working(self.bits):
                    self._solve(end if period is None else period)
                    if period is not None:
                        self._close()
            except TooCoarse:
                if self.bits == SETTINGS[-1][0]:
                    raise
            else:
                return

    def _solve(self, span: float) -> None:
        """Solve the equations piece by piece, over a time and a little more."""
        system, x, error = self.system, [arb(v) for v in self.start], arb(0)
        fastest = float(operator_norm(system.jacobian(x)).upper()) or 1.0
        self.piece = 2.0 ** -math.ceil(math.log2(self.fine * fastest))
        self.reach = arb(self.piece) * WIDER
        count = 1 if self.rests else math.ceil(span / self.piece) + 1
        if span < 0 and not self.rests:
            raise ValueError("back in time, and no period is known")
        if count > MOST_PIECES:
            raise TooCoarse(f"more than {MOST_PIECES} pieces in a period")
        self.pieces: list[Piece] = []
        self.period: tuple[float, float] | None = None
        largest, lost = [arb(0)] * 4, arb(0)
        for _ in range(count):
            piece, found = self._solved(x, error)
            self.pieces.append(piece)
            largest = [larger(a, b) for a, b in zip(largest, found, strict=True)]
            lost = larger(lost, piece.error + system.norm(self._left_out(piece)))
            y = [q(arb(self.piece)) for q in piece.p]
            x = [arb(v.mid()) for v in y]
            error = upper(piece.error + system.norm([v - w for v, w in zip(y, x, strict=True)]))
        self.bounds, self.lost = Bounds(*map(up, largest)), up(lost)
        worst = max(float(each.error.upper()) for each in self.pieces)
        if not (
            worst <= TABLE_ERROR * self.bounds.size
            and self.lost <= LOST_IN_PAIRS * self.bounds.size
        ):
            raise TooCoarse("the table")
        self._keep()

    def _solved(self, x: list[arb], error: arb) -> tuple[Piece, tuple[arb, ...]]:
        """Solve the equations in one piece; also return what is largest in it, as `Bounds` does."""
        system, reach = self.system, self.reach
        p = [arb_poly(row) for row in system.taylor(x, self.order)]
        f = system.polynomials(p)
        margins = (arb(0, MARGIN / w) for w in system.weights)
        here = [hull(q, reach) + margin for q, margin in zip(p, margins, strict=True)]
        matrix = system.jacobian(here)
        growth = operator_norm(symmetric(matrix))
        field = [q[0] for q in system.polynomials([arb_poly([v]) for v in here])]
        defect = system.norm([sup(q.derivative() - g, reach) for q, g in zip(p, f, strict=True)])
        grow = (growth * reach).exp()
        error = upper(error * grow + defect * ((grow - 1) / growth if growth > 0 else reach))
        if not error < MARGIN:
            raise TooCoarse("the error of the table grows too fast")
        largest = growth, operator_norm(matrix), system.norm(field), system.norm(here)
        return Piece(p, error), largest

    def _left_out(self, piece: Piece) -> list[arb]:
        """Return what `at` leaves out of polynomials, and what it rounds."""
        rows = [[q[k] for k in range(self.order + 1)] for q in piece.p]
        tail = (
            sup(arb_poly([arb(0)] * KEPT_COEFFICIENTS + row[KEPT_COEFFICIENTS:]), self.reach)
            for row in rows
        )
        fine = (
            sup(
                arb_poly(
                    [arb(0)] * LEADING_COEFFICIENTS + row[LEADING_COEFFICIENTS:KEPT_COEFFICIENTS]
                ),
                self.reach,
            )
            for row in rows
        )
        return [
            upper(a + 4 * KEPT_COEFFICIENTS * UNIT * b) for a, b in zip(tail, fine, strict=True)
        ]

    @cached_property
    def rests(self) -> bool:
        """Whether nothing moves: the right-hand sides vanish at the start, exactly."""
        with working(self.bits):
            start = [arb_poly([arb(v)]) for v in self.start]
            return all(f[0] == 0 for f in self.system.polynomials(start))

    # --- turning points, the period, and the rotations after one ---------------------------------

    def zeros(self, event: str) -> list[arb]:
        """Return the zeros of an event function within a period, from time 0 or just before it.

        Without a period all of them are returned.

        Raises
        ------
        TooCoarse
            Two of them are too near to each other.
        """
        found: list[arb] = []
        with working(self.bits):
            again, steepest = self.reach / 4, self._slope(event)  # nearer it is the same one
            for place in range(len(self.pieces)):
                zero = self._zero(event, steepest, place)
                if zero is None or (found and not zero > found[-1] + again):
                    continue
                if self.period and found and not zero < found[0] + self.exact_period - again:
                    break
                found.append(zero)
        return found

    def _zero(self, event: str, steepest: arb, place: int) -> arb | None:
        """Return the zero of an event function in a piece.

        One a little before time 0 counts: rounding puts turning points at the start there.

        Raises
        ------
        TooCoarse
            Neither the function nor its slope has one sign in the piece.
        """
        (p, error), reach = self.pieces[place], self.reach
        q = self._event(event, p)
        if all(c == 0 for c in q.coeffs()):
            return None
        off, value = upper(steepest * error), hull(q, reach)  # it differs so much from the solution
        if value - off > 0 or value + off < 0:
            return None
        slope = hull(q.derivative(), 2 * reach)
        if slope.contains(0):
            raise TooCoarse(f"a zero of {event}")
        at = reach / 2
        for _ in range(20):
            at = arb((at - q(at) / q.derivative()(at)).mid())
        radius = upper((abs(q(at)) + off) / abs(slope))
        if not abs(at) + radius < 2 * reach:  # beyond, no slope is known
            raise TooCoarse(f"a zero of {event}")
        least = -BEFORE_START * reach if place == 0 else arb(0)
        if not (at + radius > least and at - radius < reach):
            return None
        return place * arb(self.piece) + at + arb(0, radius)

    def _event(self, event: str, p: Sequence[Any]) -> arb_poly:
        named = {s.name: x for s, x in zip(self.form.states, p, strict=True)}
        named |= {name: arb_poly([arb(x)]) for name, x in self.constants.items()}
        found: arb_poly
        (found,) = evaluated([self.form.events[event]], named, lambda n: arb_poly([n]), {})
        return found

    def _slope(self, event: str) -> arb:
        """Return a bound of the gradient of an event function along the solution, in the norm."""
        total, here = arb(0), [arb(0, self.bounds.size / w) for w in self.system.weights]
        for i, w in enumerate(self.system.weights):
            moved = [arb_poly([x, 1] if i == j else [x]) for j, x in enumerate(here)]
            total += (upper(abs(self._event(event, moved)[1])) / w) ** 2
        return upper(total.sqrt())

    def _close(self) -> None:
        """Find the period, and the angles by which pairs of states turn in it.

        Raises
        ------
        TooCoarse
            They are not known well enough; after a period the solution is not where it was.
        """
        turning = self.zeros("turning")
        T = 2 * (turning[1] - turning[0]) if len(turning) > 1 else arb("inf")
        if not len(self.pieces) * self.piece > T:  # beyond, nothing is known
            raise TooCoarse("the period is longer than was said")
        self.exact_period = T
        last, start = self.ball(T), [arb(v) for v in self.start]
        # so far a ball may be from the double-double that is made of it
        self.period, self.off_a_period = pair(T), up(arb(T.rad()) + abs(T) * arb(2) ** -104)
        self.angles = self._angles(last)
        turns = math.ceil(abs(self.end) / self.period[0]) + 2
        self._few = min(FEW_TURNS, turns)
        wide = max(up(arb(angle.rad())) for angle in self.angles.values())
        if not (turns + self._few) * wide <= TURN_ERROR:
            raise TooCoarse("the angles after many periods")
        self._first = {turn: self._rotations(turn, range(self._few)) for turn in self.angles}
        for (i, j), turn in self.pairs.items():
            s, c = self.angles[turn].sin_cos()
            start[i], start[j] = c * start[i] - s * start[j], s * start[i] + c * start[j]
        apart = self.system.norm([v - w for v, w in zip(last, start, strict=True)])
        if not apart < 1e6 * TABLE_ERROR * self.bounds.size:
            raise TooCoarse(f"after a period the solution is {float(apart):.1e} off")

    def _angles(self, last: Sequence[arb]) -> dict[tuple[int, int], arb]:
        """Return by which angles pairs of states have turned, from those that are not zero."""
        turns, known = self.pairs, {}
        for i, j in turns:
            if self.start[i] or self.start[j]:
                z = acb(last[i], last[j]) / acb(self.start[i], self.start[j])
                known[turns[i, j]] = z.arg() if z.real > 0 else (-z).arg() + arb.pi()
        both, one, other = (known.get(key) for key in ((1, 1), (1, 0), (0, 1)))
        zero = arb(0)
        if both is None:
            known[1, 1] = (one or zero) + (other or zero)
        elif one is None or other is None:
            known[1, 0] = one = one if one is not None else both - (other or zero)
            known[0, 1] = both - one
        return {turn: known.get(turn, zero) for turn in turns.values()}

    # --- phi and psi with their turns -------------------------------------------------------------

    @cached_property
    def arguments(self) -> tuple[Argument, ...]:
        """The arguments of alpha and beta, or of the axis: of these phi and psi are made.

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
        """Follow the argument of a pair of states, and what it is ahead, from where it begins."""
        looks = [
            (k * self.piece + s, cmath.phase(complex(z)))
            for k, (p, error) in enumerate(self.pieces)
            for s, z in self._looks(acb_poly(p[i]) + acb_poly([acb(0, 1)]) * p[j], error)
        ]
        times, angles = np.array(looks).T
        angles = np.unwrap(angles)
        angles += _nearest(angles[0] + ahead, begun) - angles[0]
        if self.period is None:
            return Argument(times, angles, 0.0)
        last = angles[np.searchsorted(times, self.period[0], "right") - 1]
        advance = float(self.angles[self.pairs[i, j]])
        return Argument(times, angles, _nearest(advance, last - angles[0]))

    def _looks(self, z: acb_poly, error: arb) -> Iterator[tuple[float, acb]]:
        """Yield times in a piece and what a pair of states is there, that moves little between."""
        waiting = [(0.0, self.piece)]
        while waiting:
            s, length = waiting.pop()
            here, *rest = z(acb_poly([s, 1])).coeffs() or [acb(0)]
            moved = sum((abs(c) * arb(length) ** k for k, c in enumerate(rest, 1)), 3 * error)
            if moved < SWUNG * abs(here):
                yield s, here
            elif length < FINEST_PIECE * self.piece:
                raise TooCoarse("the axis comes too near to a pole")
            else:
                waiting += [(s + length / 2, length / 2), (s, length / 2)]

    def angles_near(self, t: Array) -> dict[str, Array]:
        """Return phi and psi at times, but for less than a quarter of a turn; of the axis form phi.

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

    def _keep(self) -> None:
        """Keep the polynomials as doubles."""
        pieces = [piece.p for piece in self.pieces]
        lead = [[[pair(q[k]) for q in p] for p in pieces] for k in range(LEADING_COEFFICIENTS)]
        rest = [
            [[float(q[k].mid()) for q in p] for p in pieces]
            for k in range(LEADING_COEFFICIENTS, KEPT_COEFFICIENTS)
        ]
        # order, word, state, piece
        self._lead = np.ascontiguousarray(np.array(lead).transpose(0, 3, 2, 1))
        self._rest = np.ascontiguousarray(np.array(rest).transpose(0, 2, 1))

    def ball(self, t: arb) -> list[arb]:
        """Return the solution at a time within the table, in balls."""
        j = min(int(float((t / self.piece).mid())), len(self.pieces) - 1)
        since, (p, error) = t - j * arb(self.piece), self.pieces[j]
        off = (arb(0, upper(error / w)) for w in self.system.weights)
        return [q(since) + each for q, each in zip(p, off, strict=True)]

    def at(self, t: Words) -> tuple[Array, Array]:
        """Return the solution at times, two words of shape (n, k) each, and how far it is off.

        That is in the norm.

        Parameters
        ----------
        t : pair of ndarrays, shape (k,)
            As double-doubles.
        """
        n, since = self._places(t)
        last = 0 if self.rests else len(self.pieces) - 1
        j = np.clip(np.floor(since[0] / self.piece), 0, last).astype(np.intp)
        begun = np.asarray(-self.piece * j, dtype=np.float64)
        s = add(since, (begun, np.zeros_like(begun)))
        # at rest the first polynomials are the solution, exactly, at all times
        inside = (s[0] > -1e-7 * self.piece) & (s[0] < self.piece * (1 + 1e-7))
        if not (self.rests or inside.all()):
            raise ArithmeticError("a time outside of the table")
        q = self._rest[-1][:, j]
        for c in self._rest[-2::-1]:
            q = q * s[0] + c[:, j]
        x = q, np.zeros_like(q)
        for c_high, c_low in self._lead[::-1]:
            x = add((c_high[:, j], c_low[:, j]), multiply(x, s))
        late = 256 * UNIT**2 * (np.abs(t[0]) + self.piece)
        if n.any():
            x, late = self._advanced(x, n), late + np.abs(n) * self.off_a_period
        return np.array(x), self.lost + self.bounds.size * ROTATED + self.bounds.speed * late

    def _places(self, t: Words) -> tuple[Array, Words]:
        """Return how many whole periods before times there are, and the times since then."""
        n, since = np.zeros_like(t[0]), t
        if self.period is not None:
            high, low = self.period
            for _ in range(2):  # the quotient may be rounded over a whole number
                n = n + np.floor(since[0] / high)
                whole = two_product(n, high)
                since = add(t, (-whole[0], -(whole[1] + n * low)))
        return n, since

    def _advanced(self, x: Words, n: Array) -> Any:
        """Return what a state has become n periods later."""
        turned, states = {turn: self._turned(turn, n) for turn in self.angles}, np.array(x)
        for places, turn in self.pairs.items():
            z = _times(turned[turn], states[:, places].swapaxes(0, 1))
            states[:, places] = z.swapaxes(0, 1)
        return states

    def _turned(self, turn: tuple[int, int], n: Array) -> Array:
        """Return the rotations by n times an angle: by the first few of it, and by the rest."""
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
    """Return the angle nearest to another one, of those whole turns apart."""
    return angle + 2 * math.pi * round((near - angle) / (2 * math.pi))


def _times(a: Array, b: Array) -> Array:
    """Return products of complex numbers: real and imaginary parts, each of two words."""
    minus = multiply(a[1], b[1])
    real = add(multiply(a[0], b[0]), (-minus[0], -minus[1]))
    return np.array([real, add(multiply(a[0], b[1]), multiply(a[1], b[0]))])


def _rate(form: Formulation, constants: Mapping[str, float], start: Sequence[float]) -> float:
    """Return the rate, a power of two, by which rates are measured against the other states.

    The smaller the symmetric part of the Jacobian, the slower errors grow; but a rate far below
    those of the motion would make much of the rounding of rates.
    """
    jacobian = QuadraticSystem.of(form, constants, 1.0).jacobian([arb(v) for v in start])
    rates = 2.0 ** np.arange(-40, 41)
    weights = np.where(form.is_rate, 1 / rates[:, None], 1.0)
    entries = np.array([[float(x) for x in row] for row in jacobian.tolist()])
    scaled = entries * weights[:, :, None] / weights[:, None, :]
    fastest = np.sqrt((scaled**2).sum(axis=(1, 2)).min())
    growth = ((scaled + scaled.transpose(0, 2, 1)) ** 2).sum(axis=(1, 2))
    return float(rates[np.argmin(np.where(rates >= fastest / 8, growth, np.inf))])
