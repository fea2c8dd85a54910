"""The kinds of motion, and what is said of one motion: its verdict."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Kind(StrEnum):
    """The kinds of motion, in the order in which the first that fits is taken."""

    AT_REST = "at-rest"
    FORCE_FREE = "force-free"
    SLEEPING = "sleeping"
    HANGING = "hanging"
    PLANAR_PENDULUM = "planar-pendulum"
    SEPARATRIX = "separatrix"
    THROUGH_TOP = "through-top"
    THROUGH_BOTTOM = "through-bottom"
    UNIFORM_PRECESSION = "uniform-precession"
    LOOPS = "loops"
    CUSPS = "cusps"
    WAVES = "waves"
    UNDECIDED = "undecided"


@dataclass(frozen=True, slots=True)
class Verdict:
    """What kind of motion it is, and how that is known.

    Parameters
    ----------
    kind : Kind
        The first kind that fits; `Kind.UNDECIDED` where a sign could be neither told nor proved 0.
    tags : tuple of str
        What else holds, proved; first what tells motions of one kind apart.
    open_tags : tuple of str
        Tags that could be neither proved nor disproved.
    certified : bool
        Whether the kind is proved: by balls and identities on the exact numbers of top and start.
    margin : float
        How far the nearest other verdict is: the smallest relative size of a number that was found
        not to be zero on the way (0 … 1).
    margin_enclosure : (float, float)
        Bounds that contain the margin.
    why : str
        The condition that decided.
    bound : str or None
        Where it is undecided: what the number in question, beside its terms, is proved not to
        exceed, as decimal text (it may be smaller than any double).
    """

    kind: Kind
    tags: tuple[str, ...]
    open_tags: tuple[str, ...]
    certified: bool
    margin: float
    margin_enclosure: tuple[float, float]
    why: str
    bound: str | None = None


WHY = {
    Kind.AT_REST: "no part of the top moves, and no torque acts",
    Kind.FORCE_FREE: "gMR = 0",
    Kind.SLEEPING: "the axis stays on the vertical, where V is highest",
    Kind.HANGING: "the axis stays on the vertical, where V is lowest",
    Kind.PLANAR_PENDULUM: "p_phi = p_psi = 0",
    Kind.SEPARATRIX: "the axis tends to the vertical, where V is highest, and never arrives",
    Kind.THROUGH_TOP: "p_phi = p_psi and E' > gMR: theta = 0 is reached",
    Kind.THROUGH_BOTTOM: "p_phi = -p_psi and E' > -gMR: theta = pi is reached",
    Kind.UNIFORM_PRECESSION: "thetadot = 0 and A cos(theta) phidot^2 - p_psi phidot + gMR = 0: "
    "theta is constant",
    Kind.LOOPS: "|p_phi| < |p_psi| and E' > gMR p_phi/p_psi: phidot changes sign",
    Kind.CUSPS: "|p_phi| < |p_psi| and E' = gMR p_phi/p_psi: phidot vanishes at a turning point",
    Kind.WAVES: "phidot keeps its sign",
    Kind.UNDECIDED: "a sign could be neither told nor proved to be zero",
}
