"""The result of a certificate: proved bounds of the error of a run, over all of its times."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

from heavytop.results.base import Number, Part, Problem, Result, Text

QUANTITIES: Final = ("axis", "theta", "phi", "psi")


@dataclass(frozen=True, kw_only=True)
class EventProof(Part):
    """The events of one kind that a run has.

    Attributes
    ----------
    count : int
    proved : bool or None
        Whether none is missed and none doubled; None where nothing was asked.
    """

    count: int
    proved: bool | None = None


@dataclass(frozen=True, kw_only=True)
class ProvedEvents(Part):
    """The events that the scene asks for, each kind of them.

    Attributes
    ----------
    turning, reversal, cusp : EventProof or None
        None where the scene does not ask for them.
    time_bound_s : float or None
        Proved: no time of a turning point or a reversal is off by more [s].
    """

    turning: EventProof | None = None
    reversal: EventProof | None = None
    cusp: EventProof | None = None
    time_bound_s: Number | None = None


@dataclass(frozen=True, kw_only=True)
class Certificate(Result):
    """What is proved of a run in doubles: how far it is from the exact motion of its own numbers.

    Attributes
    ----------
    scene : Problem
    formulation : str
    projected : bool
    tolerance : float
        Of a step, relative [1].
    steps : int
    t : float
        The end of the run [s]: the bounds hold for all times from the start to it.
    bound : dict from str to (float or None)
        Proved: at no time is the error larger. Of the axis, as a length, and of theta, phi, psi
        [rad]. None where there is no bound, or where the run does not follow the angle.
    rounding : dict from str to (float or None)
        The part of `bound` by which phi and psi are rounded when whole turns and the uniform part
        of a spin are added, and by which psi drifts as its momentum is rounded, in the same units
        [rad]; 0 of axis and theta.
    observed : dict from str to (float or None)
        The largest error at the times that were looked at, before outputs are rounded, in the
        units of `bound` [rad].
    turns : bool or None
        Whether the whole turns of phi and psi are proved too; else the bounds are of the angles
        but for whole turns.
    events : ProvedEvents
    proved : bool
        Whether axis and theta are bounded, and no event is known to be missed or doubled.
    why : tuple of str
        What is not proved, and why.
    """

    schema: Literal["heavytop/certify/1"] = "heavytop/certify/1"
    scene: Problem
    formulation: Text
    projected: bool
    tolerance: Number
    steps: int
    t: Number
    bound: Mapping[Text, Number | None]
    rounding: Mapping[Text, Number | None]
    observed: Mapping[Text, Number | None]
    turns: bool | None
    events: ProvedEvents
    proved: bool
    why: tuple[Text, ...] = ()
