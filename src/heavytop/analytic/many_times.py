"""The closed form in doubles, for whole arrays of times: good to the last digits at any time.

The formulas are those of `solution`, which also supplies every constant, in balls of 40 digits or
more. What is different is how the digits are kept:

- the argument z of the theta functions is counted from the nearest turning point. It is a multiple
  of the time less one of the turning points passed, summed to twice the digits of a double, so that
  it has all its digits even close to a turning point;
- √(1 ∓ u) is √(least² + swing² x²) with x = cn or sn, in which nothing cancels;
- Φ± is a multiple of the time, a step for each turning point, and a sweep since the nearest one
  that is at most π: the large terms are added up without loss, and only the sweep is rounded. So φ
  and ψ are good to 1e-15 max(1, |x|), even where they are small beside what they are made of.

The same formulas hold for an axis that tends to the top, which nutates with m = 1 and has one
turning point, and for one of constant tilt, which has u₁ = u₂.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
from flint import arb

from heavytop.analytic.closed_form import ClosedForm
from heavytop.analytic.cubic import TooFewBits
from heavytop.analytic.rising import FLOAT_DIGITS, Rising
from heavytop.analytic.solution import (
    Asymptotic,
    ExactRecord,
    Nutating,
    Solution,
    SteadyPath,
    Sweeps,
)
from heavytop.analytic.theta_series import Argument, Sweep, ThetaSeries
from heavytop.errors import NoClosedForm, NotANumber
from heavytop.exact.pairs import Array, Linear, modulo_circle, two_sum

__all__ = ["MOST_PERIODS", "NO_TIMES", "DoubleForm", "DoubleRecord"]

MOST_PERIODS: Final = 2**31
"""Periods up to which times are reduced without loss; beyond, each is computed in balls."""

FARTHEST: Final = 2**62
"""Periods that are counted."""

NO_TIMES: Final = "t: finite times; texts and exact numbers go with digits="
"""What is wrong with times that are no floats."""

CHUNK: Final = 8192
"""Times computed at once, so that what is computed with them stays in the processor's cache."""

_DIGITS: Final = 40  # of the constants; those of 2³¹ periods are among them
_SLOWEST: Final = 1e-300  # rad/s: beside this rates are known where no time is too late
_SMALL: Final = 1e-280  # squares beside which one that is no double any more does not count
_EDGE: Final = 1e-30  # what z is not known to at a turning point, beside what it comes from


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


_NAMES: Final = tuple(field.name for field in fields(DoubleRecord))
_EXACT: Final = {field.name for field in fields(ExactRecord)}
_TURNING: Final = ("phi", "psi")


class DoubleForm:
    """The closed form of one motion in doubles; call it with an array of times.

    Parameters
    ----------
    rising : Rising
        The motion, which supplies the constants in balls.

    Attributes
    ----------
    period : float or None
        T [s], the period of θ; None where nothing nutates.
    frequency : float
        2π/T [rad/s]; 0 where nothing nutates.
    reversal_u : float
        Cos θ at which φ̇ changes sign, a/b; infinite when p_ψ = 0, and reached only in loops.

    Raises
    ------
    NoClosedForm
        When as many bits as `rising` may take do not tell apart what is known to differ.

    Notes
    -----
    Accuracy: θ and 1 ∓ cos θ are within 2e-15 of themselves, and φ and ψ within 1e-15 max(1, |x|),
    over the span of every shipped scene, and rates within 4e-15 of the largest, by
    ``tests/analytic/test_many_times.py``; so are θ, φ and ψ as near as 1e-150 to steady, sleeping,
    asymptotic and passing motions, by ``tests/analytic/test_solution.py``. Times and start are
    exact, so that being ill-conditioned costs nothing.

    Examples
    --------
    >>> from heavytop.classification.reduced import reduced_from_scene
    >>> from heavytop.scene.state import State
    >>> from heavytop.scene.top import Top
    >>> top = Top(A="3.28e-4", C="6.6e-5", gMR="0.0456")
    >>> start = State(theta="0.1", phidot=-15, psidot=140)
    >>> form = DoubleForm(Rising(reduced_from_scene(top, start)))
    >>> form([0.0, 2.0]).phi
    array([ 0.       , 15.1169641])
    >>> form.theta([0.0, 2.0])
    array([0.1       , 0.42694371])
    """

    def __init__(self, rising: Rising) -> None:
        self.rising = rising
        rising.settled("the closed form", self._prepare, FLOAT_DIGITS)

    def _prepare(self, solution: Solution, _: int) -> tuple[arb, ...]:
        """Take the constants from balls; raises `TooFewBits` where one is not known well enough."""
        start, path, regime, side = solution.start, solution.path, solution.regime, solution.side
        T, over, slowest = path.period, path.over, arb(_SLOWEST)
        w, m, mc, delta, lowest, highest = _shape(path)
        means = path.mean_rates
        self._w, self._m, self._delta = (float(_known(each)) for each in (w, m, delta))
        self._series = series = ThetaSeries(m, _known(mc))
        self._first, since = _since_turning(path, series.half)
        rate = w * series.scale
        self._argument = Linear(since, -series.half, rate)
        self._since, self._rate, self._side = float(since), float(rate), side
        self.period, self.frequency, self._steps, self._phase = None, 0.0, 0.0, 0.0
        if T is not None:
            slowest, self.period, self.frequency = 1 / T, float(T), float(2 * arb.pi() / T)
            self._steps, self._phase = float(2 / T), float(since / series.half)
        plus, minus = _halves(path, series)
        self._sweeps = list(zip(plus.sweeps, minus.sweeps, strict=True))
        self._phi, self._psi = (
            Linear(
                _known(angle + one * plus.start + other * minus.start, 1),
                one * plus.step + other * minus.step,
                _known(rate + one * plus.rate + other * minus.rate, slowest),
            )
            for angle, rate, one, other in (
                (solution.phi0, arb(0), 1, 1), (solution.psi0, start.kappa, side, -side),
            )
        )  # fmt: skip
        P_plus = over.P_plus if regime.misses_bottom else arb(0)
        P_minus = over.P_minus if regime.misses_top else arb(0)
        self._bottom = _Pole.of(lowest[1], delta, P_plus, means[0])
        self._top = _Pole.of(highest[0], delta, P_minus, means[1])
        self._across = _across(P_plus, P_minus, lowest, highest)
        self._kappa, self._omega3 = float(start.kappa), float(start.kappa + start.b)
        spins = bool(start.b > 0 or start.b < 0)
        self.reversal_u = float(start.u0 + start.drift0 / start.b) if spins else np.inf
        return ()

    def __reduce__(self) -> tuple[Any, ...]:
        return DoubleForm, (self.rising,)

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
            Beyond 2⁶² periods.
        """
        theta: Array = self._columns(t, t_lo, record=False)["theta"]
        return theta

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
            Beyond 2⁶² periods, or where an angle is too large for a double.

        Notes
        -----
        Beyond 2³¹ periods times are computed one by one, in balls of as many digits as it takes.
        """
        return DoubleRecord(**self._columns(t, t_lo, record=True))

    def _columns(
        self, t: npt.ArrayLike, t_lo: npt.ArrayLike, record: bool
    ) -> dict[str, npt.NDArray[Any]]:
        """The fields of a record, or θ alone."""
        time, low, shape = _times(t, t_lo)
        names = _NAMES if record else ("theta",)
        if self.period and abs(time).max(initial=0.0) >= MOST_PERIODS * self.period:
            late = self._late(time, low)
            return {name: late[name].reshape(shape + late[name].shape[1:]) for name in names}
        columns: dict[str, npt.NDArray[Any]] = {name: np.empty(time.shape) for name in names}
        if record:
            columns |= {"axis": np.empty((time.size, 3)), "n": np.empty(time.shape, np.int64)}
        with np.errstate(over="ignore", invalid="ignore"):
            for begin in range(0, time.size, CHUNK):
                # of one time all are scalars, which is several times as fast
                part: Any = slice(begin, begin + CHUNK) if time.size > 1 else 0
                for name, values in self._values(time[part], low[part], record).items():
                    columns[name][part] = values
        return {name: each.reshape(shape + each.shape[1:]) for name, each in columns.items()}

    def _late(self, time: Array, low: Array) -> dict[str, npt.NDArray[Any]]:
        """The fields at times too late to be reduced in doubles."""
        late = float(abs(time).max())
        if late > FARTHEST * float(self.period or 0.0):
            raise NoClosedForm(f"more than {FARTHEST} periods in doubles: ask for digits instead")
        form = ClosedForm(
            self.rising, _DIGITS + math.ceil(math.log10(min(late * self.rising.rate, 1e300)))
        )
        ctx, each = form.ctx, zip(time.tolist(), low.tolist(), strict=True)
        seen = [form(ctx.mpf(t) + ctx.mpf(rest)) for t, rest in each]
        columns = {name: [getattr(x, name) for x in seen] for name in _NAMES if name in _EXACT}
        columns |= {f"{x}_mod": [angle % (2 * ctx.pi) for angle in columns[x]] for x in _TURNING}
        kinds = {"n": np.int64}
        return {name: np.array(x, kinds.get(name, np.float64)) for name, x in columns.items()}

    def _values(self, t: Array, t_lo: Array, record: bool) -> dict[str, Any]:
        """The fields, or θ alone; what is the same at all times may be one number."""
        turning, z, s, c, *others = self._elliptic(t, t_lo, record)
        top, bottom, side = self._top, self._bottom, self._side
        from_top, from_bottom = top.distance(c), bottom.distance(s)
        high, low = (from_top, from_bottom)[::side]  # seen with the sign of gMR
        theta = 2 * np.arctan2(high, low)
        if not record:
            return {"theta": theta}
        d, plus, minus = others
        sine, one_minus_u, one_plus_u = from_top * from_bottom, high * high, low * low
        u = np.where(one_minus_u < one_plus_u, 1 - one_minus_u, one_plus_u - 1)
        rise = 2 * self._w * d * top.slope(c, from_top) * bottom.slope(s, from_bottom)
        pull = d * d * (c * c - s * s) - self._m * (s * s * c * c)
        uddot = 2 * self._w * (self._delta * self._w * pull)
        phi = self._phi(turning, t, t_lo, plus + minus)
        psi = self._psi(turning, t, t_lo, side * (plus - minus))
        if not (np.isfinite(phi[0]).all() and np.isfinite(psi[0]).all()):
            raise NoClosedForm("an angle too large for doubles: ask for digits instead")
        phi_mod, axis = modulo_circle(*phi), np.empty((t.size, 3))
        axis[:, 0], axis[:, 1], axis[:, 2] = sine * np.sin(phi_mod), -sine * np.cos(phi_mod), u
        forward, backward = bottom.rate(from_bottom), top.rate(from_top)
        phidot = forward + backward
        if self._across:
            terms = zip(self._across, (c, s), strict=True)
            phidot = sum(v * (sine0 * x / sine) * x for (v, sine0), x in terms) / sine
        period = np.floor(turning / 2)
        return {
            "t": t, "theta": theta, "phi": phi[0], "psi": psi[0],
            "phi_mod": phi_mod, "psi_mod": modulo_circle(*psi),
            "thetadot": -side * rise, "phidot": phidot,
            "psidot": self._kappa + side * (forward - backward),
            "u": u, "one_minus_u": one_minus_u, "one_plus_u": one_plus_u,
            "udot": side * rise * sine, "uddot": side * uddot, "axis": axis,
            "n": period + ((turning > 2 * period) & (z >= 0)),
            "omega3": self._omega3, "energy": np.nan,
        }  # fmt: skip

    def _elliptic(self, t: Array, t_lo: Array, record: bool) -> list[Array]:
        """The nearest turning point, z since it, sn and cn; for a record, dn and the sweeps of Φ±.

        Even turning points are passages of u₁, odd ones of u₂.
        """
        if not self._w:  # nothing moves
            zero: Any = np.float64(0)
            one = np.float64(1)
            return [zero, zero, zero, one, one, zero, zero]
        turning, z, low = self._reduced(t, t_lo)
        upper = turning > 2 * np.floor(turning / 2)
        if upper.all() or not upper.any():
            return [turning, z, *self._beside(bool(upper.any()), z, low, record)]
        columns = [np.empty_like(z) for _ in range(5 if record else 2)]
        for side in (False, True):
            here = upper == side
            parts = self._beside(side, z[here], low[here], record)
            for column, part in zip(columns, parts, strict=True):
                column[here] = part
        return [turning, z, *columns]

    def _beside(self, upper: bool, z: Array, low: Array, record: bool) -> list[Array]:
        """What `_elliptic` returns of times that are nearest to u₁, or to u₂."""
        at = self._series.argument(z, low)
        values = self._series.functions(at, upper, 3 if record else 2)
        return [*values, *(sweep(at) for sweep in self._sweeps[upper] if record)]

    def _reduced(self, t: Array, t_lo: Array) -> tuple[Array, Array, Array]:
        """The turning point nearest each time, by its number, and z since it."""
        steps: Any = np.rint(t * self._steps + self._phase) if self._steps else np.float64(0)
        z, low = self._argument(steps, t, t_lo)
        # a turning point counts as passed at it: at an exact pass what follows has begun
        at_it = abs(z) <= _EDGE * (abs(self._rate * t) + abs(self._since))
        return steps + self._first, np.where(at_it, 0.0, z), np.where(at_it, 0.0, low)


def _times(t: npt.ArrayLike, t_lo: npt.ArrayLike) -> tuple[Array, Array, tuple[int, ...]]:
    """Finite times in one row, each the double nearest t + t_lo and the rest; their shape."""
    try:
        time, low = np.asarray(t, np.float64), np.asarray(t_lo, np.float64)
        if not (np.isfinite(time).all() and np.isfinite(low).all()):
            raise NotANumber("t: finite times")
        time, low = map(np.asarray, two_sum(time, low))
    except (TypeError, ValueError, OverflowError):  # of no float; shapes that do not fit
        raise NotANumber(NO_TIMES) from None
    return time.ravel(), low.ravel(), time.shape


# --- constants, from balls -----------------------------------------------------------------------


def _known(x: arb, beside: arb | float = 0) -> arb:
    """A ball that is known to 40 digits, beside what it is added to."""
    if not x.rad() <= (abs(x) + beside) * 10.0**-_DIGITS:
        raise TooFewBits("a constant of the closed form and 0", x)
    return x


def _shape(path: Nutating | Asymptotic | SteadyPath) -> tuple[Any, ...]:
    """Of u = u₁ + δ sn² (w t + x₀): w, m, 1 − m and δ, and 1 ∓ u at u₁ and at u₂."""
    zero, one = arb(0), arb(1)
    if isinstance(path, Nutating):
        r = path.roots
        ends = (r.one_minus_u1, r.one_plus_u1), (r.one_minus_u2, r.one_plus_u2)
        return r.w, r.m, r.mc, r.delta, *ends
    if isinstance(path, Asymptotic):
        lowest = path.one_minus_u1, path.one_plus_u1
        return path.w, one, zero, path.one_minus_u1, lowest, (zero, arb(2))
    here = path.over.one_minus_u0, path.over.one_plus_u0
    return zero, zero, one, zero, here, here


def _since_turning(path: Nutating | Asymptotic | SteadyPath, half: arb) -> tuple[int, arb]:
    """The turning point nearest the start, and z since it.

    That of u₁ is 0; −1 and 1 are those of u₂ before and after it.
    """
    if isinstance(path, Nutating):
        if not path.phase.is_finite():
            raise TooFewBits("the start and a turning point", path.phase)
        turning = round(2 * float(path.phase))
        return turning, _known((2 * path.phase - turning) * half)
    return 0, _known(path.x0) if isinstance(path, Asymptotic) else arb(0)


def _across(P_plus: arb, P_minus: arb, *ends: tuple[arb, arb]) -> list[tuple[float, float]]:
    """φ̇ sin θ and sin θ at u₁ and at u₂, where P₊ and P₋ are of two signs."""
    if not P_plus * P_minus < 0:
        return []
    sines = [(above * below).sqrt() for above, below in ends]
    speeds = [
        (P_plus * above + P_minus * below) / (2 * sine)
        for (above, below), sine in zip(ends, sines, strict=True)
    ]
    size = sum(map(abs, speeds), arb(_SLOWEST))
    return [(float(_known(v, size)), float(sine)) for v, sine in zip(speeds, sines, strict=True)]


class _Pole(NamedTuple):
    """√(1 ∓ u) = √(least² + swing² x²), with x = cn for the top and sn for the bottom."""

    square: float  # least²
    least: float
    swing: float
    turning: float  # ½ P∓/least
    rate0: float  # ½ P∓/(1 ∓ u) where P∓ = 0: not 0 on the pole itself alone

    @classmethod
    def of(cls, least: arb, delta: arb, P: arb, mean: arb) -> _Pole:
        """The constants, from least², swing², P∓ and the mean of the rate."""
        root, swing = _known(least).sqrt(), delta.sqrt()
        rates = (P, _known(mean, _SLOWEST)) if P.is_zero() else (_known(P / (2 * root)), arb(0))
        return cls(*map(float, (least, root, swing, *rates)))

    def distance(self, x: Array) -> Array:
        """√(1 ∓ u)."""
        leg = self.swing * x
        if self.square > _SMALL:
            return np.sqrt(self.square + leg * leg)
        return np.hypot(self.least, leg) if self.least else abs(leg)

    def slope(self, x: Array, distance: Array) -> Array:
        """The quotient swing x/√(1 ∓ u), which stays finite at an exact pass through the pole."""
        return np.where(distance > 0, self.swing * x / distance, np.copysign(1.0, x))

    def rate(self, distance: Array) -> Array | float:
        """½ P∓/(1 ∓ u) [rad/s]."""
        if not self.turning:
            return self.rate0
        return self.turning * (self.least / distance) / distance


class _Half(NamedTuple):
    """Φ₊ or Φ₋: its sweeps about u₁ and about u₂, and how it grows apart from them."""

    sweeps: tuple[Sweep, ...]
    start: arb
    step: arb
    rate: arb


def _nothing(at: Argument) -> Array:
    return np.zeros_like(at.S)


def _jump(at: Argument) -> Array:
    """The sweep at an exact pass through the pole."""
    return np.copysign(np.pi / 2, at.S)


def _halves(path: Nutating | Asymptotic | SteadyPath, series: ThetaSeries) -> Iterator[_Half]:
    """Φ₊ and Φ₋."""
    sweeps: tuple[Sweep, ...]
    for own, rate in enumerate(path.mean_rates):  # Φ₊ sweeps at u₁, 0, and Φ₋ at u₂, 1
        sweeps, start, step = (_nothing, _nothing), arb(0), arb(0)
        if isinstance(path, Asymptotic) and not own:
            start, sweeps = -path.swept(path.x0), (_jump, _nothing)
            if not path.planar:
                v = (path.one_plus_u1 / path.one_minus_u1).sqrt().atan()
                sweeps, _ = series.sweeps(v, -1 if path.over.P_plus < 0 else 1)
        elif isinstance(path, Nutating) and not path.turns[own].is_zero():
            half, turn = path.halves[own], path.turns[own]
            sweeps, step = (_jump, _nothing), turn / 2
            if isinstance(half, Sweeps):
                sweeps, step = series.sweeps(2 * path.K * _known(half.beta), half.sign)
            drift = turn - 2 * step
            start = drift * path.phase - turn * own / 2 - path.at_start[own]
            rate = drift / path.period
        yield _Half(sweeps[:: 1 - 2 * own], start, step, rate)
