"""The closed form in doubles, for whole arrays of times: good to the last digits at any time.

The formulas are those of `closed_form`, which also supplies every constant, at fifty digits or
more. What is different is how the digits are kept:

- times are reduced by n half periods, with T/2 cut into parts so short that n times a part is
  exact (Cody & Waite), and what is left is carried as a sum of two doubles, so that it has all its
  digits even close to a turning point;
- θ comes from √(1 − u) and √(1 + u), each a hypotenuse;
- φ and ψ are counted in turns when they are wanted modulo 2π, and where they are small beside the
  angles they are made of those are computed with twice the digits.
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import numpy.typing as npt

from heavytop.analytic.many_times import DoubleRecord
from heavytop.analytic.theory.asymptotic_double import AsymptoticDouble
from heavytop.analytic.theory.course import NOTHING, Proved
from heavytop.analytic.theory.double_place import DoubleCourse, DoublePlace
from heavytop.analytic.theory.half_periods import MOST_PERIODS
from heavytop.analytic.theory.nodding import Nodding
from heavytop.analytic.theory.nodding_double import NoddingDouble
from heavytop.analytic.theory.orbit import Orbit, orbit
from heavytop.analytic.theory.reduced import Reduced
from heavytop.analytic.theory.steady_course import Steady
from heavytop.analytic.theory.steady_double import SteadyDouble
from heavytop.errors import NotANumber
from heavytop.numbers.angle import Angle
from heavytop.numbers.pairs import Array, two_sum

__all__ = ["MOST_PERIODS", "DoubleForm", "DoubleRecord"]

DIGITS = 50
"""Digits of the form that supplies the constants: what it tells from zero, so does this one."""

CHUNK = 8192
"""Times computed at once, so that what is computed with them stays in the processor's cache."""

SMALL = 0.25
"""Angles are computed with twice the digits below this part of what they are made of."""


def _double_course(path: Orbit) -> DoubleCourse:
    if isinstance(path, Nodding):
        return NoddingDouble(path)
    return SteadyDouble(path) if isinstance(path, Steady) else AsymptoticDouble(path)


class DoubleForm:
    """The closed form of one motion in doubles; call it with an array of times.

    Parameters
    ----------
    reduced : Reduced
        The motion. Its constants are computed at the precision that doubles need.
    proved : Proved
        What is known of the motion from its exact numbers. The rest is told by a threshold.

    Raises
    ------
    NoClosedForm
        When 10 000 digits do not tell apart what is proved to differ.

    Notes
    -----
    Accuracy: θ, φ, ψ and 1 ∓ cos θ are within 2e-15 of themselves over the span of every shipped
    scene, and those that are zero within 1e-29, by ``tests/analytic/test_scene_accuracy.py``; so
    are θ, φ and ψ as near as 1e-150 to steady, sleeping, asymptotic and passing motions, by
    ``tests/analytic/test_near_special_motions.py``. Times and start are exact, so that being
    ill-conditioned costs nothing. Rates are within 4e-15 of the largest, by
    ``tests/analytic/test_double_form.py``.

    Examples
    --------
    >>> from heavytop.numbers.decimals import context
    >>> kicked = Reduced.from_angles(context(60), "3.28e-4", "6.6e-5", "0.0456", "0.1", 0, 0,
    ...                              0, -15, 140)
    >>> form = DoubleForm(kicked)
    >>> form([0.0, 2.0]).phi
    array([ 0.       , 15.1169641])
    >>> form.theta([0.0, 2.0])
    array([0.1       , 0.42694371])
    """

    def __init__(self, reduced: Reduced, proved: Proved = NOTHING) -> None:
        path = self.exact = orbit(reduced, DIGITS, proved)
        ctx, start = path.ctx, reduced.refined(path.ctx)
        self._side = side = -1 if reduced.g < 0 else 1
        self._path = here = _double_course(path)
        self._kappa, self._omega3 = float(start.kappa), float(start.kappa + start.b)
        self._reversal = start.a / start.b if start.b else ctx.inf
        angles = []
        for first, sign, rate in ((start.phi0, 1, ctx.zero), (start.psi0, -1, start.kappa)):
            factor = 1 if sign > 0 else side
            offset, turn, growth = (
                factor * (plus + sign * minus)
                for plus, minus in (here.offsets, here.turns, here.rates)
            )
            angles.append(Angle(ctx, first - offset, turn, rate + growth))
        self._phi, self._psi = angles

    @property
    def period(self) -> float | None:
        """T [s], the period of θ; None where nothing nutates."""
        return float(self.exact.T) if isinstance(self.exact, Nodding) else None

    @property
    def frequency(self) -> float:
        """2π/T [rad/s]; 0 where nothing nutates."""
        period = self.period
        return 0.0 if period is None else 2 * np.pi / period

    @property
    def reversal_u(self) -> float:
        """Cos θ at which φ̇ changes sign, a/b; infinite when p_ψ = 0, and reached only in loops."""
        return float(self._reversal)

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
            theta[part] = self._theta(*self._path.chords(time[part], low[part]))
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
            Beyond 2³¹ periods.
        """
        time, low, shape = _times(t, t_lo)
        records = [self._record(time[part], low[part]) for part in _chunks(time.size)]
        whole = (
            np.concatenate([getattr(record, field.name) for record in records])
            for field in fields(DoubleRecord)
        )
        return DoubleRecord(*(each.reshape((*shape, *each.shape[1:])) for each in whole))

    def _theta(self, from_top: Array, from_bottom: Array) -> Array:
        if self._side < 0:
            from_top, from_bottom = from_bottom, from_top
        return np.asarray(2 * np.arctan2(from_top, from_bottom))

    def _record(self, t: Array, t_lo: Array) -> DoubleRecord:
        place, side = self._path.place(t, t_lo), self._side
        theta, sine = (
            self._theta(place.from_top, place.from_bottom), place.from_top * place.from_bottom
        )  # fmt: skip
        above, below = place.one_minus_u, place.one_plus_u
        if side < 0:
            above, below = below, above
        u = np.where(above < below, 1 - above, below - 1)
        phi, psi = self._angles(place, t, t_lo)
        over = side * (place.plus - place.minus)
        phi_mod = self._phi.modulo(place.turning, t, t_lo, place.plus + place.minus)
        axis = np.stack((sine * np.sin(phi_mod), -sine * np.cos(phi_mod), u), axis=-1)
        return DoubleRecord(
            t, theta, phi, psi, phi_mod, self._psi.modulo(place.turning, t, t_lo, over),
            -side * place.rise, place.phidot, self._kappa + side * place.spin, u, above, below,
            side * place.rise * sine, side * place.uddot, axis, place.n.astype(np.int64),
            np.full_like(t, self._omega3), np.full_like(t, np.nan),
        )  # fmt: skip

    def _angles(self, place: DoublePlace, t: Array, t_lo: Array) -> tuple[Array, Array]:
        """φ and ψ; with twice the digits where they are small beside what they are made of."""
        side, turning, plus, minus = self._side, place.turning, place.plus, place.minus
        phi = self._phi.whole(turning, t, t_lo, plus + minus)
        psi = self._psi.whole(turning, t, t_lo, side * (plus - minus))
        small = SMALL * (abs(plus) + abs(minus) + self._path.size)
        here = np.flatnonzero((abs(phi) < small) | (abs(psi) < small))
        if here.size:
            n, time, low = turning[here], t[here], t_lo[here]
            more, less = self._path.phases(time, low)
            total, over = more + less, more - less
            phi[here] = self._phi.whole(n, time, low, total.hi, total.lo)
            psi[here] = self._psi.whole(n, time, low, side * over.hi, side * over.lo)
        return phi, psi


def _times(t: npt.ArrayLike, t_lo: npt.ArrayLike) -> tuple[Array, Array, tuple[int, ...]]:
    """Finite times in one row, each the double nearest t + t_lo and the rest; their shape."""
    time, low = np.broadcast_arrays(np.asarray(t, np.float64), np.asarray(t_lo, np.float64))
    if not (np.isfinite(time).all() and np.isfinite(low).all()):
        raise NotANumber("t: finite times")
    total, rest = two_sum(time.ravel(), low.ravel())
    return np.asarray(total), np.asarray(rest), time.shape


def _chunks(size: int) -> list[slice]:
    """The parts of a row that are computed at once; one at least."""
    return [slice(k, k + CHUNK) for k in range(0, max(size, 1), CHUNK)]
