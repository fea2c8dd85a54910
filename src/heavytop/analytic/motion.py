"""The exact motion of a top: constants, turning points, kind and closed form, to any digits."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from operator import attrgetter
from typing import Any, Final, NamedTuple

from heavytop.analytic.events import EventTimes
from heavytop.analytic.form import (
    BALL_SPARE_DIGITS,
    FORMULAS,
    Record,
    map_balls,
    midpoint,
    read_digits,
    to_mpf,
)
from heavytop.analytic.refine import Refined
from heavytop.analytic.roots import sign_of
from heavytop.classification import Kind, Verdict
from heavytop.classification.classify import classify
from heavytop.classification.reduced import FEW_BITS, Reduced, ReducedMotion, StartMotion
from heavytop.exact.balls import Interval, ball_of, working
from heavytop.exact.decimals import Number, context
from heavytop.scene.arguments import expect, integer, one_of, read_argument, wrong_type
from heavytop.scene.state import State
from heavytop.scene.top import Top
from heavytop.text import Played

MOST_DIGITS: Final = 10_000
FLOAT_DIGITS: Final = 40  # of the ball from which a float is rounded


class Constant(cached_property[Any]):
    """A number of `Constants`, by its name, as a float or a tuple of floats, or None.

    A ball that contains 0 becomes 0.
    """

    def __init__(self, doc: str) -> None:
        super().__init__(self._read)
        self.__doc__ = doc

    def _read(self, motion: ClosedForm) -> Any:
        """The value of the property of a motion."""
        name = str(self.attrname)
        found = motion.refine(name, attrgetter(name), FLOAT_DIGITS)
        return map_balls(lambda x: 0.0 if x.contains(0) else float(x), found)


class ClosedForm(Refined):
    """The exact motion of given constants: properties are floats; `at`, `ball`, `mpf` have digits.

    Parameters
    ----------
    source : ReducedMotion
        The exact numbers of the motion.
    """

    period = Constant("T [s], the period of θ; None where nothing nutates.")
    tilts = Constant("θ [rad] at u₁ and at u₂; the same twice where it is steady.")
    theta_min = Constant("The least θ [rad]; 0, never reached, where it tends to the top.")
    theta_max = Constant("The greatest θ [rad]; π, never reached, where it tends there.")
    amplitude = Constant("How far it nods, θ_max − θ_min [rad]; None where nothing nutates.")
    nearest = Constant("How near the axis comes to θ = 0 and to θ = π [rad].")
    roots = Constant("The roots of the cubic as cos θ, increasing, but for an infinite one.")
    precession = Constant("Δφ in one period [rad], +π for each exact pass of a pole; or None.")
    spin = Constant("Δψ in one period [rad], −π for a pass of the top, +π of the bottom.")
    relative_spin = Constant("Δψ − κT in one period [rad]; None where nothing nutates.")
    mean_rates = Constant("Means of (φ ± ψ)˙ ∓ κ [rad/s], without jumps at poles.")
    lower_turning = Constant("The time of a passage through u₁, θ_max if gMR ≥ 0 [s]; or None.")
    modulus = Constant("The parameter m = k² and 1 − m; None where nothing nutates.")
    growth = Constant("The rate at which an axis tends to the vertical [1/s]; or None.")

    @property
    def nutates(self) -> bool:
        """Whether θ swings between two turning points; elsewhere there is no period."""
        return self.regime.name == "nutating"

    @property
    def from_top(self) -> float:
        """How near θ = 0 the axis comes [rad], to its own digits."""
        return float(self.nearest[0])

    @property
    def from_bottom(self) -> float:
        """How near θ = π the axis comes [rad], to its own digits."""
        return float(self.nearest[1])

    @cached_property
    def reduced(self) -> Reduced:
        """The motion in units A = 1, in mpmath numbers of 60 digits."""
        ctx = context(60)
        return self._start.mapped(lambda x: midpoint(ctx, x))

    @property
    def mean_angle_rates(self) -> tuple[float, float]:
        """Means of φ̇ and ψ̇ over a period; where nothing nutates, what they are at the start."""
        if self.period:
            return self.precession / self.period, self.spin / self.period
        start = self.at(0.0)
        return float(start.phidot), float(start.psidot)

    @property
    def round(self) -> float | None:
        """The time [s] in which the axis goes once round, 2π over |mean φ̇|.

        None where that is zero, and where the axis comes to the vertical, or tends to it.
        """
        rate = 0.0 if 0.0 in self.nearest else abs(self.mean_angle_rates[0])
        return 2 * math.pi / rate if rate else None

    @cached_property
    def cusps(self) -> bool:
        """Whether φ̇ is exactly 0 where a nutating axis is highest."""
        with working(FEW_BITS):
            passes = not (self.regime.misses_top and self.regime.misses_bottom)
            if passes or not self.vanishes("cusp_number"):
                return False
        return self.refine("P+ P-", lambda c: sign_of(c.P[0] * c.P[1], "P+ or P- and 0")) < 0

    def energy(self, digits: int) -> Number:
        """E [J]; nan where the moments are not known.

        Parameters
        ----------
        digits : int
            Decimal digits.
        """
        return context(digits).nan

    def events(self, kind: str) -> EventTimes:
        """The times of the events of one kind.

        Parameters
        ----------
        kind : {"turning", "reversal", "cusp", "theta_min", "theta_max"}
            Turning points of θ, changes of sign of φ̇, or cusps.

        Raises
        ------
        Impossible
            Another kind.
        """
        return EventTimes(self, kind)

    def at(self, t: Any, digits: int | None = None, t_lo: Any = 0.0) -> Any:
        """The top at the time or times t [s].

        Parameters
        ----------
        t : number or array_like
            Times since the start; negative ones are before it.
        digits : int, optional
            Decimal digits; without it arrays of doubles are returned.
        t_lo : array_like
            What the times have beyond the digits of doubles [s].

        Returns
        -------
        Record
            Arrays of the shape of t; with `digits` numbers, or a tuple of records when t is many.
            It has the angles and their rates, `axis`, `quaternion` (body to space, scalar first),
            `omega` in space, and the `energy`, each computed when it is first read.

        Raises
        ------
        NotANumber, Impossible
            A time that is no finite number; digits that are no whole number from 1 to 10 000.
        NoClosedForm
            Beyond 2⁶² periods in doubles, or where an angle is too large for one; with digits,
            where 65 536 bits do not give them.
        """
        if digits is None:
            from heavytop.analytic.doubles import read_doubles  # imports numpy, which is slow

            return Record(read_doubles(self, t, t_lo), (self.at, (t, None, t_lo)))
        digits = integer("digits", digits, 1, MOST_DIGITS)
        t = t.item() if getattr(t, "ndim", None) == 0 else t
        if isinstance(t, Iterable) and not isinstance(t, str):
            return tuple(self.at(each, digits) for each in t)
        return Record(read_digits(self, t, digits), (self.at, (t, digits)))

    # --- numbers to any digits --------------------------------------------------------------------

    def ball(self, name: str, digits: int = 15, t: Any = None) -> Any:
        """A number of the motion as a ball of python-flint, or a tuple of balls, or None.

        Parameters
        ----------
        name : str
            With a time a quantity of a `Record`, without one a property of the motion.
        digits : int
            Decimal digits, relative to max(1, |x|).
        t : number, optional
            Time since the start [s], exact; floats mean their binary value.

        Raises
        ------
        Unseparated
            65 536 bits do not give the digits.
        """
        if t is None and name in FORMULAS:
            raise wrong_type("t", f"a time, which {name} needs", t)
        constants = {x: y for x, y in vars(ClosedForm).items() if isinstance(y, Constant)}
        read_argument("name", name, one_of(constants if t is None else FORMULAS))
        if t is None:
            return self.refine(name, lambda c: getattr(c, name), digits)
        return self.reader(t, digits)(name)

    def interval(self, name: str, t: Any = None, digits: int = 15) -> Any:
        """Proved bounds of a number of the motion, an `Interval`, a tuple of them, or None.

        Parameters
        ----------
        name : str
            With a time a quantity of a `Record` but energy, without one a property of the motion.
        t : number, optional
            Time since the start [s], exact; floats mean their binary value.
        digits : int
            Decimal digits, relative to max(1, |x|).

        Raises
        ------
        Impossible
            There is none of this name.
        WrongType
            It needs a time.
        Unseparated
            A number can be neither separated from 0 nor proved to be 0, or 65 536 bits do not give
            the digits.
        """
        found = self.ball(name, integer("digits", digits, 2, MOST_DIGITS), t)
        self.require_proof()
        return map_balls(Interval.of, found)

    def mpf(self, name: str, digits: int, t: Any = None) -> Any:
        """A number of the motion, as `ball` has it, in mpmath numbers: the middles of balls."""
        digits = integer("digits", digits, 1)
        return to_mpf(self.ball(name, digits + BALL_SPARE_DIGITS, t), digits)

    def require_proof(self) -> None:
        """Raise `Unseparated` where a number was taken for 0 without a proof."""
        if self.doubt is not None:
            raise self.doubt


@dataclass(frozen=True)
class Motion(Played, ClosedForm):
    """The motion of `top` from `start`; each property is computed when it is first read.

    Parameters
    ----------
    top : Top
        The top.
    start : State
        Its start.

    Raises
    ------
    WrongType
        `top` is no Top, or `start` no State.

    Examples
    --------
    >>> from heavytop.scene.state import State
    >>> from heavytop.scene.top import Top
    >>> motion = Motion(Top(A="3.28e-4", C="6.6e-5", gMR="0.0456"),
    ...                 State(theta="0.1", phidot=-15, psidot=140))
    >>> str(motion.kind), round(motion.period, 10)
    ('loops', 0.5428955182)
    >>> round(float(motion.at(2.0).theta), 12)
    0.42694370531
    >>> print(f"{motion.at(2, digits=20).theta:.20f}", *motion.interval("period").bounds(12))
    0.42694370530965690245 0.542895518188 0.542895518189

    Notes
    -----
    Accuracy: ``tests/analytic/test_doubles.py`` holds θ in doubles to 2e-15 of itself, φ and
    ψ to 1e-15 max(1, |x|), over every shipped scene, and the axis, and φ and ψ modulo 2π, to 4e-15
    a million periods away; ``tests/analytic/test_motion.py`` holds 100 digits to 1000.

    References
    ----------
    Whittaker, *Analytical Dynamics*, sections 71 to 73; elliptic integrals and theta functions as
    in the *NIST Digital Library of Mathematical Functions*, chapters 19, 20 and 22.
    """

    top: Top
    start: State

    def __post_init__(self) -> None:
        expect("top", self.top, Top)
        expect("start", self.start, State)

    def __reduce__(self) -> tuple[Any, ...]:
        return Motion, (self.top, self.start)  # computed numbers are not copied

    def __str__(self) -> str:
        return f"Motion({self.top}, {self.start})"

    @cached_property
    def source(self) -> ReducedMotion:  # type: ignore[override]
        """The exact numbers of the motion."""
        return StartMotion(self.top, self.start)

    @cached_property
    def verdict(self) -> Verdict:
        """The kind with its tags, and why."""
        return classify(self.top, self.start)

    @property
    def kind(self) -> Kind:
        """The kind of motion."""
        return self.verdict.kind

    @property
    def tags(self) -> tuple[str, ...]:
        """The tags of the verdict, special properties of the motion beside its kind."""
        return self.verdict.tags

    @property
    def certified(self) -> bool:
        """Whether the kind is proved."""
        return self.verdict.certified

    def reaction(self, t: Any, digits: int | None = None) -> Any:
        """The force of the pivot on the top at the time or times t [s], in space.

        Parameters
        ----------
        t : number or array_like
            Times since the start.
        digits : int, optional
            Decimal digits; without it doubles.

        Returns
        -------
        ndarray, shape (…, 3)
            [N].

        Raises
        ------
        ImpossibleTop
            Mass and distance of the top are not given.
        """
        return self.at(t, digits).reaction

    @cached_property
    def constants(self) -> Integrals:
        """E, E', p_φ, p_ψ at 60 digits; `constants.floats` has them as floats."""
        return self.integrals(60)

    def integrals(self, digits: int) -> Integrals:
        """E, E', p_φ, p_ψ to so many digits.

        Parameters
        ----------
        digits : int
            Decimal digits.
        """
        ctx = context(digits)
        bits = ctx.prec + 64
        with working(bits):
            start, A = self.source.reduced(bits), ball_of(self.top.A)
            balls = start.energy, start.h, start.a, start.b
            return Integrals(*(midpoint(ctx, A * ball) for ball in balls))

    def energy(self, digits: int) -> Number:
        """E [J].

        Parameters
        ----------
        digits : int
            Decimal digits.
        """
        return self.integrals(digits).E


class Integrals(NamedTuple):
    """Energies E, E' = E − p_ψ²/2C and momenta p_φ, p_ψ, in mpmath numbers.

    Parameters
    ----------
    E, E_prime : Number
        Energy, and energy without that of the spin [J].
    p_phi, p_psi : Number
        Momenta about the vertical and about the symmetry axis [kg m² s⁻¹].
    """

    E: Number
    E_prime: Number
    p_phi: Number
    p_psi: Number

    @property
    def floats(self) -> dict[str, float]:
        """The four constants as floats, by name."""
        return {name: float(value) for name, value in self._asdict().items()}
