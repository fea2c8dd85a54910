"""What a case allows: where the axis truly is at the end, and what an ulp of the start does to it.

The condition is that of the axis form, which has no poles: the largest of its state-transition
matrices to the end, from the start and from times on the way, where rounding is as bad; each state
and constant counts in its natural size, the length of the axis or of the angular momentum. Beyond
a hundred periods it is taken to grow as the time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from heavytop.analytic.motion import Motion
from heavytop.integration.compiled import VariedRun
from heavytop.run.events import Counts, tally
from heavytop.run.planning import closed_form_of, plan, span
from heavytop.run.sensitivities import varied_run
from heavytop.scene.scene import Scene
from heavytop.studies.stress_cases import cases

Array = NDArray[np.float64]
UNIT: Final = 2.0**-53
ROUNDINGS: Final = 16  # of the start, of constants and of steps, that every method may make
FOLLOWED: Final = 100  # periods
LOOKS: Final = 65  # times at which the matrix is taken,
RESTART: Final = 8  # and after so many of them it is taken anew
SHARP: Final = 0.1  # of a small tilt's time to grow by e: how far apart, at most, finer looks are
AXIS: Final = 2.0  # how far apart two axes can be


@dataclass(frozen=True, slots=True)
class CaseReference:
    """The truth of a case, and how well it can be known in doubles.

    Attributes
    ----------
    end : float
        The time that counts [s].
    theta : float
        Tilt there [rad].
    axis : tuple of 3 float
    condition : float
        How much larger than a relative error on the way that of the axis can be, at least 1.
    moved : float
        How far the axis is from where it was, at most 2.
    counts : mapping from str to (int, int), or None
        How many events there are.
    period : float or None
        Of the nutation [s].
    leaves : float or None
        When rounding in doubles has left nothing of the axis [s].
    angles : (float, float)
        phi and psi at the end [rad].
    """

    end: float
    theta: float
    axis: tuple[float, float, float]
    condition: float
    moved: float
    counts: Counts | None
    period: float | None
    leaves: float | None
    angles: tuple[float, float] = (0.0, 0.0)

    def of_angles(self) -> CaseReference:
        """Return what the case allows to phi and psi: the axis over sinθ, and the angles' own size.

        The last is what a rounding of the spin does to them.
        """
        sine = math.hypot(*self.axis[:2])
        growth = self.condition / sine if sine else math.inf
        return replace(self, condition=growth + sum(map(abs, self.angles)))

    @property
    def allowed(self) -> float:
        """The error of the axis that doubles cannot help."""
        return min(ROUNDINGS * UNIT * self.condition, AXIS)

    @property
    def digits(self) -> float:
        """Decimal digits of the axis that the condition leaves."""
        return math.log10(AXIS / self.allowed)

    @property
    def hopeless(self) -> bool:
        """Whether the condition leaves no digits: what is then right in doubles is so by chance."""
        return self.allowed >= AXIS

    def digits_lost(self, error: float) -> float:
        """Decimal digits of an error beyond what the condition allows; not negative.

        Examples
        --------
        >>> here = CaseReference(1.0, 0.1, (0.0, 0.1, 1.0), 1.0, 1.0, None, None, None)
        >>> here.digits_lost(0.0), round(here.digits_lost(1.776e-13), 2)
        (0.0, 2.0)
        """
        return max(0.0, math.log10(error / self.allowed)) if error > 0 else 0.0


@cache
def reference(name: str) -> CaseReference:
    """Return the truth of a case, by its name."""
    scene = cases()[name].scene
    motion = closed_form_of(scene)
    end = span(scene, motion)
    exact, start = motion.exact(end), motion.exact(0)
    x, y, z = map(float, exact.axis)
    condition, leaves = _followed(scene, motion, end)
    return CaseReference(
        end=end,
        theta=float(exact.theta),
        axis=(x, y, z),
        condition=max(1.0, condition),
        moved=math.dist((x, y, z), tuple(map(float, start.axis))),
        counts=tally(motion, end) if cases()[name].counted else None,
        period=motion.period,
        leaves=leaves,
        angles=(float(exact.phi), float(exact.psi)),
    )


def _followed(scene: Scene, motion: Motion, end: float) -> tuple[float, float | None]:
    """The condition of the axis at the end, and the time at which doubles have nothing left."""
    longest = FOLLOWED * motion.period if motion.period else math.inf
    reach = min(abs(end), longest)
    times = np.linspace(0.0, math.copysign(reach, end), LOOKS)
    varied = varied_run(scene, plan(scene, "axis"))
    sizes, states = _sizes(varied, times)
    later = [
        _sizes(replace(varied, state=states[k]), times[-1:] - times[k])[0]
        for k in range(RESTART, min(len(states), LOOKS - 1), RESTART)
    ]
    worst = max(float(size[-1]) for size in (sizes, *later))
    return worst * abs(end) / reach, _lost(varied, times, sizes)


def _lost(varied: VariedRun, times: Array, sizes: Array) -> float | None:
    """When a rounding of the start has grown to all there is, if it has at a time of a grid.

    It grows and shrinks again as the axis nears the vertical and leaves it, so that only a grid
    finer than that tells when it has first grown so much.
    """
    lost = np.flatnonzero(sizes * ROUNDINGS * UNIT >= 1.0)
    if not lost.size:
        return None
    late, spacing = float(times[lost[0]]), SHARP / math.sqrt(abs(varied.constants["g"]))
    finer = np.linspace(0.0, late, max(2, math.ceil(abs(late) / spacing)))
    found = _sizes(varied, finer)[0]
    return float(finer[np.argmax(found * ROUNDINGS * UNIT >= 1.0)])


def _sizes(varied: VariedRun, times: Array) -> tuple[Array, Array]:
    """The condition of the axis at times since a start, inf at the last if it overflows; states."""
    found = varied(times.tolist())
    found = found[np.isfinite(found[:, 0, 0])]  # before the derivatives have overflowed
    size = math.hypot(*varied.state[3:5], varied.constants["l_z"])
    scale = np.array([1.0, 1.0, 1.0, size, size, abs(varied.constants["g"]), size])
    sizes = np.sqrt(((found[:, :3, 1:] * scale) ** 2).sum(axis=(1, 2)))
    if len(sizes) < len(times):
        sizes = np.append(sizes, math.inf)
    return sizes, found[:, :, 0]
