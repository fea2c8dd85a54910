"""The exact solution through a state: one period of it as proved polynomials, then by symmetry.

A period is cut into equal pieces. On each the solution is known by a Taylor polynomial in balls,
p, and by a bound of its distance from p: with the defect D = sup |p' - f(p)| and the logarithmic
norm m of the Jacobian, a distance a at the start of a piece becomes at most

    a exp(m s) + D (exp(m s) - 1)/m        (Dahlquist 1958, Lozinskii 1958).

Turning points are zeros of the event function on these polynomials, so the period is twice the
time between two of them. A motion that nutates repeats itself then but for rotations: phi and psi
advance, and with them the pairs of states that turn. These rotations are read off the solution
after one period. Nothing here uses the elliptic closed form.

psi of the axis form is a quadrature beside the states, of P/(1 + e_z) or P/(1 - e_z) less a
constant rate: its polynomials are those of the quotient, and its error is added up.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np
from flint import acb, arb, arb_mat, arb_poly
from numpy.typing import NDArray

from heavytop.certificate.balls import (
    UNIT,
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
from heavytop.certificate.system import QuadraticSystem
from heavytop.equations.formulation import Formulation
from heavytop.equations.lambdify import evaluated
from heavytop.exact.balls import working
from heavytop.exact.pairs import add, multiply, two_product

Array = NDArray[np.float64]
Words = tuple[Array, Array]

KEPT: Final = 12  # coefficients of a piece that are kept,
LEAD: Final = 3  # of which the first have twice the digits
MARGIN: Final = 1e-4  # how far from the solution a run may be, for the norms to hold
SMALL: Final = 1e-27  # what the table may be off, relative to the size of the states,
LOST: Final = 1e-18  # and what is read from it in double-doubles
ROTATED: Final = 1e-28  # a state, by rounding and by rotation: far above 2^-104 and `pair`'s
SLACK: Final = 1e-18  # far above what a table that is so good is off, in squares of states
NEAREST: Final = 1e-6  # to a pole: nearer the turns of phi and psi are not proved
WIDER: Final = 1 + 2.0**-20  # a piece, for what is bounded in it
FEW_TURNS: Final = 256  # of which sines and cosines are kept, or all that a short run has
TURNED: Final = 1e-30  # rad: how well the angle is known by which the last period is turned
BEFORE: Final = 1e-7  # of a piece before time 0, in which an event may be
MOST_PIECES: Final = 100_000
FEW_PIECES: Final = 2000  # of a run that may do without a period
# bits, the order of the polynomials, and how many of them there are while what is fastest at the
# start turns by a radian: later something else may be faster
SETTINGS: Final = ((192, 24, 16), (384, 40, 32), (1024, 90, 64))

PAIRS: Final = {  # states that turn together: how often by the angles of alpha and of beta
    "axis": {(0, 1): (1, 1), (3, 4): (1, 1)},
    "attitude": {(0, 3): (1, 0), (1, 2): (0, 1), (4, 5): (1, 1)},
    "cubic": {},
}
READ: Final = {"axis": 3, "attitude": 4, "cubic": 1}  # states from which outputs are computed
TOLD: Final = {"axis": ((0, 1),), "attitude": ((0, 3), (1, 2)), "cubic": ()}  # by which angles


class Quadrature(NamedTuple):
    """An angle beside the axis: its rate is momentum/(1 + side e_z) - frame [in own units]."""

    side: int
    momentum: float
    frame: float


@dataclass(frozen=True, slots=True)
class Bounds:
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
    inverse : float
        Of 1/r, where r is the size of a pair of states whose argument is counted; inf at a pole.
    turning : float
        Of the sum of how fast these arguments change; inf at a pole.
    stiffness : float
        Of the factors in Hill's equation for the two complex numbers whose arguments phi and psi
        are made of: an argument that turns by pi takes at least pi over its root (`turns`).
    """

    growth: float
    jacobian: float
    speed: float
    size: float
    inverse: float
    turning: float
    stiffness: float


class Piece(NamedTuple):
    """A piece of the table: the coefficients of each polynomial, and how far they may be off."""

    rows: list[list[arb]]
    error: arb
    aside: arb


class Flow:
    """The exact solution through a start, in the unit of time of a run.

    Parameters
    ----------
    form : Formulation
        The axis form without angles, the attitude or the cubic form.
    constants : mapping from str to float
    start : sequence of float
        The state at time 0: exactly these doubles.
    end : float
        Up to when, should the motion have no period before; negative for a run back in time.
    quadrature : Quadrature, optional
        Of the axis form.

    Attributes
    ----------
    system : QuadraticSystem
    period : tuple of float or None
        As a double-double; None where none is needed.
    bounds : Bounds
    beside_rate, beside_factor : float
        Bounds of the rate of the quadrature, and of 1/(1 + side e_z).

    Raises
    ------
    TooCoarse
        1024 bits do not do.
    ValueError
        A run back in time has no period that leads there.
    """

    def __init__(
        self,
        form: Formulation,
        constants: Mapping[str, float],
        start: Sequence[float],
        end: float,
        quadrature: Quadrature | None = None,
    ) -> None:
        self.form, self.constants, self.start, self.end = form, dict(constants), start, end
        self.quadrature = quadrature
        for setting in SETTINGS:
            self.bits, self.order, self.fine = setting
            with working(self.bits):
                try:
                    self.system = QuadraticSystem.of(form, constants, _rate(form, constants, start))
                    self._solve()
                    self._close()
                    self._keep()
                except TooCoarse:
                    if setting == SETTINGS[-1]:
                        raise
                    continue
            return

    def _solve(self) -> None:
        """Solve the equations piece by piece, up to the end of a period, or to the end."""
        system = self.system
        x = [arb(v) for v in self.start]
        fastest = float(operator_norm(system.jacobian(x)).upper()) or 1.0
        self.piece = delta = 2.0 ** -math.ceil(math.log2(self.fine * fastest))
        self.reach = arb(delta) * WIDER
        self.pieces: list[Piece] = []
        self.turning: list[arb] = []
        self.unclear = False
        last, largest, looking = Piece([], arb(0), arb(0)), [arb(0)] * 7, True
        beside, lost, self.beside_rate, self.beside_factor = arb(0), arb(0), 0.0, 0.0
        stop = 1 if self.rests else math.ceil(abs(self.end) / delta) + 2
        # only a period leads back: it is looked for with all bits
        if self.end < 0 and not self.rests:
            stop = max(stop, FEW_PIECES + 1)
        while len(self.pieces) < stop:
            if len(self.pieces) > MOST_PIECES:
                raise TooCoarse(f"more than {MOST_PIECES} pieces in a period")
            piece, p, here, found = self._solved(x, beside, last)
            largest = [larger(a, b) for a, b in zip(largest, found, strict=True)]
            lost = larger(lost, piece.error + system.norm(self._left_out(piece.rows[: len(x)])))
            self.pieces.append(piece)
            if looking:
                looking = self._look(p, piece.error, here, stop)
                if len(self.turning) == 2:
                    stop = math.ceil(float(self.exact_period.upper()) / delta) + 1
            y = [arb_poly(row)(arb(delta)) for row in piece.rows]
            x = [arb(v.mid()) for v in y[: len(x)]]
            moved = system.norm([v - w for v, w in zip(y, x, strict=False)])
            beside = arb(y[-1].mid())
            last = Piece([], upper(piece.error + moved), upper(piece.aside + y[-1].rad()))
        self.bounds, self.lost = Bounds(*map(up, largest)), up(lost)
        worst = max(float(each.error.upper()) for each in self.pieces)
        if not (worst <= SMALL * self.bounds.size and self.lost <= LOST * self.bounds.size):
            raise TooCoarse("the table")

    def _solved(
        self, x: list[arb], beside: arb, last: Piece
    ) -> tuple[Piece, list[arb_poly], list[arb], tuple[arb, ...]]:
        """Solve the equations in one piece.

        Returns the piece; its polynomials without the quadrature; a box around the solution and all
        that is as near to it as runs may be; and what is largest in the piece, as `Bounds` has it.
        """
        system, reach = self.system, self.reach
        rows = system.taylor(x, self.order)
        p = [arb_poly(row) for row in rows]
        f = system.polynomials(p)
        margins = [arb(0, MARGIN / w) for w in system.weights]
        here = [hull(q, reach) + margin for q, margin in zip(p, margins, strict=True)]
        matrix = system.jacobian(here)
        growth = operator_norm(symmetric(matrix))
        field = [q[0] for q in system.polynomials([arb_poly([v]) for v in here])]
        defect = system.norm([sup(q.derivative() - g, reach) for q, g in zip(p, f, strict=True)])
        error, aside = upper(_grown(last.error, defect, growth, reach)), last.aside
        if not error < MARGIN:
            raise TooCoarse("the error of the table grows too fast")
        if self.quadrature:
            more, wrong = self._quotient(p[2], here[2], error)
            rows.append([beside + more[0], *more[1:]])
            aside = upper(aside + wrong * reach)
        size, speed = system.norm(here), system.norm(field)
        largest = growth, operator_norm(matrix), speed, size, *self._arguments(p)
        return Piece(rows, error, aside), p, here, (*largest, self._stiffness(here))

    def _left_out(self, rows: list[list[arb]]) -> list[arb]:
        """Return what `at` leaves out of polynomials, and what it rounds."""
        tail = (sup(arb_poly([arb(0)] * KEPT + row[KEPT:]), self.reach) for row in rows)
        fine = (sup(arb_poly([arb(0)] * LEAD + row[LEAD:KEPT]), self.reach) for row in rows)
        return [upper(a + 4 * KEPT * UNIT * b) for a, b in zip(tail, fine, strict=True)]

    def _quotient(self, p: arb_poly, here: arb, error: arb) -> tuple[list[arb], arb]:
        """Return the polynomial of the quadrature, and a bound of the error of its rate."""
        side, momentum, frame = self.quadrature or (1, 0.0, 0.0)
        below, least = 1 + side * p, upper(1 / (1 + side * here))
        b = [below[k] for k in range(self.order)]
        found = [arb(momentum) / b[0]]
        for k in range(1, self.order):
            found.append(-sum(map(arb.__mul__, b[1 : k + 1], found[::-1]), arb(0)) / b[0])
        wrong = sup(arb_poly(found) * below - arb(momentum), self.reach) * least
        wrong += abs(arb(momentum)) * error * least * least
        rate = abs(arb(momentum) / (1 + side * here) - arb(frame))
        self.beside_rate = max(self.beside_rate, up(rate))
        self.beside_factor = max(self.beside_factor, up(least))
        found[0] -= arb(frame)
        whole = [x / (k + 1) for k, x in enumerate(found)]
        return [arb(0), *whole], upper(wrong)

    def _arguments(self, p: list[arb_poly]) -> tuple[arb, arb]:
        """Return `inverse` and `turning` of `Bounds` in one piece."""
        largest, turning, slack = arb(0), arb(0), arb(0, SLACK)
        for i, j in TOLD[self.form.name]:
            square = hull(p[i] * p[i] + p[j] * p[j], self.reach) + slack
            if not square > NEAREST**2:
                return arb("inf"), arb("inf")
            largest = larger(largest, 1 / square.sqrt())
            swept = hull(p[i] * p[j].derivative() - p[j] * p[i].derivative(), self.reach)
            turning += abs(swept + slack) / square
        return largest, upper(turning)

    def _stiffness(self, here: list[arb]) -> arb:
        """Return a bound of l^2/4 + g |beta|^2 and of l^2/4 - g |alpha|^2 in a piece."""
        if self.form.name == "cubic":
            return arb(0)
        g, along = arb(self.constants["g"]), arb(self.constants["l_z"])
        *e, l_x, l_y = here
        if self.form.name == "attitude":
            # no powers: that of a ball around 0 is nan
            alpha, beta = e[0] * e[0] + e[3] * e[3], e[1] * e[1] + e[2] * e[2]
        else:
            length = sum((x * x for x in e), arb(0)).sqrt()
            alpha, beta = (length + e[2]) / 2, (length - e[2]) / 2
        square = (l_x * l_x + l_y * l_y + along * along) / 4
        return larger(upper(square + g * beta), square - g * alpha)

    @cached_property
    def rests(self) -> bool:
        """Whether nothing moves: the right-hand sides vanish at the start, exactly."""
        with working(self.bits):
            start = [arb_poly([arb(v)]) for v in self.start]
            return all(f[0] == 0 for f in self.system.polynomials(start))

    # --- turning points, the period, and the rotations after one ---------------------------------

    @property
    def exact_period(self) -> arb:
        """Twice the time between two turning points that follow each other."""
        return 2 * (self.turning[1] - self.turning[0])

    def _look(self, p: list[arb_poly], error: arb, here: list[arb], stop: int) -> bool:
        """Look for a turning point in the last piece; tell whether to look on.

        Where it cannot be told whether there is one, a short run does without a period.
        """
        try:
            found = self._zero("turning", p, error, here, len(self.pieces) - 1)
        except TooCoarse:
            if stop > FEW_PIECES:
                raise
            self.turning.clear()
            self.unclear = True
            return False
        if found is not None and not (
            self.turning and not found > self.turning[-1] + arb(self.piece) / 4
        ):
            self.turning.append(found)
        return len(self.turning) < 2

    def _zero(
        self, event: str, p: list[arb_poly], error: arb, here: list[arb], place: int
    ) -> arb | None:
        """Return the zero of an event function in a piece.

        One a little before time 0 counts: rounding puts turning points at the start there.

        Raises
        ------
        TooCoarse
            Neither the function nor its slope has one sign in the piece.
        """
        q, reach = self._event(event, p), self.reach
        if all(c == 0 for c in q.coeffs()):
            return None
        # how much it differs between p and the solution: at most its slope times the distance
        off = upper(self._slope(event, here) * error)
        value = hull(q, reach)
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
        least = -BEFORE * reach if place == 0 else arb(0)
        if not (at + radius > least and at - radius < reach):
            return None
        return place * arb(self.piece) + at + arb(0, radius)

    def zeros(self, event: str) -> list[arb]:
        """Return the zeros of an event function within a period, from time 0 or just before it.

        Raises
        ------
        TooCoarse
            Two of them are too near to each other.
        """
        if self.unclear:
            raise TooCoarse("turning points")
        if event == "turning":
            return self.turning
        found: list[arb] = []
        with working(self.bits):
            n, reach = len(self.start), self.reach
            for place, piece in enumerate(self.pieces):
                p = [arb_poly(row) for row in piece.rows[:n]]
                here = [hull(q, reach) for q in p]
                zero = self._zero(event, p, piece.error, here, place)
                if zero is None or (found and not zero > found[-1] + reach / 4):
                    continue
                again = found[0] + self.exact_period - reach / 4 if found and self.period else None
                if again is None or zero < again:
                    found.append(zero)
        return found

    def _event(self, event: str, p: Sequence[Any]) -> arb_poly:
        named = {s.name: x for s, x in zip(self.form.states, p, strict=True)}
        named |= {name: arb_poly([arb(x)]) for name, x in self.constants.items()}
        found: arb_poly
        (found,) = evaluated([self.form.events[event]], named, lambda n: arb_poly([n]), {})
        return found

    def _slope(self, event: str, here: Sequence[arb]) -> arb:
        """Return a bound of the gradient of an event function in a box, in the norm."""
        total = arb(0)
        for i, w in enumerate(self.system.weights):
            moved = [arb_poly([x, 1] if i == j else [x]) for j, x in enumerate(here)]
            coefficients = self._event(event, moved).coeffs()
            slope = coefficients[1] if len(coefficients) > 1 else arb(0)
            total += (upper(abs(slope)) / w) ** 2
        return upper(total.sqrt())

    def _close(self) -> None:
        """Find the period, and the angles by which pairs of states turn in it.

        Raises
        ------
        TooCoarse
            They are not known well enough; after a period the solution is not where it was.
        """
        self.period: tuple[float, float] | None = None
        self.angles: dict[tuple[int, int], arb] = {}  # by how often those of alpha and beta count
        self._known: dict[tuple[int, int], tuple[Words, Words]] = {}
        self._turns: dict[tuple[int, int], list[tuple[int, int]]] = {}
        self._few = FEW_TURNS
        self.beside = (0.0, 0.0)  # what the quadrature grows by in a period
        self.off_a_period = 0.0, 0.0  # how far that and the period may be off
        if len(self.turning) < 2:
            if self.end < 0 and not self.rests:
                raise ValueError("back in time, and no period is found")
            return
        T = self.exact_period
        self.period = pair(T)
        last, start = self.ball(T), [arb(v) for v in self.start]
        if self.quadrature:
            grown = last.pop()
            self.beside = pair(grown)
            self.off_a_period = _off(T), _off(grown)
        else:
            self.off_a_period = _off(T), 0.0
        self.angles = self._angles(last)
        turns = math.ceil(abs(self.end) / self.period[0]) + 2
        self._few = min(FEW_TURNS, turns)
        wide = max((up(arb(angle.rad())) for angle in self.angles.values()), default=0.0)
        if not (turns + self._few) * wide <= TURNED:
            raise TooCoarse("the angles after many periods")
        for (i, j), turn in PAIRS[self.form.name].items():
            self._turns.setdefault(turn, []).append((i, j))
            s, c = self.angles[turn].sin_cos()
            start[i], start[j] = c * start[i] - s * start[j], s * start[i] + c * start[j]
        apart = self.system.norm([v - w for v, w in zip(last, start, strict=True)])
        if not apart < 1e6 * SMALL * self.bounds.size:
            raise TooCoarse(f"after a period the solution is {float(apart):.1e} off")

    def _angles(self, last: Sequence[arb]) -> dict[tuple[int, int], arb]:
        """Return by which angles pairs of states have turned, from those that are not zero."""
        turns, known = PAIRS[self.form.name], {}
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

    # --- values -----------------------------------------------------------------------------------

    def _keep(self) -> None:
        """Keep the polynomials as doubles."""
        rows = [piece.rows for piece in self.pieces]
        columns = [list(zip(*each, strict=True)) for each in zip(*rows, strict=True)]
        lead = np.array([[[pair(x) for x in row[k]] for row in columns] for k in range(LEAD)])
        self._lead = np.ascontiguousarray(lead.transpose(0, 3, 1, 2))  # order, word, state, piece
        self._rest = np.array(
            [[[float(x.mid()) for x in row[k]] for row in columns] for k in range(LEAD, KEPT)]
        )
        self.aside = 0.0
        if self.quadrature:
            lost = (each.aside + self._left_out(each.rows[-1:])[0] for each in self.pieces)
            self.aside = max(map(up, lost))

    def ball(self, t: arb) -> list[arb]:
        """Return the solution at a time within the table, in balls; the quadrature last."""
        j = min(int(float((t / self.piece).mid())), len(self.pieces) - 1)
        rows, error, aside = self.pieces[j]
        since = t - j * arb(self.piece)
        off = [upper(error / w) for w in self.system.weights] + [aside]
        return [arb_poly(row)(since) + arb(0, each) for row, each in zip(rows, off, strict=False)]

    def at(self, t: Words) -> tuple[Words, Array, Array]:
        """Return the solution at times, as double-doubles of shape (n, k), and how far it is off.

        That is told in the norm, and for the quadrature.

        Parameters
        ----------
        t : pair of ndarrays, shape (k,)
            As double-doubles.
        """
        high, since = t[0], t
        n: Array = np.zeros_like(high)
        if self.period is not None:
            n = np.floor(high / self.period[0])
            since = self._since(t, n)
            wrong = np.floor(since[0] / self.period[0])
            if wrong.any():  # the quotient was rounded over a whole number
                n = n + wrong
                since = self._since(t, n)
        last = 0 if self.rests else len(self.pieces) - 1
        j = np.clip(np.floor(since[0] / self.piece), 0, last).astype(np.intp)
        begun = np.asarray(-self.piece * j, dtype=np.float64)
        s = add(since, (begun, np.zeros_like(high)))
        # at rest the first polynomials are the solution, exactly, at all times
        if not self.rests and not np.all(
            (s[0] > -1e-7 * self.piece) & (s[0] < self.piece * (1 + 1e-7))
        ):
            raise ArithmeticError("a time outside of the table")
        q = self._rest[-1][:, j]
        for c in self._rest[-2::-1]:
            q = q * s[0] + c[:, j]
        x = q, np.zeros_like(q)
        for c_high, c_low in self._lead[::-1]:
            x = add((c_high[:, j], c_low[:, j]), multiply(x, s))
        x = self._advanced(x, n)
        late = 256 * UNIT**2 * (np.abs(high) + self.piece) + np.abs(n) * self.off_a_period[0]
        off = self.lost + self.bounds.size * ROTATED + self.bounds.speed * late
        aside = self.aside + self.beside_rate * late + np.abs(n) * self.off_a_period[1]
        return x, off, aside + 256 * UNIT**2 * np.abs(x[0][-1])

    def _since(self, t: Words, n: Array) -> Words:
        """Return times less n periods."""
        high, low = self.period or (0.0, 0.0)
        whole = two_product(n, high)
        return add(t, (-whole[0], -(whole[1] + n * low)))

    def _advanced(self, x: Words, n: Array) -> Words:
        """Return what a state has become n periods later."""
        if self.period is None or not n.any():
            return x
        high, low = (np.array(each) for each in x)
        for turn, pairs in self._turns.items():
            s, c = self._turned(turn, n)
            for i, j in pairs:
                z = _times((c, s), ((high[i], low[i]), (high[j], low[j])))
                (high[i], low[i]), (high[j], low[j]) = z
        if self.quadrature:
            grown = two_product(n, self.beside[0])
            more = grown[0], grown[1] + n * self.beside[1]
            high[-1], low[-1] = add((high[-1], low[-1]), more)
        return high, low

    def _turned(self, turn: tuple[int, int], n: Array) -> tuple[Words, Words]:
        """Return sine and cosine of n times an angle: of a few hundreds of it, and of the rest."""
        known = self._known.get(turn)
        if known is None:
            known = self._known[turn] = self._sin_cos(turn, range(self._few))
        many = np.floor(n / self._few)
        rest = (n - self._few * many).astype(np.intp)
        whole, back = np.unique(many, return_inverse=True)
        sines, cosines = self._sin_cos(turn, (self._few * whole).tolist())
        c, s = _times(
            (_taken(cosines, back), _taken(sines, back)),
            (_taken(known[1], rest), _taken(known[0], rest)),
        )
        return s, c

    def _sin_cos(self, turn: tuple[int, int], n: Sequence[float]) -> tuple[Words, Words]:
        with working(self.bits):
            found = [(int(k) * self.angles[turn]).sin_cos() for k in n]
            return tuple(_words([pair(v[k]) for v in found]) for k in (0, 1))  # type: ignore[return-value]


def _off(x: arb) -> float:
    """Return how far a ball may be from the double-double that `pair` makes of it."""
    return up(arb(x.rad()) + abs(x) * arb(2) ** -104)


def _words(pairs: Sequence[tuple[float, float]]) -> Words:
    """Return numbers of two words as two arrays."""
    high, low = np.array(pairs).T
    return high, low


def _taken(x: Words, places: NDArray[np.intp]) -> Words:
    return x[0][places], x[1][places]


def _times(a: tuple[Words, Words], b: tuple[Words, Words]) -> tuple[Words, Words]:
    """Return the product of two complex numbers, given by real and imaginary parts."""
    minus = multiply(a[1], b[1])
    real = add(multiply(a[0], b[0]), (-minus[0], -minus[1]))
    return real, add(multiply(a[0], b[1]), multiply(a[1], b[0]))


def _rate(form: Formulation, constants: Mapping[str, float], start: Sequence[float]) -> float:
    """Return the rate, a power of two, by which rates are measured against the other states.

    The smaller the symmetric part of the Jacobian, the slower errors grow; but a rate far below
    those of the motion would make much of the rounding of rates.
    """

    def size(matrix: arb_mat) -> float:
        return sum(float(x) ** 2 for row in matrix.tolist() for x in row)

    def jacobian(rate: float) -> arb_mat:
        return QuadraticSystem.of(form, constants, rate).jacobian([arb(v) for v in start])

    rates = [2.0**k for k in range(-40, 41)]
    fastest = math.sqrt(min(size(jacobian(rate)) for rate in rates))
    sane = [rate for rate in rates if rate >= fastest / 8]
    return min(sane, key=lambda rate: size(symmetric(jacobian(rate))))


def _grown(error: arb, defect: arb, m: arb, time: arb) -> arb:
    grow = (m * time).exp()
    return error * grow + (defect * (grow - 1) / m if m > 0 else defect * time)
