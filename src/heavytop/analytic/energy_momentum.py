"""The energy–momentum diagram of a top at one p_ψ: which E' and p_φ there are, and what they do.

Every motion is a point (p_φ, E'), E' = E − p_ψ²/2C. Points lie on or above a convex curve, that of
steady precession (`critical_set`). It has a corner at the hanging equilibrium, and another at the
upright one if p_ψ² ≥ 4 A |gMR|. Below that threshold the upright equilibrium lies inside the
diagram, an isolated critical value: the focus–focus point, over all p_ψ a line of them. Followed
around it the period lattice does not come back to itself (`Circuit`).
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from math import atan2, pi, sqrt
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from heavytop.analytic import steady
from heavytop.analytic.closed_form import ClosedForm
from heavytop.analytic.critical_set import Array, valley
from heavytop.analytic.monodromy import Circuit, Loop, ellipse, followed
from heavytop.analytic.rising import Rising
from heavytop.classification import Kind
from heavytop.classification.reduced import FromConstants
from heavytop.errors import ImpossibleStart
from heavytop.numbers import PI, Exact, Number
from heavytop.numbers.intervals import Interval, rational
from heavytop.scene.arguments import expect, number_of
from heavytop.scene.state import Branch, State
from heavytop.scene.top import Top

NEAREST: Final = 1e-7  # of gMR: around a shallower focus–focus point doubles resolve no loop
_BESIDE: Final = 2001  # points of the edge that are held against the focus–focus point
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
        side = 1 if self.g >= 0 else -1
        return Place(side * float(self.p_psi), side * float(self.top.gMR))

    @cached_property
    def hanging(self) -> Place:
        """The hanging equilibrium, where V is lowest, at p_φ = ∓p_ψ, E' = −|gMR|."""
        return Place(-self.standing.p_phi, -self.standing.E_prime)

    @cached_property
    def isolated(self) -> bool:
        """Whether p_ψ² < 4 A |gMR|, exactly, and the upright equilibrium is isolated."""
        threshold = 4 * self.top.A * self.top.gMR
        return (self.p_psi**4 - threshold**2).sign() == -1

    @property
    def focus_focus(self) -> Place | None:
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
        A, p_psi, given = float(self.top.A), float(self.p_psi), np.asarray(p_phi, dtype=np.float64)
        found = valley(self.g, (given + p_psi) / A, (given - p_psi) / A)
        corner = np.isnan(found.rate) & ~np.isnan(given)
        energy = np.where(corner, np.copysign(float(self.top.gMR), found.energy), A * found.energy)
        rate = np.where(found.rate == 0, np.nan, found.rate)
        theta = 2 * np.arctan2(np.sqrt(found.one_minus_u), np.sqrt(found.one_plus_u))
        fast = rate**2 * abs(found.one_plus_u - found.one_minus_u) > 2 * abs(self.g)
        return Steady(np.where(np.isnan(rate), np.nan, theta), rate, given, energy, fast)

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
        found = steady.rates(self.top, float(self.p_psi), u)[which == "fast"]
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
        a start (`start`). The level of the focus–focus point is that of the separatrix.

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
        first_that_fits: list[tuple[Any, str]] = [
            (~(energy >= lowest), ""),
            (np.bool_(gMR == 0), Kind.FORCE_FREE),
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
        where, kinds = zip(*first_that_fits, strict=True)
        return np.select(where, kinds, default=str(Kind.WAVES))

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
        p_phi, E = Exact.of(p_phi), Exact.of(E_prime) + self.p_psi**2 / (2 * self.top.C)
        if theta is None:
            minus, plus = self._lowest(p_phi)
            theta = 2 * atan2(sqrt(minus), sqrt(plus)) if plus else PI
        return State.from_constants(self.top, E, p_phi, self.p_psi, theta, branch)

    @property
    def maximal_loop(self) -> float:
        """How large a loop `around` the upright equilibrium can be; 0 at the threshold.

        In the units of its axes the loop is a circle, and the edge is convex: that is how far it
        is from the focus–focus point.
        """
        if not self.isolated:
            return 0.0
        unit, weight = self._axes
        aside = self.depth / weight * np.linspace(-1, 1, _BESIDE)
        below = self.standing.E_prime - self.least(self.standing.p_phi + unit * aside)
        return float(np.min(np.hypot(aside, below / weight)))

    @property
    def _axes(self) -> tuple[float, float]:
        """√(A |gMR|) and |gMR|, natural units of momentum and energy."""
        weight = abs(float(self.top.gMR))
        return sqrt(float(self.top.A) * weight), weight

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
        unit, weight = self._axes
        return ellipse(self.standing, (size * unit, size * weight))

    def advance(self, p_phi: Any, E_prime: Any, digits: int = 40) -> ClosedForm | None:
        """The closed form of the motions at a place, with T, Δφ and Δψ; None where nothing nutates.

        The angles hold +π and ∓π for each exact pass through the top or the bottom.

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
        p, kappa = rational(p_phi), p_psi / C - p_psi / A
        minus, plus = map(Fraction, self._lowest(Exact.of(p)))
        source = FromConstants.of(
            gMR / A, p / A, p_psi / A, rational(E_prime) / A, (minus, plus), kappa
        )
        form = ClosedForm(Rising(source, proved=False), digits)
        return None if form.period is None else form

    def circuit(self, loop: Loop | None = None, points: int = 48) -> Circuit:
        """The period lattice followed once around a closed loop of the diagram.

        Parameters
        ----------
        loop : callable, optional
            (p_φ, E') at s from 0 to 1, the same at both; without it half of the largest ellipse
            around the focus–focus point.
        points : int
            Steps to begin with; they are halved until none turns by a quarter or more.

        Raises
        ------
        ImpossibleStart
            The loop leaves the diagram, runs into a critical point or is not closed; or there is
            no focus–focus point to go around, and no loop is given.

        Notes
        -----
        Accuracy: the derivatives of Δφ and Δψ, added up along the default loop, give 2π to 1e-12,
        by ``tests/analytic/test_monodromy.py``.

        Examples
        --------
        >>> found = energy_momentum(Top(1, "0.5", 1), 1).circuit()
        >>> found.winding, found.monodromy
        (1, ((1, 0, 0), (0, 1, 0), (-1, 1, 1)))
        """
        if loop is None:
            if not (self.isolated and self.depth >= NEAREST * self._axes[1]):
                rule = "below the threshold p_psi^2 = 4 A |gMR|, with the focus-focus point"
                raise ImpossibleStart([("p_psi", f"{rule} at least {NEAREST} |gMR| deep")])
            loop = self.around(self.maximal_loop / 2)
        return followed(self._lattice, loop, points)

    def _lattice(self, p_phi: float, E_prime: float) -> tuple[float, ...]:
        if (found := self.advance(p_phi, E_prime)) is None:
            where = f"({p_phi:.17g}, {E_prime:.17g})"
            raise ImpossibleStart(
                [("loop", f"must avoid the critical set, which contains {where}")]
            )
        lattice: tuple[Any, ...] = found.period, found.precession, found.spin, found.relative_spin
        sides, gMR = (1, -1), float(self.top.gMR)
        beyond = ((Exact.of(p_phi) - side * self.p_psi).sign() != -1 for side in sides)
        return (*map(float, lattice), *beyond, *(E_prime > side * gMR for side in sides))

    def _lowest(self, p_phi: Exact) -> tuple[float, float]:
        """1 − cosθ and 1 + cosθ of the lowest tilt, which every motion of this p_φ passes."""
        plus, minus = (float((p_phi + side * self.p_psi) / self.top.A) for side in (1, -1))
        found = valley(self.g, plus, minus)
        return float(found.one_minus_u), float(found.one_plus_u)


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
    >>> diagram.focus_focus
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
