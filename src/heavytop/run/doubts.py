"""What a run is known to be wrong about: events that it miscounts, and digits that it lacks."""

from __future__ import annotations

import warnings

from heavytop.errors import (
    DoubtfulWarning,
    MissedDigitsWarning,
    NoClosedForm,
    UnboundedAngleWarning,
)
from heavytop.integration.outputs import Sample
from heavytop.run.events import EVENTS
from heavytop.run.planning import Plan
from heavytop.run.tally import Counts, differences, tally
from heavytop.run.trajectory import Trajectory
from heavytop.run.witness import missed_digits, run_errors

GLANCED_AT = 16  # samples, before all are held against the closed form
ANGLES = ("theta", "phi", "psi")


def forewarned(chosen: Plan, stacklevel: int = 3) -> None:
    """Warn of what a plan says may disappoint."""
    about = UnboundedAngleWarning if chosen.formulation == "lagrange" else DoubtfulWarning
    for warning in chosen.warnings:
        warnings.warn(warning, about, stacklevel=stacklevel)


def checked(trajectory: Trajectory, stacklevel: int = 3) -> Trajectory:
    """Return a run that reached its end, with a warning of what it is known to be wrong about.

    However it was made, in one piece, continued or resumed, in doubles or in more digits.
    """
    if doubt := doubtful_events(trajectory):
        warnings.warn(doubt, DoubtfulWarning, stacklevel=stacklevel)
    if lack := doubtful_digits(trajectory):
        warnings.warn(lack, MissedDigitsWarning, stacklevel=stacklevel)
    return trajectory


def doubtful_events(trajectory: Trajectory) -> str:
    """Return what was counted otherwise than the exact numbers have it; or nothing."""
    counted = {name: trajectory.events.count(name) for name in EVENTS}
    wrong = "; ".join(differences(missed_events(trajectory), counted))
    return f"events: {wrong} by the exact numbers, which this run does not resolve" if wrong else ""


def missed_events(trajectory: Trajectory) -> Counts:
    """Return the least and the greatest true number of the events that are miscounted, by name."""
    motion, asked = trajectory.motion, trajectory.scene.events
    expected = tally(motion, trajectory.orbit.end, asked) if asked else None
    counted = {name: trajectory.events.count(name) or 0 for name in asked}
    return {
        name: (least, most)
        for name, (least, most) in (expected or {}).items()
        if not least <= counted[name] <= most
    }


def doubtful_digits(trajectory: Trajectory) -> str:
    """Return the wanted quantities that miss their digits; or nothing.

    A run in doubles is glanced at first, which takes a hundredth of its time. What is farther off
    than it may be, be it by the rounding of the scene's numbers alone, is held against its own.
    """
    if trajectory.decimals is None and not _off_at_a_glance(trajectory):
        return ""
    found = missed_digits(trajectory, run_errors(trajectory))
    return missed(found, trajectory.scene.digits) if found else ""


def missed(found: dict[str, float], digits: int) -> str:
    """Return what is farther off the closed form than the digits asked for allow, in words."""
    off = ", ".join(f"{name} {error:.1e}" for name, error in found.items())
    return f"{digits} digits were asked for, and are not met: off the closed form by {off}"


def _off_at_a_glance(trajectory: Trajectory) -> bool:
    """Tell whether a few samples, the last among them, are off the motion of the exact numbers."""
    run: Sample = trajectory.samples
    every = max(1, run.t.size // GLANCED_AT)
    some = slice((run.t.size - 1) % every, None, every)
    try:
        exact = trajectory.motion.double(run.t[some])
    except NoClosedForm:
        return False
    wants, bound = set(trajectory.scene.quantities), 10.0**-trajectory.scene.digits
    if "attitude" in wants:
        wants |= {"phi", "psi", "axis"}
    for name in ANGLES:
        if name in wants:
            end = abs(float(getattr(run, name)[-1]))
            off = abs(getattr(run, name)[some] - getattr(exact, name))
            if not (off <= bound * max(1.0, end)).all():
                return True
    return "axis" in wants and not (abs(run.axis[some] - exact.axis) <= bound / 2).all()
