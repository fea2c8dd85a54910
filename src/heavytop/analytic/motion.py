"""One motion of one top: its constants, turning points, kind and closed form."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, overload

from flint import arb

from heavytop.analytic.closed_form import ClosedForm, Constants, constants
from heavytop.analytic.rising import FLOAT_DIGITS, MOST_DIGITS, MotionNumbers, Rising, itself
from heavytop.analytic.solution import ExactRecord, Solution
from heavytop.classification import Kind, Verdict
from heavytop.classification.classify import classify
from heavytop.classification.reduced import FEW_BITS, Reduced, ball_of, reduced_from_scene
from heavytop.display import Played
from heavytop.exact.balls import working
from heavytop.scene.arguments import expect, text_of, whole
from heavytop.scene.state import State
from heavytop.scene.top import Top

if TYPE_CHECKING:
    import numpy.typing as npt

    from heavytop.analytic.many_times import DoubleForm, DoubleRecord


@dataclass(frozen=True)
class Motion(Played, MotionNumbers[float]):
    """The motion of `top` from `start`; each property is computed when it is first asked for.

    Parameters
    ----------
    top : Top
        What spins.
    start : State
        How it starts.

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

    Notes
    -----
    Accuracy: ``tests/analytic/test_many_times.py`` holds θ in doubles to 2e-15 of itself, φ and
    ψ to 1e-15 max(1, |x|), over every shipped scene, and the axis, and φ and ψ modulo 2π, to 4e-15
    a million periods away; ``tests/analytic/test_motion.py`` holds 100 digits to 1000.

    References
    ----------
    Whittaker, *Analytical Dynamics*, sections 71 to 73; elliptic integrals and theta functions as
    in the *NIST Digital Library of Mathematical Functions*, chapters 19, 20 and 22.
    """

    top: Top
    start: State

    _digits = FLOAT_DIGITS

    def __post_init__(self) -> None:
        expect("top", self.top, Top)
        expect("start", self.start, State)

    def __str__(self) -> str:
        return f"Motion({self.top}, {self.start})"

    def _number(self, ball: arb) -> float:
        return 0.0 if ball.contains(0) else float(ball)

    @cached_property
    def rising(self) -> Rising:  # type: ignore[override]
        """The closed form at any precision; what cannot be told from zero counts as zero."""
        return Rising(reduced_from_scene(self.top, self.start), proved=False)

    @property
    def regime(self) -> str:
        """What θ does in the long run, one of "steady", "asymptotic" and "nutating"."""
        return self.rising.regime.name

    @property
    def reduced(self) -> Reduced:
        """The motion in units A = 1, at 60 digits."""
        return self.exact.reduced

    @cached_property
    def constants(self) -> Constants:
        """E, E', p_φ, p_ψ at 60 digits; `constants.floats` has them as floats."""
        return constants(self.top, self.start)

    @cached_property
    def exact(self) -> ClosedForm:
        """The closed form at 50 digits."""
        return self.form(50)

    @cached_property
    def double(self) -> DoubleForm:
        """The closed form in doubles."""
        from heavytop.analytic.many_times import DoubleForm  # a verdict takes no arrays

        return DoubleForm(self.rising)

    @cached_property
    def _energy(self) -> float:
        """E as a float."""
        with working(FEW_BITS):
            return self._number(ball_of(self.top.A, FEW_BITS) * self.rising.start.energy)

    def form(self, digits: int) -> ClosedForm:
        """The closed form at so many digits.

        Parameters
        ----------
        digits : int
            Decimal digits, from 1 to 10 000.

        Returns
        -------
        ClosedForm
            Call it with a time [s]; it has T, Δφ and Δψ to all digits.

        Raises
        ------
        NotANumber, Impossible
            No whole number from 1 to 10 000.
        """
        return ClosedForm(self.rising, whole("digits", digits, 1, MOST_DIGITS))

    @cached_property
    def roots(self) -> tuple[float, float, float] | None:  # type: ignore[override]
        """The roots cos θ of the cubic, increasing; None where nothing nutates."""
        if not self.nutates:
            return None
        found = super().roots
        return found[0], found[1], found[2] if len(found) == 3 else math.inf  # gMR = 0

    @property
    def from_top(self) -> float:
        """How near θ = 0 the axis comes [rad], to its own digits."""
        return self.nearest[0]

    @property
    def from_bottom(self) -> float:
        """How near θ = π the axis comes [rad], to its own digits."""
        return self.nearest[1]

    @property
    def mean_angle_rates(self) -> tuple[float, float]:
        """Means of φ̇ and ψ̇ over a period; where nothing nutates, what they are at the start."""
        if self.period and self.precession is not None and self.spin is not None:
            return self.precession / self.period, self.spin / self.period
        start = self.at(0.0)
        return float(start.phidot), float(start.psidot)

    @cached_property
    def amplitude(self) -> float | None:
        """How far the axis nods, θ_max − θ_min [rad]; None where nothing nutates."""
        if not self.nutates:
            return None

        def between(found: Solution, _: int) -> arb:
            one, other = found.tilts
            return abs(one - other)

        return self._number(
            self.rising.settled("the amplitude", between, self._digits, size=itself)
        )

    @property
    def round(self) -> float | None:
        """The time [s] in which the axis goes once round, 2π over the mean of |φ̇|.

        None where that is zero, on the vertical, and where a motion that tends to it has no mean.
        """
        vertical = self.rising.regime.steady and 0.0 in self.nearest
        if self.regime == "asymptotic" or vertical:
            return None
        rate = abs(self.mean_angle_rates[0])
        return 2 * math.pi / rate if rate else None

    def mean_rate(self, angle: str) -> float:
        """The mean of (φ + ψ)˙ − κ, or of (φ − ψ)˙ + κ [rad/s], without jumps at poles.

        Parameters
        ----------
        angle : {"sigma", "delta"}
            The sum, regular at the top, or the difference, regular at the bottom.

        Raises
        ------
        ValueError
            For any other name.
        WrongType
            For what is no name.
        """
        if text_of("angle", angle) not in ("sigma", "delta"):
            raise ValueError(f"sigma or delta, not {angle!r}")
        return self.mean_rates[angle == "delta"]

    @cached_property
    def verdict(self) -> Verdict:
        """The kind with everything said about it."""
        return classify(self.top, self.start)

    @property
    def kind(self) -> Kind:
        """The kind of motion."""
        return self.verdict.kind

    @property
    def tags(self) -> tuple[str, ...]:
        """What else holds."""
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
        found = self.at(t, digits) if digits is not None else self.at(t)
        if digits is None:
            return self.top.reaction(found.axis, found.omega)  # type: ignore[union-attr]
        ctx = self.form(digits).ctx
        if not isinstance(found, tuple):
            return self.top.reaction(found.axis, found.omega, lambda x: x.mpf(ctx))
        axes, omegas = ([getattr(each, name) for each in found] for name in ("axis", "omega"))
        return self.top.reaction(axes, omegas, lambda x: x.mpf(ctx))

    @overload
    def at(self, t: npt.ArrayLike, digits: None = None) -> DoubleRecord: ...
    @overload
    def at(self, t: Any, digits: int) -> ExactRecord | tuple[ExactRecord, ...]: ...
    def at(
        self, t: Any, digits: int | None = None
    ) -> DoubleRecord | ExactRecord | tuple[ExactRecord, ...]:
        """Where the top is at the time or times t [s].

        Parameters
        ----------
        t : number or array_like
            Times since the start; negative ones are before it.
        digits : int, optional
            Decimal digits; without it arrays of doubles are returned.

        Returns
        -------
        DoubleRecord or ExactRecord
            Arrays of the shape of t; with `digits` numbers, or a tuple of them when t is many.
            Either has the angles and their rates, `axis`, `quaternion` (body to space, scalar
            first), `omega` in space, and the `energy`.

        Raises
        ------
        NotANumber, Impossible
            A time that is no finite number; digits that are no whole number from 1 to 10 000.
        NoClosedForm
            Beyond 2⁶² periods in doubles, or where an angle is too large for one; with digits,
            where 65 536 bits do not give them.
        """
        if digits is None:
            record = self.double(t)
            record.energy[...] = self._energy
            return record
        form = self.form(digits)
        energy = constants(self.top, self.start, form.ctx.dps).E
        t = t.item() if getattr(t, "ndim", None) == 0 else t
        if isinstance(t, Iterable) and not isinstance(t, str):
            return tuple(replace(form(each), energy=energy) for each in t)
        return replace(form(t), energy=energy)
