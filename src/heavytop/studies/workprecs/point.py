"""A point of the diagram: what one method at one setting cost, and how far off it was."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from heavytop.studies.methods import TOLERANCE
from heavytop.studies.workprecs.ladder import Trial


@dataclass(frozen=True, slots=True)
class Point:
    """One method at one setting, as measured.

    Attributes
    ----------
    trial : Trial
    us_per_period : float
        Best time in the blocks of steps, over the periods they covered [µs].
    runs : int
        Runs of which it is the best; where there are two and more, the warm-up is not among them.
    periods : float
        Nutation periods that its blocks covered.
    steps, rhs_evaluations : int
        Of one run, over those periods.
    axis_error : float or None
        Distance of the axis, a unit vector, from the exact one; None where the states do not
        give it.
    theta_error : float
        |Δθ| [rad].
    energy_error : float
        Of E', relative to max(|E'|, gMR).
    setup_s : float
        To derive and to compile, in this process [s].
    """

    trial: Trial
    us_per_period: float
    runs: int
    periods: float
    steps: int
    rhs_evaluations: int
    axis_error: float | None
    theta_error: float
    energy_error: float
    setup_s: float

    @property
    def measures(self) -> str:
        """``axis`` or, where the states do not give the axis, ``theta``, of which `error` is."""
        return "theta" if self.axis_error is None else "axis"

    @property
    def error(self) -> float:
        """The error of the axis, or of theta."""
        return self.theta_error if self.axis_error is None else self.axis_error

    @property
    def wanted_error(self) -> float:
        """The error of what auto was asked for; of a point that is not auto's choice, `error`."""
        return self.theta_error if self.trial.wants == "theta" else self.error

    @property
    def misses(self) -> bool:
        """Whether it is auto's choice, and not as good as was asked."""
        digits = self.trial.digits
        return digits is not None and self.wanted_error > 10.0**-digits

    @property
    def is_rival(self) -> bool:
        """Whether somebody else's method made it."""
        return self.trial.method.is_rival

    def document(self) -> dict[str, Any]:
        """Return the point for JSON."""
        method = self.trial.method
        by_tolerance = method.set_by == TOLERANCE
        found: dict[str, Any] = {
            "method": self.trial.name,
            "formulation": method.formulation,
            "language": method.language,
            "tolerance": method.setting if by_tolerance else None,
            "steps_a_period": None if by_tolerance else method.setting,
            "bits": method.bits,
            "measures": self.measures,
            "rival": self.is_rival,
        }
        names = (
            "us_per_period", "rhs_evaluations", "error", "theta_error", "energy_error", "setup_s",
            "runs", "periods", "steps",
        )  # fmt: skip
        found |= {name: getattr(self, name) for name in names}
        if self.trial.digits is not None:
            found |= {"stands_for": method.text, "wants": self.trial.wants}
            found |= {"digits": self.trial.digits, "missed": self.misses}
        return found


@dataclass(frozen=True, slots=True)
class Skipped:
    """One method at one setting that gave no point, and why.

    Attributes
    ----------
    trial : Trial
        Which one.
    reason : str
        Why.
    """

    trial: Trial
    reason: str

    def document(self) -> dict[str, Any]:
        """Return it for JSON."""
        trial = self.trial
        found: dict[str, Any] = {"method": trial.name}
        if trial.digits is None:
            found["setting"] = {trial.method.set_by: trial.method.setting}
        else:
            found |= {"setting": {"digits": trial.digits}, "wants": trial.wants}
        return found | {"reason": self.reason}
