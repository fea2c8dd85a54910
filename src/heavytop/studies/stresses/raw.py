"""What one run gave, before it is judged."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Raw:
    """What one run gave.

    Attributes
    ----------
    ending : str
        ``finished``, or what stopped it: ``refused``, ``singular``, ``failed``, ``step-limit``.
    said : str
        What it said of that, or of a doubt.
    t : float
        The time reached [s].
    steps : int
    smallest : float or None
        Its shortest step; of the Taylor integrator, the shortest mean of a block of them [s].
    axis : tuple of 3 float, or None
        At the end; None where the formulation gives the tilt alone.
    theta : float or None
    angles : (float, float), or None
        phi and psi at the end, where the run follows them [rad].
    energy : float or None
        How far E' is off its start, relative to max(|E'|, gMR).
    moved : float
        How far from its start the axis, or the tilt, has gone.
    counted : dict from str to int
        Events.
    plan : str
        What auto chose.
    more_bits : bool
        Whether it had more than doubles have.
    resting : bool
        Whether its rate has vanished, and it stays where it is.
    """

    ending: str
    said: str = ""
    t: float = 0.0
    steps: int = 0
    smallest: float | None = None
    axis: tuple[float, float, float] | None = None
    theta: float | None = None
    angles: tuple[float, float] | None = None
    energy: float | None = None
    moved: float = 0.0
    counted: dict[str, int] = field(default_factory=dict)
    plan: str = ""
    more_bits: bool = False
    resting: bool = False
