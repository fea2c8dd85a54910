"""What the integrator's zeros mean: turning points, reversals and cusps.

A cusp is a double root of phidot, where any root finder reports none, one or two zeros. It is
therefore decided at the turning point, which is a simple root of thetadot, by the size of phidot
there against its rounding; the zeros of phidot around it are its shadows and are dropped.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

EVENTS = ("turning", "reversal", "cusp")
KINDS = ("theta_min", "theta_max", "cusp", "reversal", "turning")
COLUMNS = ("t", "theta", "phi", "phidot", "residual")

EPSILON = 2.0**-52
CUSP_LEVEL = 1.0  # in units of the rounding of phidot, which grows as the root of the steps
BLUR = 1e-9  # of a step: how far from an exact start its own zero may be found
EDGE_LEVEL = 4.0  # ulp of the time, times the root of the number of turning points


@dataclass(frozen=True, slots=True, repr=False)
class Events:
    """Events in the order of the run.

    Attributes
    ----------
    kind : tuple of str, length k
        ``theta_min``, ``theta_max``, ``reversal`` or ``cusp``; `of` gives those of one kind.
    t : ndarray, shape (k,)
        Times [s].
    t_low : ndarray, shape (k,)
        Low words of the times [s].
    theta, phi, phidot : ndarray, shape (k,)
        Tilt, precession [rad] and precession rate [rad/s]; phi is nan where it is not followed.
        Where the exact motion passes through the vertical itself phi is that before or after the
        pass, π apart, and phidot is its limit.
    residual : ndarray, shape (k,)
        The event function at the state found: thetadot sin(theta) or thetadot at a turning
        point, phidot sin^2(theta) or phidot at a reversal, as the formulation has it [rad/s].
    axis : ndarray, shape (k, 3)
    states : ndarray, shape (k, n)
        Full states of the formulation.
    asked : tuple of str
        The kinds of event the scene asked for.
    """

    kind: tuple[str, ...]
    t: Array
    t_low: Array
    theta: Array
    phi: Array
    phidot: Array
    residual: Array
    axis: Array
    states: Array
    asked: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.kind)

    def __repr__(self) -> str:
        counted = ", ".join(f"{self.count(event)} {event}" for event in self.asked)
        return f"<Events: {counted or 'none asked for'}>"

    def table(self, most: int | None = None) -> list[dict[str, Any]]:
        """Return the events, or the first of them, as rows with kind, t, theta, phi, ...

        Parameters
        ----------
        most : int, optional
            How many at most.
        """
        columns = {name: getattr(self, name)[:most].tolist() for name in COLUMNS}
        rows = zip(self.kind[:most], *columns.values(), strict=True)
        return [dict(zip(("kind", *COLUMNS), row, strict=True)) for row in rows]

    def of(self, kind: str) -> Events:
        """Return those of one kind; none where there are none, or it was not asked for.

        Parameters
        ----------
        kind : {"theta_min", "theta_max", "cusp", "reversal", "turning"}
            Which; ``turning`` are the first three.

        Raises
        ------
        ValueError
            Another name.

        Examples
        --------
        >>> import heavytop as ht
        >>> events = ht.propagate(ht.load_scene("sicm-kicked", ["span.periods=2"])).events
        >>> len(events.of("reversal")), events.of("theta_max").kind
        (4, ('theta_max', 'theta_max'))
        """
        if kind not in KINDS:
            raise ValueError(f"kind: one of {', '.join(KINDS)}, not {kind!r}")
        wanted = [k == kind or (kind == "turning" and k != "reversal") for k in self.kind]
        columns = (name for name in self.__slots__ if name not in ("kind", "asked"))
        here = np.array(wanted, dtype=bool)
        kept = {name: getattr(self, name)[here] for name in columns}
        kinds = tuple(k for k, wants in zip(self.kind, wanted, strict=True) if wants)
        return Events(kind=kinds, asked=self.asked, **kept)

    @property
    def is_turning(self) -> NDArray[np.bool_]:
        """Which are turning points, cusps included."""
        return np.array([k != "reversal" for k in self.kind], dtype=bool)

    def count(self, event: str) -> int | None:
        """Return how many ``turning``, ``reversal`` or ``cusp``; None where not asked for.

        Parameters
        ----------
        event : {"turning", "reversal", "cusp"}
            Which; a cusp is a turning point too.

        Raises
        ------
        ValueError
            Another name.
        """
        if event not in EVENTS:
            raise ValueError(f"event: one of {', '.join(EVENTS)}, not {event!r}")
        if event not in self.asked:
            return None
        if event == "turning":
            return int(self.is_turning.sum())
        return sum(k == event for k in self.kind)


@dataclass(frozen=True, slots=True)
class Candidates:
    """Zeros of one event function, with what is needed to judge them.

    `slope` is the time derivative of the event function, `noise` the rounding error of phidot.
    """

    t: Array
    t_low: Array
    states: Array
    phi: Array
    theta: Array
    phidot: Array
    axis: Array
    residual: Array
    slope: Array
    noise: Array

    def where(self, mask: NDArray[np.bool_]) -> Candidates:
        """Return those for which the mask holds."""
        return Candidates(*(getattr(self, name)[mask] for name in self.__slots__))

    def with_start(self, start: Candidates) -> Candidates:
        """Return them with the start in front."""
        pairs = ((getattr(start, n), getattr(self, n)) for n in self.__slots__)
        return Candidates(*(np.concatenate(pair) for pair in pairs))


def within(candidates: Candidates, start: Candidates | None, end: float, step: float) -> Candidates:
    """Return the zeros that belong to the run, those exactly at its edges included.

    One that rounding puts behind the end is at the end.

    Parameters
    ----------
    candidates : Candidates
    start : Candidates or None
        The start itself, length 1, if it is exactly an event: a rounded start is not quite a
        zero, and the finder may report it beside itself, or not at all.
    end : float
        The end of the run [s].
    step : float
        The mean step of the integrator, a measure of how fast things happen [s].
    """
    forward = 1.0 if end >= 0 else -1.0
    margin = EDGE_LEVEL * EPSILON * abs(end) * np.sqrt(candidates.t.size + 1.0)
    kept = candidates.where(forward * candidates.t <= abs(end) + margin)
    t, t_low = ended(kept.t, kept.t_low, end)
    kept = replace(kept, t=t, t_low=t_low)
    if start is None:
        return kept
    off = abs(float(start.residual[0]) / float(start.slope[0])) if start.slope[0] else 0.0
    blur = 16 * off + BLUR * step
    return kept.where(np.abs(kept.t) > blur).with_start(start)


def ended(t: Array, t_low: Array, end: float) -> tuple[Array, Array]:
    """Return times with none behind the end: what rounding put there goes into the low word.

    Parameters
    ----------
    t, t_low : ndarray, shape (k,)
        High and low words [s].
    end : float
        The end of the run [s].
    """
    behind = np.abs(t) > abs(end)
    return np.where(behind, end, t), np.where(behind, (t - end) + t_low, t_low)


def judged(turning: Candidates, reversal: Candidates, asked: Sequence[str], steps: int) -> Events:
    """Return the events among the zeros of thetadot and of phidot, in the order of the run."""
    cusp = np.abs(turning.phidot) <= CUSP_LEVEL * np.sqrt(1.0 + steps) * turning.noise
    real = reversal.where(~_shadows(reversal.t, turning.t, cusp))
    upper = turning.slope > 0
    kinds = np.where(cusp, "cusp", np.where(upper, "theta_min", "theta_max"))
    wanted = np.full(turning.t.size, "turning" in asked) | (cusp & ("cusp" in asked))
    merged = real.where(np.full(real.t.size, "reversal" in asked)).with_start(turning.where(wanted))
    kind = np.concatenate((kinds[wanted], np.full(len(merged.t) - int(wanted.sum()), "reversal")))
    order = np.argsort(np.abs(merged.t), kind="stable")
    m = merged.where(order)  # type: ignore[arg-type]
    return Events(
        kind=tuple(kind[order].tolist()),
        t=m.t,
        t_low=m.t_low,
        theta=m.theta,
        phi=m.phi,
        phidot=m.phidot,
        residual=m.residual,
        axis=m.axis,
        states=m.states,
        asked=tuple(asked),
    )


def _shadows(reversal: Array, turning: Array, cusp: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Tell which zeros of phidot lie nearest to a cusp: a motion with cusps has no others."""
    if turning.size == 0 or reversal.size == 0:
        return np.zeros(reversal.size, dtype=bool)
    t = np.abs(turning)
    right = np.clip(np.searchsorted(t, np.abs(reversal)), 1, max(t.size - 1, 1))
    left = right - 1
    right = np.minimum(right, t.size - 1)
    nearer_left = np.abs(reversal) - t[left] <= t[right] - np.abs(reversal)
    return cusp[np.where(nearer_left, left, right)]
