"""The closed form in doubles, for whole arrays of times: good to the last digits at any time.

The formulas are those of `solution`, which also supplies every constant, in balls of 40 digits or
more. What is different is how the digits are kept:

- times are reduced by n half periods, with T/2 cut into parts so short that n times a part is
  exact (Cody & Waite), and what is left is carried as a sum of two doubles, so that it has all its
  digits even close to a turning point;
- 1 ∓ u are sums of squares, and θ comes from √(1 − u) and √(1 + u);
- Φ± is a multiple of the time, a step for each turning point, and a sweep since the nearest one
  that is at most π: the large terms are added up without loss, and only the sweep is rounded. So φ
  and ψ are good to 1e-15 max(1, |x|), even where they are small beside what they are made of.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from operator import itemgetter
from typing import Any, Final, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt
from flint import arb

from heavytop.analytic.cubic import TooFewBits
from heavytop.analytic.rising import Rising
from heavytop.analytic.solution import Asymptotic, Nutating, Solution, Steady, Sweeps
from heavytop.analytic.theta_series import Argument, Sweep, ThetaSeries
from heavytop.errors import NoClosedForm, NotANumber
from heavytop.numbers.double_double import (
    Array,
    CountedAngle,
    ShortMultiples,
    double_double,
    two_product,
    two_sum,
)
from heavytop.numbers.intervals import working

__all__ = ["MOST_PERIODS", "NO_TIMES", "DoubleForm", "DoubleRecord"]

MOST_PERIODS: Final = 2**31
"""Periods up to which twice their number times a part of T/2 is exact."""

NO_TIMES: Final = "t: finite times; texts and exact numbers go with digits="
"""What is wrong with times that are no floats."""

CHUNK: Final = 8192
"""Times computed at once, so that what is computed with them stays in the processor's cache."""

_DIGITS: Final = 40  # of the constants; the bits of 2³¹ periods are among them
_FAR: Final = 16  # added to what may be 0, and must be known to so many places instead
_LATE: Final = 300  # 10³⁰⁰ s, to which a rate that is 0 or small beside its parts is known
_TINY_BITS: Final = 900  # numbers below 2⁻⁹⁰⁰ are lifted into the range of doubles
_MOST_LIFT: Final = 1000  # exponent of the largest power of two that lifts them
_EDGE: Final = 1e-30  # what a time since a turning point is not known to, beside what it comes from
_QUARTER_TURN: Final = 1.5707963267948966  # ½π


@dataclass(frozen=True, slots=True)
class DoubleRecord:
    """Where the top is and how it moves at given times.

    Parameters
    ----------
    t : array
        Times since the start [s]; every other field has the same shape, `axis` one more.
    theta, phi, psi : array
        Euler angles [rad]; φ and ψ continuous from the start, never reduced.
    phi_mod, psi_mod : array
        φ and ψ modulo 2π, in [0, 2π), to the digits they have even after 1e9 periods [rad].
    thetadot, phidot, psidot : array
        Their rates [rad/s].
    u, one_minus_u, one_plus_u, udot, uddot : array
        cos θ, 1 ∓ cos θ to their own digits, d cos θ/dt [s⁻¹] and d² cos θ/dt² [s⁻²].
    axis : array (…, 3)
        Unit vector along the symmetry axis, (sin θ sin φ, −sin θ cos φ, cos θ).
    n : array of int
        The period of the nutation, counted from the one whose u₁ is nearest the start.
    omega3, energy : array
        What is constant: the angular velocity about the symmetry axis [rad/s], and E [J], which
        `Motion.at` knows; nan where the moments are not known.
    """

    t: Array
    theta: Array
    phi: Array
    psi: Array
    phi_mod: Array
    psi_mod: Array
    thetadot: Array
    phidot: Array
    psidot: Array
    u: Array
    one_minus_u: Array
    one_plus_u: Array
    udot: Array
    uddot: Array
    axis: Array
    n: npt.NDArray[np.int64]
    omega3: Array
    energy: Array

    @property
    def quaternion(self) -> Array:
        """The attitude (…, 4), body to space, scalar first, continuous from the start."""
        phi, psi = self.phi_mod, self.psi_mod
        turns = np.rint((self.phi - phi) / (2 * np.pi)) + np.rint((self.psi - psi) / (2 * np.pi))
        sign = 1 - 2 * (turns % 2)
        cosine, sine = sign * np.sqrt(self.one_plus_u / 2), sign * np.sqrt(self.one_minus_u / 2)
        plus, minus = (phi + psi) / 2, (phi - psi) / 2
        parts = (
            cosine * np.cos(plus), sine * np.cos(minus), sine * np.sin(minus), cosine * np.sin(plus)
        )  # fmt: skip
        return np.stack(parts, axis=-1)

    @property
    def omega(self) -> Array:
        """The angular velocity (…, 3) in space [rad/s]: ω₃ along the axis, and e × ė."""
        sine = np.sqrt(self.one_minus_u * self.one_plus_u)
        across = (self.omega3 - self.phidot * self.u) * sine
        sin, cos = np.sin(self.phi_mod), np.cos(self.phi_mod)
        upright = self.omega3 * self.u + self.phidot * sine * sine
        parts = self.thetadot * cos + across * sin, self.thetadot * sin - across * cos, upright
        return np.stack(parts, axis=-1)


class Positions(NamedTuple):
    """The axis, seen with g ≥ 0, at many times.

    Parameters
    ----------
    from_top, from_bottom : array
        √(1 − u) and √(1 + u): √2 sin(θ/2) and √2 cos(θ/2).
    one_minus_u, one_plus_u, rise, uddot : array
        Their squares, −θ̇ and ü.
    phidot, spin : array
        φ̇, and ψ̇ − κ [rad/s].
    plus, minus : array
        What Φ± sweep since a turning point.
    turning, n : array
        That turning point, and the period.
    """

    from_top: Array
    from_bottom: Array
    one_minus_u: Array
    one_plus_u: Array
    rise: Array
    uddot: Array
    phidot: Array
    spin: Array
    plus: Array
    minus: Array
    turning: Array
    n: Array


class AngleGrowth(NamedTuple):
    """How Φ₊ or Φ₋ grows but for its sweep: at the start, for each turning point, and per time."""

    start: arb
    step: arb
    rate: arb


class Path(Protocol):
    """One regime of the axis, at arrays of times."""

    plus: AngleGrowth
    minus: AngleGrowth

    def tilt(self, t: Array, t_lo: Array) -> tuple[Array, Array]:
        """√(1 − u) and √(1 + u) at the times t + t_lo."""

    def place(self, t: Array, t_lo: Array) -> Positions:
        """The place at the times t + t_lo."""


class DoubleForm:
    """The closed form of one motion in doubles; call it with an array of times.

    Parameters
    ----------
    rising : Rising
        The motion, which supplies the constants in balls.

    Raises
    ------
    NoClosedForm
        When as many bits as `rising` may take do not tell apart what is known to differ.

    Notes
    -----
    Accuracy: θ and 1 ∓ cos θ are within 2e-15 of themselves, and φ and ψ within 1e-15 max(1, |x|),
    over the span of every shipped scene, by ``tests/analytic/test_scene_accuracy.py``; so are θ, φ
    and ψ as near as 1e-150 to steady, sleeping, asymptotic and passing motions, by
    ``tests/analytic/test_near_special_motions.py``. Times and start are exact, so that being
    ill-conditioned costs nothing. Rates are within 4e-15 of the largest, by
    ``tests/analytic/test_double_form.py``.

    Examples
    --------
    >>> from heavytop.classification.reduced import FromScene
    >>> from heavytop.scene.state import State
    >>> from heavytop.scene.top import Top
    >>> top = Top(A="3.28e-4", C="6.6e-5", gMR="0.0456")
    >>> form = DoubleForm(Rising(FromScene(top, State(theta="0.1", phidot=-15, psidot=140))))
    >>> form([0.0, 2.0]).phi
    array([ 0.       , 15.1169641])
    >>> form.theta([0.0, 2.0])
    array([0.1       , 0.42694371])
    """

    def __init__(self, rising: Rising) -> None:
        _, solution, bits = rising.settled(
            "the closed form", _constants, _DIGITS, size=abs, of=itemgetter(0)
        )
        self.rising, self._side = rising, solution.side
        with working(bits):
            start, path, side = solution.start, solution.path, solution.side
            self._path = here = _path(path)
            self._kappa, self._omega3 = float(start.kappa), float(start.kappa + start.b)
            offset, step, rate = (p + m for p, m in zip(here.plus, here.minus, strict=True))
            self._phi = CountedAngle(solution.phi0 - offset, step, rate)
            offset, step, rate = (
                side * (p - m) for p, m in zip(here.plus, here.minus, strict=True)
            )
            self._psi = CountedAngle(solution.psi0 - offset, step, rate + start.kappa)
            self._period = None if path.period is None else float(path.period)
            spins = bool(start.b > 0 or start.b < 0)
            self._reversal = float(start.u0 + start.drift0 / start.b) if spins else float("inf")

    def __reduce__(self) -> tuple[Any, ...]:
        return DoubleForm, (self.rising,)

    @property
    def period(self) -> float | None:
        """T [s], the period of θ; None where nothing nutates."""
        return self._period

    @property
    def frequency(self) -> float:
        """2π/T [rad/s]; 0 where nothing nutates."""
        return 0.0 if self._period is None else 2 * np.pi / self._period

    @property
    def reversal_u(self) -> float:
        """Cos θ at which φ̇ changes sign, a/b; infinite when p_ψ = 0, and reached only in loops."""
        return self._reversal

    def theta(self, t: npt.ArrayLike, t_lo: npt.ArrayLike = 0.0) -> Array:
        """θ [rad] alone at the times t + t_lo, bit for bit that of the whole record.

        Several times as fast: ``validation/14_closed_form.py`` says how many a second.

        Parameters
        ----------
        t, t_lo : array_like
            As for the whole record.

        Raises
        ------
        NotANumber
            For times that are not finite.
        NoClosedForm
            Beyond 2³¹ periods.
        """
        time, low, shape = _times(t, t_lo)
        theta = np.empty_like(time)
        for part in _chunks(time.size):
            theta[part] = self._theta(*self._path.tilt(time[part], low[part]))
        return theta.reshape(shape)

    def __call__(self, t: npt.ArrayLike, t_lo: npt.ArrayLike = 0.0) -> DoubleRecord:
        """Where the top is at the times t + t_lo.

        Parameters
        ----------
        t : array_like
            Times since the start [s].
        t_lo : array_like
            What the times have beyond the digits of a double [s]; `t` of the record is the double
            nearest the sum.

        Raises
        ------
        NotANumber
            For times that are not finite.
        NoClosedForm
            Beyond 2³¹ periods, or where an angle is too large for a double.
        """
        time, low, shape = _times(t, t_lo)
        records = [self._record(time[part], low[part]) for part in _chunks(time.size)]
        join: Any = np.concatenate if len(records) > 1 else itemgetter(0)
        whole = (
            join([getattr(record, field.name) for record in records])
            for field in fields(DoubleRecord)
        )
        return DoubleRecord(*(each.reshape((*shape, *each.shape[1:])) for each in whole))

    def _theta(self, from_top: Array, from_bottom: Array) -> Array:
        if self._side < 0:
            from_top, from_bottom = from_bottom, from_top
        return 2 * np.arctan2(from_top, from_bottom)

    def _record(self, t: Array, t_lo: Array) -> DoubleRecord:
        place, side = self._path.place(t, t_lo), self._side
        sine, turning = place.from_top * place.from_bottom, place.turning
        above, below = place.one_minus_u, place.one_plus_u
        if side < 0:
            above, below = below, above
        u = np.where(above < below, 1 - above, below - 1)
        along, over = place.plus + place.minus, side * (place.plus - place.minus)
        with np.errstate(over="ignore", invalid="ignore"):
            phi = self._phi.whole(turning, t, t_lo, along)
            psi = self._psi.whole(turning, t, t_lo, over)
        if not (np.isfinite(phi).all() and np.isfinite(psi).all()):
            raise NoClosedForm("an angle too large for doubles: ask for digits instead")
        phi_mod = self._phi.modulo(turning, t, t_lo, along)
        axis = np.stack((sine * np.sin(phi_mod), -sine * np.cos(phi_mod), u), axis=-1)
        return DoubleRecord(
            t, self._theta(place.from_top, place.from_bottom), phi, psi,
            phi_mod, self._psi.modulo(turning, t, t_lo, over),
            -side * place.rise, place.phidot, self._kappa + side * place.spin, u, above, below,
            side * place.rise * sine, side * place.uddot, axis, place.n.astype(np.int64),
            np.full_like(t, self._omega3), np.full_like(t, np.nan),
        )  # fmt: skip


def _times(t: npt.ArrayLike, t_lo: npt.ArrayLike) -> tuple[Array, Array, tuple[int, ...]]:
    """Finite times in one row, each the double nearest t + t_lo and the rest; their shape."""
    try:
        time, low = np.broadcast_arrays(np.asarray(t, np.float64), np.asarray(t_lo, np.float64))
    except (TypeError, ValueError, OverflowError):  # of no float; shapes that do not fit
        raise NotANumber(NO_TIMES) from None
    if not (np.isfinite(time).all() and np.isfinite(low).all()):
        raise NotANumber("t: finite times")
    return *two_sum(time.ravel(), low.ravel()), time.shape


def _chunks(size: int) -> list[slice]:
    """The parts of a row that are computed at once; one at least."""
    return [slice(k, k + CHUNK) for k in range(0, max(size, 1), CHUNK)]


def _constants(solution: Solution, bits: int) -> tuple[tuple[arb, ...], Solution, int]:
    """The balls that must be known relative to themselves, and where they are from."""
    path = solution.path
    if isinstance(path, Nutating):
        return _nutating_constants(path), solution, bits
    plus, minus = path.mean_rates
    # without periods no time is too late: what turns by nothing must not turn late
    turning = plus + minus, solution.start.kappa + solution.side * (plus - minus)
    rates = tuple(1 + abs(rate) * arb(10) ** _LATE for rate in turning)
    if isinstance(path, Asymptotic):
        found = path.w, path.one_minus_u1, path.one_plus_u1, path.x0, path.swept(path.x0) + _FAR
        return (*found, *rates), solution, bits
    return (path.over.one_minus_u0, path.over.one_plus_u0, *rates), solution, bits


def _path(path: Nutating | Asymptotic | Steady) -> Path:
    if isinstance(path, Nutating):
        return _NutatingTimes(path)
    return _AsymptoticTimes(path) if isinstance(path, Asymptotic) else _SteadyTimes(path)


# --- an axis between two turning points --------------------------------------------------------


def _since(path: Nutating) -> tuple[int, arb]:
    """The turning point nearest the start, and the time since it [s].

    That of u₁ is 0; −1 and 1 are those of u₂ before and after it.
    """
    if not path.phase.is_finite():
        raise TooFewBits("the start and a turning point", path.phase)
    turning = round(2 * float(path.phase))
    return turning, (path.phase - arb(turning) / 2) * path.period


def _drifts(path: Nutating) -> tuple[arb, arb]:
    """Of a − b u the values at u₁ and at u₂ [s⁻¹]."""
    over, roots = path.over, path.roots
    return over.drift0 + over.b * roots.down, over.drift0 - over.b * roots.up


def _nutating_constants(path: Nutating) -> tuple[arb, ...]:
    roots, over, regime = path.roots, path.over, path.regime
    beside = [half.beta for half in path.halves if isinstance(half, Sweeps)]
    momenta = [over.P_plus] * regime.misses_bottom + [over.P_minus] * regime.misses_top
    return (
        path.period, roots.w, roots.delta, roots.m, roots.mc, roots.one_minus_u1,
        roots.one_plus_u1, roots.one_minus_u2, roots.one_plus_u2, _since(path)[1], *path.turns,
        *beside, *momenta, *(angle + _FAR for angle in path.at_start),
        sum(map(abs, _drifts(path)), arb(0)),
    )  # fmt: skip


class _Lifted:
    """A number that may be too small for a double, times the square of a power of two."""

    def __init__(self, x: arb) -> None:
        man, exp = map(int, x.mid().man_exp())
        size = man.bit_length() + exp if man else 0
        self._lift = 2.0 ** min(max((-_TINY_BITS - size) // 2, 0), _MOST_LIFT)
        self.value = float(x * self._lift * self._lift)

    def over_square(self, y: Array) -> Array:
        """x/y²."""
        y = y * self._lift
        return self.value / y / y if self.value else np.zeros_like(y)

    def times_square(self, y: Array) -> Array:
        """The product x y², where y² alone may be too small or too large for a double."""
        y = y / self._lift
        return self.value * y * y


class _PoleDistance:
    """√(1 ∓ u) = scale √(least² + swing² x²), with x = cn for the top and sn for the bottom."""

    def __init__(self, most: arb, least: arb, delta: arb, P: arb, misses: bool) -> None:
        self.square, self.scale = float(least), float(most.sqrt())
        self.least, self.swing = float((least / most).sqrt()), float((delta / most).sqrt())
        self._rate = _Lifted(P / (2 * most) if misses else arb(0))  # ½ P∓ over the largest 1 ∓ u
        self.sign = np.sign(self._rate.value)
        self.passed = bool(least.is_zero())

    def share(self, x: Array) -> Array:
        """√(1 ∓ u)/scale."""
        return np.hypot(self.least, self.swing * x) if self.least else abs(self.swing * x)

    def winding(self, share: Array) -> Array:
        """½ P∓/(1 ∓ u) [rad/s]; nothing where P∓ = 0, even on the pole."""
        return self._rate.over_square(share)


class _Half:
    """Φ₊ or Φ₋: its sweeps since a turning point, and how it grows apart from them."""

    def __init__(self, path: Nutating, series: ThetaSeries, half: Any, turn: arb, own: arb) -> None:
        x = path.phase - own  # periods since a turning point beside its pole
        self.sweeps: tuple[Sweep, Sweep] | None = None
        if isinstance(half, Sweeps):
            beside, other, quarter = series.sweeps(half.beta)
            self.jumps, self.sign, self.sweeps = False, half.sign, (beside, other)
            step = half.sign * quarter
            swept = half.swept(x) - (half.sign * arb.pi() - 2 * step) * x
        else:
            self.jumps, step, swept = not turn.is_zero(), turn / 2, half(path.phase)
        self.growth = AngleGrowth(swept + 2 * own * step, step, (turn - 2 * step) / path.period)

    def since(self, beside: bool, at: Argument, after: Array) -> Array:
        """What it has swept since a turning point, which is beside its pole or not."""
        if self.sweeps is None:
            return after * _QUARTER_TURN if self.jumps and beside else np.zeros_like(after)
        swept = self.sweeps[not beside](at)
        return swept if self.sign > 0 else -swept


class _NutatingTimes:
    """An axis between two turning points, at arrays of times."""

    def __init__(self, path: Nutating) -> None:
        over, roots, regime = path.over, path.roots, path.regime
        self._series = series = ThetaSeries(path.tau)
        self._scale = double_double(series.scale / path.period)
        turning, since = _since(path)
        self._first, self._since = turning, double_double(since)
        self._half_period, self._multiples = (
            float(path.period / 2), ShortMultiples.of(path.period / 2)
        )  # fmt: skip
        halves = zip(path.halves, path.turns, (arb(0), arb(1) / 2), strict=True)
        self._plus, self._minus = (_Half(path, series, *each) for each in halves)
        self.plus, self.minus = self._plus.growth, self._minus.growth
        self._w, self._m, self._delta = float(roots.w), float(roots.m), float(roots.delta)
        most = roots.one_minus_u1, roots.one_plus_u2
        self._top = _PoleDistance(
            most[0], roots.one_minus_u2, roots.delta, over.P_minus, regime.misses_top
        )
        self._bottom = _PoleDistance(
            most[1], roots.one_plus_u1, roots.delta, over.P_plus, regime.misses_bottom
        )
        self._drifts = [_Lifted(drift / (most[0] * most[1])) for drift in _drifts(path)]

    def tilt(self, t: Array, t_lo: Array) -> tuple[Array, Array]:
        """√(1 − u) and √(1 + u) at the times t + t_lo."""
        turning, tau, lo = self._nearest(t, t_lo)
        from_top, from_bottom = np.empty_like(t), np.empty_like(t)
        for upper, here in _sides(turning):
            s, c, _ = self._series.sn_cn(self._argument(tau[here], lo[here]), upper)
            from_top[here] = self._top.scale * self._top.share(c)
            from_bottom[here] = self._bottom.scale * self._bottom.share(s)
        return from_top, from_bottom

    def place(self, t: Array, t_lo: Array) -> Positions:
        """The place at the times t + t_lo."""
        turning, tau, lo = self._nearest(t, t_lo)
        # a turning point counts as passed at it: at a pass through a pole what follows has begun
        known = tau >= -_EDGE * (abs(t) + abs(self._since[0]))
        after, columns = np.where(known, 1.0, -1.0), [np.empty_like(t) for _ in range(10)]
        for upper, here in _sides(turning):
            at = self._argument(tau[here], lo[here])
            for column, values in zip(columns, self._beside(upper, at, after[here]), strict=True):
                column[here] = values
        opened = (turning % 2 == 1) & known
        return Positions._make((*columns, turning, np.floor(turning / 2) + opened))

    def _nearest(self, t: Array, t_lo: Array) -> tuple[Array, Array, Array]:
        """The turning point nearest each time, by its number, and the time since it [s].

        The even ones are passages of u₁, the odd ones of u₂.
        """
        with np.errstate(over="ignore"):
            steps = np.rint((t + self._since[0]) / self._half_period)
        if np.any(abs(steps) >= 2 * MOST_PERIODS):
            raise NoClosedForm(
                f"more than {MOST_PERIODS} periods in doubles: ask for digits instead"
            )
        return steps + self._first, *self._multiples.rest(t, t_lo, steps, self._since)

    def _argument(self, tau: Array, lo: Array) -> Argument:
        return Argument.of(tau, lo, self._scale, self._series.hyperbolic)

    def _beside(self, upper: bool, at: Argument, after: Array) -> tuple[Array, ...]:
        """√(1 ∓ u), 1 ∓ u, −θ̇, ü, φ̇, ψ̇ − κ and Φ± beside one kind of turning point."""
        s, c, under = self._series.sn_cn(at, upper)
        d = self._series.dn(at, upper, under)
        top, bottom = self._top, self._bottom
        above, below = top.share(c), bottom.share(s)
        c2, s2, d2 = c * c, s * s, d * d
        # c/√(1 − u) and s/√(1 + u) stay finite at an exact pass through a pole
        across = -after if upper and top.passed else top.swing * c / above
        along = after if not upper and bottom.passed else bottom.swing * s / below
        with np.errstate(over="ignore"):
            uddot = 2 * self._w * (self._delta * self._w * (d2 * (c2 - s2) - self._m * s2 * c2))
        return (
            top.scale * above, bottom.scale * below,
            top.square + self._delta * c2, bottom.square + self._delta * s2,
            2 * self._w * d * across * along, uddot, *self._rates(above, below, s, c),
            self._plus.since(not upper, at, after), self._minus.since(upper, at, after),
        )  # fmt: skip

    def _rates(self, above: Array, below: Array, s: Array, c: Array) -> tuple[Array, Array]:
        """φ̇ and ψ̇ − κ; where P₊ and P₋ are of two signs φ̇ from a − b u, which does not cancel."""
        plus, minus = self._bottom.winding(below), self._top.winding(above)
        if not self._top.sign * self._bottom.sign < 0:
            return plus + minus, plus - minus
        both, (low, high) = above * below, self._drifts
        return low.times_square(c / both) + high.times_square(s / both), plus - minus


def _sides(turning: Array) -> Iterator[tuple[bool, Any]]:
    """The times nearest to turning points of one kind, as an index: first those nearest to u₁."""
    upper = turning % 2 == 1
    if not upper.any():
        yield False, slice(None)
    elif upper.all():
        yield True, slice(None)
    else:
        yield False, ~upper
        yield True, upper


# --- an axis that tends to the top, and one of constant tilt -----------------------------------


class _AsymptoticTimes:
    """An axis that tends to the top, at arrays of times."""

    def __init__(self, path: Asymptotic) -> None:
        size, floor = path.one_minus_u1.sqrt(), path.one_plus_u1.sqrt()
        self._planar, self._P_plus = path.planar, float(path.over.P_plus)
        self._sign = -1.0 if path.over.P_plus < 0 else 1.0
        self._size, self._floor = float(size), float(floor)
        self._depth, self._height = float(path.one_minus_u1), float(path.one_plus_u1)
        self._w, self._x0 = double_double(path.w), double_double(path.x0)
        zero, rate = arb(0), path.mean_rates[0]
        swept = path.swept(path.x0)
        self.plus, self.minus = AngleGrowth(swept, zero, rate), AngleGrowth(zero, zero, zero)

    def tilt(self, t: Array, t_lo: Array) -> tuple[Array, Array]:
        """√(1 − u) and √(1 + u) at the times t + t_lo."""
        _, c, s = self._argument(t, t_lo)
        return self._size * c, np.hypot(self._floor, self._size * s)

    def place(self, t: Array, t_lo: Array) -> Positions:
        """The place at the times t + t_lo."""
        (x, c, s), zero = self._argument(t, t_lo), np.zeros_like(t)
        from_top, from_bottom = self._size * c, np.hypot(self._floor, self._size * s)
        above, below = self._depth * (c * c), self._height + self._depth * (s * s)
        step = np.where(x >= 0, 1.0, -1.0)
        rise = 2 * self._w[0] * c * (step if self._planar else self._size * s / from_bottom)
        with np.errstate(over="ignore"):
            uddot = 2 * self._w[0] * (self._w[0] * above * (c * c - 2 * s * s))
        rate = zero if self._planar else self._P_plus / (2 * below)
        plus = step * _QUARTER_TURN
        if not self._planar:  # the pole is passed once: P₊ √(1 − u₁)/4w√(1 + u₁) = ±1
            plus = self._sign * np.arctan2(self._size * s, self._floor)
        return Positions(
            from_top, from_bottom, above, below, rise, uddot, rate, rate, plus, zero, zero, zero
        )

    def _argument(self, t: Array, t_lo: Array) -> tuple[Array, Array, Array]:
        """X = w t + x₀, sech x and tanh x, without the overflow of cosh."""
        x, rest = two_product(t, self._w[0])
        x, error = two_sum(x, self._x0[0])
        x, lo = two_sum(x, rest + (error + self._x0[1] + self._w[1] * t + self._w[0] * t_lo))
        decay = np.exp(-np.abs(x)) * (1 - np.copysign(1.0, x) * lo)
        return x, 2 * decay / (1 + decay * decay), np.tanh(x)


class _SteadyTimes:
    """An axis of constant tilt, at arrays of times: what turns, turns at constant rates."""

    def __init__(self, path: Steady) -> None:
        (plus, minus), zero = path.mean_rates, arb(0)
        self.plus, self.minus = AngleGrowth(zero, zero, plus), AngleGrowth(zero, zero, minus)
        self._rates = float(plus + minus), float(plus - minus)
        self._squares = float(path.over.one_minus_u0), float(path.over.one_plus_u0)
        self._roots = tuple(float(root) for root in path.turnings[0])

    def tilt(self, t: Array, t_lo: Array) -> tuple[Array, Array]:
        """√(1 − u) and √(1 + u), the same at all times t."""
        from_top, from_bottom = self._roots
        return np.full_like(t, from_top), np.full_like(t, from_bottom)

    def place(self, t: Array, t_lo: Array) -> Positions:
        """The place at the times t."""
        zero = np.zeros_like(t)
        (above, below), (phidot, spin) = self._squares, self._rates
        return Positions(
            *self.tilt(t, t_lo), zero + above, zero + below, zero, zero,
            zero + phidot, zero + spin, zero, zero, zero, zero,
        )  # fmt: skip
