"""The energy–momentum diagram of a top at one p_ψ: which E' and p_φ there are, and what they do.

Every motion is a point (p_φ, E'), E' = E − p_ψ²/2C. Points lie on or above a convex curve, that of
steady precession (`critical_set`). It has a corner at the hanging equilibrium, and another at the
upright one if p_ψ² ≥ 4 A |gMR|. Below that threshold the upright equilibrium lies inside the
diagram, critical by itself: a focus–focus value, over all p_ψ a thread. Followed around it the
period lattice does not come back to itself (`Circuit`).
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from math import atan2, pi, sqrt
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from heavytop.analytic import critical_set
from heavytop.analytic.closed_form import ClosedForm
from heavytop.analytic.monodromy import Circuit, Loop, LoopSample, ellipse, followed
from heavytop.analytic.rising import Rising
from heavytop.analytic.steady import steady_rates
from heavytop.classification import Kind
from heavytop.classification.reduced import FromConstants
from heavytop.errors import ImpossibleStart
from heavytop.numbers import PI, Exact, Number, decimals
from heavytop.numbers.intervals import Interval, rational
from heavytop.scene.arguments import expect, number_of
from heavytop.scene.state import Branch, State
from heavytop.scene.top import Top

Array: TypeAlias = npt.NDArray[np.float64]

NEAREST: Final = 1e-7  # of gMR: a shallower thread cannot be gone around in doubles in any time
_AROUND: Final = 181  # points at which a loop is held against the edge of the diagram
_HALVINGS: Final = 40
_BITS: Final = 400  # of moments and p_ψ that are not rational


class Place(NamedTuple):
    """One point of a diagram.

    Attributes
    ----------
    p_phi : float
        Momentum about the vertical [kg m² s⁻¹].
    E_prime : float
        Energy without that of the spin [J].
    """

    p_phi: float
    E_prime: float


class Steady(NamedTuple):
    """Steady precessions of one p_ψ, arrays of one shape.

    Attributes
    ----------
    theta : ndarray
        Tilt [rad].
    rate : ndarray
        Ω [rad/s].
    p_phi, E_prime : ndarray
        Their place [kg m² s⁻¹, J].
    fast : ndarray of bool
        Whether A Ω² |cosθ| > |gMR|: the faster of the two precessions at that tilt.
    """

    theta: Array
    rate: Array
    p_phi: Array
    E_prime: Array
    fast: npt.NDArray[np.bool_]


class Advance(NamedTuple):
    """What one nutation brings: T [s], Δφ, Δψ and Δψ − κT [rad], κ = p_ψ (1/C − 1/A).

    The angles hold +π and ∓π for each exact pass through the top or the bottom.
    """

    period: decimals.Number
    precession: decimals.Number
    spin: decimals.Number
    relative_spin: decimals.Number


@dataclass(frozen=True)
class EnergyMomentum:
    """The diagram of one top at one p_ψ; made by `energy_momentum`.

    Parameters
    ----------
    top : Top
        What spins.
    p_psi : Exact
        Momentum about the symmetry axis [kg m² s⁻¹].

    References
    ----------
    Cushman & Bates, *Global Aspects of Classical Integrable Systems*, on the Lagrange top.
    """

    top: Top
    p_psi: Exact

    @cached_property
    def g(self) -> float:
        """gMR/A [s⁻²]."""
        return float(self.top.gMR) / float(self.top.A)

    @cached_property
    def b(self) -> float:
        """p_ψ/A [s⁻¹]."""
        return float(self.p_psi) / float(self.top.A)  # so p_φ = p_ψ stays equal

    @property
    def ratio(self) -> float | None:
        """p_ψ²/4A |gMR|, at least 1 where sleeping is stable; None without gravity."""
        return self.b**2 / (4 * abs(self.g)) if self.g else None

    @cached_property
    def standing(self) -> Place:
        """The upright equilibrium, where V is highest, at p_φ = ±p_ψ, E' = |gMR|."""
        return self._vertical(1 if self.g >= 0 else -1)

    @cached_property
    def hanging(self) -> Place:
        """The hanging equilibrium, where V is lowest, at p_φ = ∓p_ψ, E' = −|gMR|."""
        return self._vertical(-1 if self.g >= 0 else 1)

    @cached_property
    def isolated(self) -> bool:
        """Whether p_ψ² < 4 A |gMR|, exactly, and the upright equilibrium is isolated."""
        weight = self.top.gMR * (self.top.gMR.sign() or 0)
        return (self.p_psi**2 - 4 * self.top.A * weight).sign() == -1

    @property
    def thread(self) -> Place | None:
        """The focus–focus value; None where sleeping is stable, or nothing falls."""
        return self.standing if self.isolated else None

    @property
    def depth(self) -> float:
        """How far the upright equilibrium is above the least energy there, ½ |gMR| (2 − β)² [J].

        Here β = |p_ψ|/√(A |gMR|). It is 0 from the threshold β = 2 on.
        """
        missing = 2 - abs(self.b) / sqrt(abs(self.g)) if self.g else 0.0
        return abs(float(self.top.gMR)) * max(missing, 0.0) ** 2 / 2

    def least(self, p_phi: npt.ArrayLike) -> Array:
        """The least E' [J] at given p_φ: the edge of the diagram.

        Parameters
        ----------
        p_phi : array_like
            Momenta about the vertical [kg m² s⁻¹].
        """
        return self.edge(p_phi).E_prime

    def edge(self, p_phi: npt.ArrayLike) -> Steady:
        """The steady precessions at given p_φ, which have the least E' there.

        Where the axis stays on the vertical, or is at rest in any direction without gravity, there
        is no one of them: rate and tilt are nan.

        Parameters
        ----------
        p_phi : array_like
            Momenta about the vertical [kg m² s⁻¹].
        """
        A, given = float(self.top.A), np.asarray(p_phi, dtype=np.float64)
        energy, rate = critical_set.least(self.g, self.b, given / A)
        corner = np.copysign(float(self.top.gMR), energy)
        energy = np.where(np.isnan(rate) & ~np.isnan(given), corner, A * energy)
        rate = np.where(rate == 0, np.nan, rate)
        minus, plus = critical_set.cosines(self.g, self.b, given / A, rate)
        theta = 2 * np.arctan2(np.sqrt(minus), np.sqrt(plus))
        fast = rate**2 * abs(plus - minus) > 2 * abs(self.g)
        return Steady(theta, rate, given, energy, fast)

    def steady(self, theta: npt.ArrayLike, which: str = "slow") -> Steady:
        """The slow or the fast precession at given tilts: nan where there is none.

        Parameters
        ----------
        theta : array_like
            Tilts θ [rad].
        which : {"slow", "fast"}
            The rate of smaller, or of larger, magnitude.

        Raises
        ------
        ImpossibleStart
            Another word.
        """
        if which not in ("slow", "fast"):
            raise ImpossibleStart([("which", '"slow" or "fast"')])
        tilt, A = np.asarray(theta, dtype=np.float64), float(self.top.A)
        u = np.where(tilt == pi / 2, 0.0, np.cos(tilt))
        found = steady_rates(A, float(self.top.gMR), float(self.p_psi), u)[which == "fast"]
        rate = np.where(np.isfinite(found) & (found != 0), found, np.nan)
        drift = rate * np.sin(tilt) ** 2
        p_phi, energy = A * (self.b * u + drift), A * (self.g * u + rate * drift / 2)
        return Steady(tilt, rate, p_phi, energy, rate**2 * abs(u) > abs(self.g))

    @property
    def cusps(self) -> tuple[Place, Place] | None:
        """The ends of the line of cusps, E' p_ψ = gMR p_φ; None at p_ψ = 0 or without gravity.

        It runs from the hanging to the upright equilibrium, and belongs to neither. Above it there
        are loops as far as |p_φ| < |p_ψ|.
        """
        return (self.hanging, self.standing) if self.g and self.b else None

    def kinds(self, E_prime: npt.ArrayLike, p_phi: npt.ArrayLike) -> npt.NDArray[np.str_]:
        """The kinds of motion at given places, as texts; "" where there is none.

        They are told in doubles from where the place lies: `heavytop.classify` proves them from
        a start (`start`). The level of the thread is that of the separatrix.

        Parameters
        ----------
        E_prime, p_phi : array_like
            Places [J, kg m² s⁻¹]; they are broadcast.
        """
        energy, p = np.broadcast_arrays(np.asarray(E_prime, float), np.asarray(p_phi, float))
        p_psi, gMR, lowest = float(self.p_psi), float(self.top.gMR), self.least(p)
        on_edge, vertical, between = energy == lowest, abs(p) == abs(p_psi), abs(p) < abs(p_psi)
        lift = np.sign(p_psi) * (energy * p_psi - gMR * p)
        upright = (p == np.sign(gMR) * p_psi) & (energy == abs(gMR))
        first_that_fits: list[tuple[npt.NDArray[np.bool_], str]] = [
            (~(energy >= lowest), ""),
            (np.full(p.shape, gMR == 0), Kind.FORCE_FREE),
            (upright & on_edge, Kind.SLEEPING),
            (vertical & on_edge & (energy == -abs(gMR)), Kind.HANGING),
            (on_edge, Kind.UNIFORM_PRECESSION),
            (vertical & (p_psi == 0), Kind.PLANAR_PENDULUM),
            (upright, Kind.SEPARATRIX),
            ((p == p_psi) & (energy > gMR), Kind.THROUGH_TOP),
            ((p == -p_psi) & (energy > -gMR), Kind.THROUGH_BOTTOM),
            (between & (lift > 0), Kind.LOOPS),
            (between & (lift == 0), Kind.CUSPS),
        ]
        words = [np.full(p.shape, str(kind)) for _, kind in first_that_fits]
        return np.select([here for here, _ in first_that_fits], words, default=str(Kind.WAVES))

    def start(
        self, E_prime: Number, p_phi: Number, theta: Number | None = None,
        branch: Branch = "falling",
    ) -> State:  # fmt: skip
        """The start of a motion at a place of the diagram, with exactly these constants.

        Parameters
        ----------
        E_prime, p_phi : number
            Energy without that of the spin [J] and momentum about the vertical [kg m² s⁻¹].
        theta : number, optional
            Tilt [rad]; without it that of the steady precession of this p_φ, which every motion of
            this p_φ passes.
        branch : {"falling", "rising"}
            Whether θ grows or shrinks.

        Raises
        ------
        ImpossibleStart
            The place is outside of the diagram, or on its edge; or θ is not reached.
        """
        energy, p = Exact.of(E_prime), Exact.of(p_phi)
        tilt = self._middle(energy, p) if theta is None else theta
        E = energy + self.p_psi**2 / (2 * self.top.C)
        return State.from_constants(self.top, E, p, self.p_psi, tilt, branch)

    @property
    def maximal_loop(self) -> float:
        """How large a loop `around` the upright equilibrium can be; 0 at the threshold."""
        if not self.isolated:
            return 0.0
        around = np.linspace(0.0, 1.0, _AROUND)
        low, high = 0.0, self.depth / abs(float(self.top.gMR))
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            p, energy = np.array([*map(self.around(middle), around)]).T
            low, high = (middle, high) if np.all(energy > self.least(p)) else (low, middle)
        return low

    def around(self, size: float) -> Loop:
        """The ellipse around the upright equilibrium with axes √(A |gMR|) and |gMR| times size.

        It runs counterclockwise where p_φ points to the right and E' upwards.

        Parameters
        ----------
        size : float
            In units of these axes, positive; `maximal_loop` is the largest there is.

        Returns
        -------
        Loop
            (p_φ, E') at s from 0 to 1 [kg m² s⁻¹, J], for `circuit`.
        """
        weight = abs(float(self.top.gMR))
        radii = size * sqrt(float(self.top.A) * weight), size * weight
        return ellipse(self.standing, radii)

    def advance(self, p_phi: Any, E_prime: Any, digits: int = 40) -> Advance | None:
        """T, Δφ and Δψ of the motions at a place, in many digits; None where nothing nutates.

        Parameters
        ----------
        p_phi, E_prime : number
            The place [kg m² s⁻¹, J], rational: a float, or a number of mpmath.
        digits : int
            How many decimal digits.

        Raises
        ------
        ImpossibleStart
            It is outside of the diagram.
        """
        lowest = float(self.least(float(p_phi)))
        if not E_prime >= lowest:
            rule = f"at least {lowest:.17g} at p_phi = {float(p_phi):.17g}"
            raise ImpossibleStart([("E_prime", rule)])
        A, C, gMR, p_psi = map(_fraction, (self.top.A, self.top.C, self.top.gMR, self.p_psi))
        minus, plus = self._passed(float(E_prime), float(p_phi))
        source = FromConstants.of(
            gMR / A, rational(p_phi) / A, p_psi / A, rational(E_prime) / A,
            (Fraction(minus), Fraction(plus)), p_psi / C - p_psi / A,
        )  # fmt: skip
        form = ClosedForm(Rising(source, proved=False), digits)
        if form.period is None:
            return None
        return Advance(form.period, form.precession, form.spin, form.relative_spin)

    def circuit(self, loop: Loop | None = None, points: int = 48) -> Circuit:
        """The period lattice followed once around a closed loop of the diagram.

        Parameters
        ----------
        loop : callable, optional
            (p_φ, E') at s from 0 to 1, the same at both; without it half of the largest ellipse
            around the thread.
        points : int
            Steps to begin with; they are halved until none turns by a quarter or more.

        Raises
        ------
        ImpossibleStart
            The loop leaves the diagram, runs into a critical point or is not closed; or there is
            no thread to go around, and no loop is given.

        Notes
        -----
        Accuracy: the derivatives of Δφ and Δψ, added up along the default loop, give 2π to 1e-12,
        by ``tests/analytic/test_energy_momentum.py``.

        Examples
        --------
        >>> found = energy_momentum(Top(1, "0.5", 1), 1).circuit()
        >>> found.winding, found.monodromy
        (1, ((1, 0, 0), (0, 1, 0), (-1, 1, 1)))
        """
        if loop is None:
            if not self.isolated:
                why = "below the threshold p_psi^2 = 4 A |gMR|: nothing is there to go around"
                raise ImpossibleStart([("p_psi", why)])
            if self.depth < NEAREST * abs(float(self.top.gMR)):
                why = f"farther below the threshold: the thread is but {self.depth:.3g} J deep"
                raise ImpossibleStart([("p_psi", why)])
            loop = self.around(self.maximal_loop / 2)
        return followed(self._evaluate, loop, points)

    def _evaluate(self, p_phi: float, E_prime: float) -> LoopSample:
        found = self.advance(p_phi, E_prime)
        if found is None:
            where = f"({p_phi:.17g}, {E_prime:.17g})"
            raise ImpossibleStart([("loop", f"off the critical set, on which is {where}")])
        top, bottom = ((Exact.of(p_phi) + side * self.p_psi).sign() != -1 for side in (-1, 1))
        gMR, (period, precession, spin, relative) = float(self.top.gMR), map(float, found)
        return LoopSample(
            p_phi, E_prime, period, precession, spin, relative,
            top, bottom, E_prime > gMR, E_prime > -gMR,
        )  # fmt: skip

    def _vertical(self, pole: int) -> Place:
        return Place(pole * float(self.p_psi), pole * float(self.top.gMR))

    def _passed(self, E_prime: float, p_phi: float) -> tuple[float, float]:
        """1 − cosθ and 1 + cosθ of a tilt that the motions at a place pass."""
        A = float(self.top.A)
        return critical_set.passed(self.g, self.b, p_phi / A, E_prime / A)

    def _middle(self, E_prime: Exact, p_phi: Exact) -> Number:
        """A tilt that the motions at a place pass: a pole itself, where they pass that."""
        hung = -1 if self.g >= 0 else 1
        if np.isnan(self.edge(float(p_phi)).rate):
            for pole in (hung, -hung):
                if (p_phi - pole * self.p_psi).sign() == 0:
                    return 0 if pole > 0 else PI
        minus, plus = self._passed(float(E_prime), float(p_phi))
        return 2 * atan2(sqrt(minus), sqrt(plus))


def energy_momentum(top: Top, p_psi: Number) -> EnergyMomentum:
    """The energy–momentum diagram of a top at one p_ψ.

    Parameters
    ----------
    top : Top
        What spins.
    p_psi : number
        Momentum about the symmetry axis, p_ψ = C ω3 [kg m² s⁻¹].

    Returns
    -------
    EnergyMomentum

    Raises
    ------
    NotANumber
        `p_psi` is no number.
    WrongType
        `top` is no Top.

    Examples
    --------
    >>> diagram = energy_momentum(Top("3.28e-4", "6.6e-5", "0.0456"), "0.004")
    >>> diagram.thread
    Place(p_phi=0.004, E_prime=0.0456)
    >>> round(diagram.ratio, 6), diagram.kinds([0.05, 0.01], [0.0, 0.002]).tolist()
    (0.267437, ['loops', 'waves'])

    Notes
    -----
    Accuracy: ``tests/analytic/test_energy_momentum.py`` holds the least energy to 1e-14 and its
    tilt to 1e-12 rad of the effective potential's lowest point.

    References
    ----------
    As of `EnergyMomentum`.
    """
    expect("top", top, Top)
    return EnergyMomentum(top, number_of("p_psi", p_psi))


def _fraction(x: Exact) -> Fraction:
    """A rational number itself; another one to 400 bits."""
    q = x.fraction
    return Interval.of(x.ball(_BITS)).middle if q is None else q
