"""The result of a certificate: proved bounds of the error of a run, at all times."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, Final

from heavytop.errors import Exit
from heavytop.results.base import Result
from heavytop.results.table import Fact, Table
from heavytop.scene.quantities import Quantity, quantity_of

CERTIFIED_QUANTITIES: Final = ("axis", "theta", "phi", "psi")
HEADINGS: Final = {"axis": "axis", "theta": "θ [rad]", "phi": "φ [rad]", "psi": "ψ [rad]"}


class Certificate(Result):
    """Proved bounds of the distance of a run in doubles from the exact motion of its own numbers.

    Attributes
    ----------
    scene : mapping
    formulation : str
    projected : bool
    tolerance : float
        Of a step, relative [1].
    steps : int
    t : float
        The end of the run [s]: the bounds hold for all times from the start to it.
    bound : mapping from str to (float or None)
        Proved bounds of the error at all times: of the axis, a unit vector [1], and of theta, phi,
        psi [rad]. None where there is no bound, as of psi in the axis form, or where the run does
        not follow the angle.
    rounding : mapping from str to (float or None)
        The part of `bound` by which phi and psi are rounded when whole turns and the uniform part
        of a spin are added, in the same units [rad]; 0 of axis and theta.
    observed : mapping from str to (float or None)
        The largest error at the times that were evaluated, before outputs are rounded, in the
        units of `bound` [rad].
    turns : bool or None
        Whether phi and psi are proved to have the right whole turns at all samples; the bounds are
        of the angles but for whole turns. None where no angle is followed that has a bound.
    events : mapping
        Of ``turning``, ``reversal`` and ``cusp`` the ``count``, and whether it is ``proved`` that
        none is missed and none doubled; None where the scene does not ask for them. Proved: no
        time of a turning point or a reversal is off by more than ``time_bound_s`` [s].
    proved : bool
        Whether axis and theta are bounded, and no event is known to be missed or doubled.
    why : tuple of str
        What is not proved, and why.
    """

    schema: ClassVar = "heavytop/certify/1"
    index: ClassVar = ("quantity",)

    scene: Mapping[str, Any]
    formulation: str
    projected: bool
    tolerance: float
    steps: int
    t: float
    bound: Mapping[str, float | None]
    rounding: Mapping[str, float | None]
    observed: Mapping[str, float | None]
    turns: bool | None
    events: Any
    proved: bool
    why: tuple[str, ...] = ()

    def facts(self) -> Iterator[Fact]:
        """Yield the run, its events, and what is not proved."""
        how = "projected" if self.projected else "not projected"
        yield "run", f"{self.formulation} form, {how}, {self.steps} steps, to t = {self.t:.12g} s"
        if self.turns is not None:
            yield "whole turns", "proved" if self.turns else "not proved"
        for event in ("turning", "reversal", "cusp"):
            if (proof := self.events[event]) is not None:
                words = "none missed, none doubled" if proof["proved"] else "not proved"
                yield event, f"{proof['count']}, {words}"
        if (most := self.events["time_bound_s"]) is not None:
            yield "event times", f"off by at most {quantity_of('bound').text(most)} s"
        for reason in self.why:
            yield "why", reason
        proved = [quantity_of(n).symbol for n in CERTIFIED_QUANTITIES if self.bound[n] is not None]
        yield "bounds proved", f"of {', '.join(proved)}" if proved else "none"

    def tables(self) -> Iterator[Table]:
        """Yield the table of the bounds and the largest errors found."""
        rows = [
            {"quantity": HEADINGS[name], "bound": self.bound[name]}
            | {"rounding": self.rounding[name] or None, "observed": self.observed[name]}
            for name in CERTIFIED_QUANTITIES
            if self.observed[name] is not None
        ]
        about = {"quantity": Quantity("", "")}
        yield Table(rows, ("quantity", "bound", "rounding", "observed"), meanings=about)

    def problems(self) -> Iterator[tuple[Exit, str]]:
        """Yield why the run is not `proved`."""
        if not self.proved:
            yield Exit.OUT_OF_BOUND, "; ".join(self.why)
