"""The usual slips: what a trajectory may have been meant to say, where it does not fit as it is."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from heavytop.checking.data import ANGLES, RATES, Array, Data
from heavytop.checking.problem import Comparison, fit
from heavytop.errors import HeavyTopError
from heavytop.scene.state import State
from heavytop.scene.top import Top

SOUGHT: Final = 1e-6  # rad, RMS: what is nearer fits
SMALLER: Final = 100.0  # times, by which a slip makes the error smaller
ALIKE: Final = 3.0  # of slips that are no farther apart the first in the table is meant
TURNED: Final = 0.05  # rad of azimuth, from which on it is counted from another axis
MOST_ROWS: Final = 1000  # that slips are tried on
MOMENTS: Final = 40  # A that are tried

# The data's x, y, z in those of the package.
WORLDS: Final = {
    "z-up": "x y z",
    "y-up": "x z -y",
    "z-down": "x -y -z",
    "y-down": "x -z y",
    "x-up": "z x y",
    "x-down": "-z y x",
}


class Slip(NamedTuple):
    """What the data may have been meant to say.

    Attributes
    ----------
    name : str
        Such as ``degrees`` or ``y-up``.
    sentence : str
        The same for a person, with its numbers.
    error_before, error_after : float or None
        The RMS error of the data as they are [rad], None where they fit no motion, and that which
        is left.
    digits : float
        The decimal digits that the data have without it.
    """

    name: str
    sentence: str
    error_before: float | None
    error_after: float
    digits: float


class _Tried(NamedTuple):
    name: str
    sentence: str
    problem: Comparison


def find_slip(problem: Comparison) -> Slip | None:
    """The slip that makes the error at least a hundred times smaller, if there is one."""
    data = problem.data
    some = replace(problem, data=data.some(slice(None, None, -(-data.t.size // MOST_ROWS))))
    if some.misfit <= SOUGHT:
        return None
    for table in (SLIPS, (_inertia,)):  # the fit, which takes longer, where nothing else is found
        tried = [each for slip in table for each in slip(some)]
        enough = [x for x in tried if x.problem.misfit * SMALLER <= some.misfit < np.inf]
        enough += [x for x in tried if x.problem.misfit <= SOUGHT and some.misfit == np.inf]
        if enough:
            least = min(each.problem.misfit for each in enough)
            best = next(x for x in enough if x.problem.misfit <= ALIKE * least)
            left = max(best.problem.misfit, 2.0**-53)
            before = some.misfit if some.misfit < np.inf else None
            return Slip(best.name, best.sentence, before, left, best.problem.digits)
    return None


# --- the table: what each slip would make of a problem -------------------------------------------


def _told(problem: Comparison, **told: Array | None) -> Comparison:
    return replace(problem, data=problem.data.telling(**told))


def _degrees(problem: Comparison) -> Iterator[_Tried]:
    names = problem.data.told.keys() & {*ANGLES, *RATES}
    if names:
        told = {name: np.radians(problem.data.told[name]) for name in names}
        yield _Tried("degrees", "the angles are in degrees", _told(problem, **told))


def _order(problem: Comparison) -> Iterator[_Tried]:
    if (q := problem.data.told.get("quaternion")) is not None:
        words = "the quaternion is x, y, z, w: its scalar stands last"
        yield _Tried("quaternion-xyzw", words, _told(problem, quaternion=np.roll(q, 1, axis=1)))


def _inverse(problem: Comparison) -> Iterator[_Tried]:
    if problem.data.matrix is not None:
        matrix = np.swapaxes(problem.data.matrix, 1, 2)
        words = "the rotation leads from space to body: its inverse is from body to space"
        other = _told(problem, matrix=matrix, quaternion=None, axis=None)
        yield _Tried("inverse-rotation", words, other)


def _milliseconds(problem: Comparison) -> Iterator[_Tried]:
    data = replace(problem.data, t=problem.data.t / 1000)
    yield _Tried("milliseconds", "the times are in milliseconds", replace(problem, data=data))


def _held(problem: Comparison) -> Iterator[_Tried]:
    if problem.given is None:
        return
    start = problem.given
    values = {name: getattr(start, name) for name in (*ANGLES, "thetadot", "phidot")}
    held, other = start.held, "omega3" if start.held == "psidot" else "psidot"
    words = f"the spin of the scene's start was taken for {other}, and it is {held}"
    swapped = State(**values, **{other: getattr(start, held)})
    yield _Tried("spin-held", words, replace(problem, given=swapped))


def _gravity(problem: Comparison) -> Iterator[_Tried]:
    top = problem.top
    words = "gravity has the other sign: gMR and −gMR are exchanged"
    opposite = Top.of_numbers(top.A, top.C, -top.gMR)
    yield _Tried("gravity-sign", words, replace(problem, top=opposite))


def _worlds(problem: Comparison) -> Iterator[_Tried]:
    """Right-handed maps of the data's space onto the package's, about the vertical as it fits."""
    if problem.data.axis is None:
        return
    for name, spelled in WORLDS.items():
        world = _matrix(spelled)
        bodies = [np.eye(3)] if problem.data.matrix is None else [np.eye(3), world]
        for body in bodies:
            turned = replace(problem, data=_turned(problem.data, world.T, body))
            azimuth = _azimuth(turned)
            c, s = np.cos(azimuth), np.sin(azimuth)
            about = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
            letters = ", ".join(spelled.replace("-", "−").split())
            words = f"the data's x, y, z are the package's {letters}"
            if abs(azimuth) < TURNED:
                about = np.eye(3)
                if name == "z-up":
                    continue
            else:
                words += f", turned by {np.degrees(azimuth):.1f}° about the vertical"
            final = replace(problem, data=_turned(problem.data, about @ world.T, body))
            yield _Tried("azimuth-origin" if name == "z-up" else name, words, final)


def _matrix(spelled: str) -> Array:
    """What takes the package's x, y, z to the data's."""
    rows = np.zeros((3, 3))
    for i, word in enumerate(spelled.split()):
        rows[i, "xyz".index(word[-1])] = -1 if word[0] == "-" else 1
    return rows


def _turned(data: Data, space: Array, body: Array) -> Data:
    """The data in another space, and of a body whose axis is another one of its own."""
    told = {"omega": data.omega @ space.T} if data.omega is not None else {}
    if data.matrix is not None:
        told["matrix"] = space @ data.matrix @ body
    elif data.axis is not None:
        told["axis"] = data.axis @ space.T
    return replace(data, told=told)


def _azimuth(problem: Comparison) -> float:
    """By how much the data are turned about the vertical to fit best [rad]."""
    if problem.given is None or problem.data.axis is None:  # the start is the data's own
        return 0.0
    x, y, _ = problem.data.axis.T
    u, v, _ = problem.exact.axis.T
    return float(np.arctan2((x * v - y * u).sum(), (x * u + y * v).sum()))


def _inertia(problem: Comparison) -> Iterator[_Tried]:
    """A smaller A, as that about the centre of mass is: tried on the first period, then fitted."""
    if problem.origin == "fitted":
        return
    top, data = problem.top, problem.data
    A = float(top.A)
    period = problem.motion.period or np.inf
    rows = max(20, int(np.searchsorted(abs(problem.since), period)))

    def tried(p: Array, rows: int) -> Comparison:
        return Comparison(
            data.some(slice(0, rows)), Top.of_numbers(p[0], top.C, top.gMR), problem.given
        )

    try:
        least = max(float(top.C) / 2, A / 100)
        moments = np.geomspace(least * (1 + 1e-9), A * (1 - 1e-3), MOMENTS)[:, None]
        best = min(moments, key=lambda p: tried(p, rows).misfit)
        found = fit(tried, best, data.t.size)
    except HeavyTopError:
        return
    if found[0] < A:
        words = (
            f"A is {found[0]:.6g}, not {A:.6g}: it is about the centre of mass, and not about the "
            f"pivot, if mass times distance squared is {A - found[0]:.4g}"
        )
        yield _Tried("inertia-about-centre", words, tried(found, data.t.size))


SLIPS: Final[tuple[Callable[[Comparison], Iterator[_Tried]], ...]] = (
    _degrees,
    _milliseconds,
    _order,
    _inverse,
    _held,
    _worlds,
    _gravity,
)
