"""The conventions that data may be written in: each row says how to undo one.

Rows stand in the order in which conventions are undone. An undo gives comparisons as they would be
without the convention, each with the words that go into its sentence.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Final, NamedTuple

import numpy as np

from heavytop.checking.comparison import (
    ANGLES,
    RATES,
    Comparison,
    axes,
    decades,
    norm,
    octaves,
    wrapped,
)
from heavytop.checking.reading import Array
from heavytop.errors import HeavyTopError
from heavytop.scene.state import State
from heavytop.scene.top import Top

TURNED: Final = 0.02  # rad, from which on an angle is counted from another origin
UPRIGHT: Final = 0.05  # sin θ below which an azimuth is not read off
AHEAD: Final = 0.5  # decades, by which another number has to explain more
EIGHT: Final = np.geomspace(1, 1 / 128, 8)
SLOW: Final = 0.1  # of the largest angular velocity: rates below it are changed by as much
TILTED: Final = 0.2  # of cos θ: a world whose first row is off by more is another one
QUARTER: Final = np.pi / 2
Undone = Iterator[tuple[str, Comparison]]


class Convention(NamedTuple):
    """A name, a sentence with a place for words of the undo, and the undo."""

    name: str
    sentence: str
    undo: Callable[[Comparison], Undone]
    physics: bool = False  # whether the motion is another one, not its description
    cost: float = 1.0  # above 1 where it stands back behind others that do the same
    rare: bool = False  # not tried in pairs, but on top of the best


# --- time ----------------------------------------------------------------------------------------


def _scaled_time(*factors: float) -> Callable[[Comparison], Undone]:
    def undo(c: Comparison) -> Undone:
        for factor in factors:
            yield f"{factor:g}", replace(c, data=replace(c.data, t=c.data.t * factor))

    return undo


def _time_origin(c: Comparison) -> Undone:
    first = float(c.data.t[0])
    if c.given is not None and first:
        yield f"{first:g}", replace(c, data=replace(c.data, t=c.data.t - first))


# --- the motion ----------------------------------------------------------------------------------


def _start(c: Comparison, **changed: Any) -> Comparison:
    spin = () if changed.keys() & {"psidot", "omega3"} else (c.start.held,)
    names = (*ANGLES, "thetadot", "phidot", *spin)
    values = {name: getattr(c.start, name) for name in names} | changed
    return replace(c, given=State(**{name: float(x) for name, x in values.items()}))


def _with_top(c: Comparison, **numbers: float) -> Comparison:
    values = {name: float(getattr(c.top, name)) for name in ("A", "C", "gMR")} | numbers
    return replace(c, top=Top.of_numbers(**values))


def _spin_held(c: Comparison) -> Undone:
    if c.given is not None:
        other = "omega3" if c.given.held == "psidot" else "psidot"
        yield (
            f"{c.given.held} of the scene was taken for {other}",
            _start(c, **{other: c.given.spin}),
        )


def _spin_sign(c: Comparison) -> Undone:
    if c.given is not None and c.given.spin != 0:
        yield "the body spins the other way round", _start(c, **{c.given.held: -c.given.spin})
    if "psi" in c.data.values or "psidot" in c.data.values:
        yield "ψ is counted the other way round", c.updated(**_negated(c, "psi"))


def _top(
    change: Callable[[float, float, float], dict[str, float]],
) -> Callable[[Comparison], Undone]:
    def undo(c: Comparison) -> Undone:
        there = _with_top(c, **change(float(c.top.A), float(c.top.C), float(c.top.gMR)))
        if there.top != c.top and float(there.top.C) >= 0:
            yield "", there

    return undo


# --- units and orders ----------------------------------------------------------------------------


def _degrees(c: Comparison) -> Undone:
    angles = [x for x in (*ANGLES, "elevation") if x in c.data.values]
    rates = [x for x in (*RATES, "elevationdot") if x in c.data.values]
    spins = [x for x in ("omega", "omega_body") if x in c.data.values]
    groups = {"angles": angles, "angles and rates": angles + rates}
    groups |= {"rates": rates, "ω": spins, "angles, rates and ω": angles + rates + spins}
    seen = set()
    for words, names in groups.items():
        if names and (key := tuple(names)) not in seen:
            seen.add(key)
            yield words, c.updated(**{x: np.radians(c.data.values[x]) for x in names})


def _rpm(c: Comparison) -> Undone:
    for names in (RATES, ("psidot",), ("omega",), ("omega_body",)):
        there = [name for name in names if name in c.data.values]
        if there and not (len(names) == 1 and len(there) == len(c.data.values.keys() & {*RATES})):
            scaled = {x: c.data.values[x] * (2 * np.pi / 60) for x in there}
            yield ", ".join(there), c.updated(**scaled)


def _scalar_last(c: Comparison) -> Undone:
    if (q := c.data.values.get("quaternion")) is not None:
        yield "", c.updated(quaternion=np.roll(q, 1, axis=1))


def _omega_frame(c: Comparison) -> Undone:
    for name, other, words in (
        ("omega", "omega_body", "in the body, not in space"),
        ("omega_body", "omega", "in space, not in the body"),
    ):
        if name in c.data.values and other not in c.data.values:
            yield words, c.updated(**{other: c.data.values[name], name: None})


def _omega_sign(c: Comparison) -> Undone:
    names = [x for x in ("omega", "omega_body") if x in c.data.values]
    if names:
        yield "", c.updated(**{x: -c.data.values[x] for x in names})


def _inverse(c: Comparison) -> Undone:
    if c.matrix is not None:
        yield "", c.updated(matrix=np.swapaxes(c.matrix, 1, 2), quaternion=None)


# --- angles --------------------------------------------------------------------------------------


def _negated(c: Comparison, *names: str) -> dict[str, Array]:
    both = [x for name in names for x in (name, f"{name}dot") if x in c.data.values]
    return {x: -c.data.values[x] for x in both}


def _exchanged(c: Comparison) -> Undone:
    for names, others in (
        (("phi", "psi"), ("psi", "phi")),
        (("theta", "phi"), ("phi", "theta")),
        (("theta", "psi"), ("psi", "theta")),
        (ANGLES, ("phi", "psi", "theta")),
        (ANGLES, ("psi", "theta", "phi")),
    ):
        swapped = {
            n + dot: c.data.values.get(o + dot)
            for n, o in zip(names, others, strict=True)
            for dot in ("", "dot")
        }
        there = {x for x in swapped if x in c.data.values}
        if there and there == {x for x, values in swapped.items() if values is not None}:
            words = ", ".join(f"{o} is {n}" for n, o in zip(names, others, strict=True))
            yield words, c.updated(**swapped)


def _elevation(c: Comparison) -> Undone:
    if "theta" in c.data.values:
        flipped = _negated(c, "theta") | {"theta": QUARTER - c.data.values["theta"]}
        yield "", c.updated(**flipped)


def _from_below(c: Comparison) -> Undone:
    values = c.data.values
    if "theta" in values:
        yield "", c.updated(**_negated(c, "theta") | {"theta": np.pi - values["theta"]})
    if "elevation" in values:
        yield "", c.updated(**_negated(c, "elevation"))


# --- worlds --------------------------------------------------------------------------------------

WORLDS: Final = {  # the data's x, y, z in those of the package
    "": "x y z",
    "y-up": "x z -y",
    "z-down": "x -y -z",
    "y-down": "x -z y",
    "x-up": "z x y",
    "x-down": "-z y x",
}
UPSIDE: Final = ", the body's axis too"
MIRROR: Final = np.diag([1.0, -1.0, 1.0])


def _world(spelled: str) -> Array:
    """What takes the package's x, y, z to the data's."""
    rows = np.zeros((3, 3))
    for i, word in enumerate(spelled.split()):
        rows[i, "xyz".index(word[-1])] = -1 if word[0] == "-" else 1
    return rows


def _letters(world: Array) -> str:
    """The package's axes that the data's x, y, z are."""
    names = ("−" * int(row.sum() < 0) + "xyz"[int(abs(row).argmax())] for row in world)
    return f"the data's x, y, z are the package's {', '.join(names)}"


def _about(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def _turned(c: Comparison, space: Array, body: Array) -> Comparison:
    """The data in another space, `space` e, and of a body with other axes, R `body`."""
    values, turned = c.data.values, {}
    if c.matrix is not None:
        turned = {"matrix": space @ c.matrix @ body, "quaternion": None}
    if "axis" in values:
        turned["axis"] = values["axis"] @ space.T
    improper = np.sign(np.linalg.det(space))
    if "omega" in values:
        turned["omega"] = improper * values["omega"] @ space.T
    for name in ("omega_body", "momentum_body"):
        if name in values:
            turned[name] = np.sign(np.linalg.det(body)) * values[name] @ body
    if "vertical" in values:
        turned["vertical"] = values["vertical"] @ body
    return c.updated(**turned)


def _worlds(names: tuple[str, ...], mirrored: bool) -> Callable[[Comparison], Undone]:
    def undo(c: Comparison) -> Undone:
        values = c.data.values
        if not values.keys() & {"axis", "matrix", "quaternion", "vertical"}:
            if names == ("",):
                yield "φ and ψ count the other way round", c.updated(**_negated(c, "phi", "psi"))
                if {"phi", "psi"} <= values.keys():
                    yield "φ counts the other way round", c.updated(**_negated(c, "phi"))
            return
        for name in names:
            up = _world(WORLDS[name])
            space = MIRROR @ up.T if mirrored else up.T
            bodies = [(space.T, True), (np.eye(3), False)]
            if c.matrix is None and not values.keys() & {"omega_body", "vertical"}:
                bodies = bodies[1:]
            elif c.matrix is not None and mirrored and np.linalg.det(c.matrix[0]) > 0:
                bodies = bodies[:1]
            for body, carried in bodies:
                there = _turned(c, space, body)
                if not _upright(there):
                    continue
                down = UPSIDE if carried and name in ("y-down", "x-down") else ""
                yield f"{_letters(space.T)}{down}", there
                quarter = round(_azimuth(there) / QUARTER) * QUARTER
                if quarter:
                    about = np.rint(_about(quarter))
                    other = _turned(there, about, about.T if carried else np.eye(3))
                    yield f"{_letters((about @ space).T)}{down} ", other
            if not mirrored and c.matrix is not None:
                there = _turned(c, np.eye(3), up)
                if _upright(there):
                    yield f"{_letters(up)} in the body", there

    return undo


def _upright(c: Comparison) -> bool:
    """Whether the first row may have the tilt of the start, which no azimuth changes."""
    if c.axis is None or c.given is None or c.since[0]:
        return True
    return bool(abs(c.axis[0, 2] - np.cos(float(c.given.theta))) < TILTED)


def _azimuth(c: Comparison) -> float:
    """By how much the first rows have to be turned about the vertical [rad]."""
    mine = c.axis
    if mine is None or c.given is None:
        return 0.0
    other = c.exact.axis
    across = np.minimum(norm(mine[:, :2]), norm(other[:, :2]))
    row = int(np.argmax(across > min(UPRIGHT, float(across.max()))))
    (x, y), (u, v) = mine[row, :2], other[row, :2]
    return float(np.arctan2(x * v - y * u, x * u + y * v))


# --- origins -------------------------------------------------------------------------------------


def _azimuth_origin(c: Comparison) -> Undone:
    if c.given is None:
        return
    vectors = c.data.values.keys() & {"axis", "matrix", "quaternion", "omega"}
    shift = 0.0
    if vectors and c.axis is not None:
        shift = _azimuth(c)
        if abs(shift) > TURNED:
            yield f"{np.degrees(shift):.4g}", _turned(c, _about(shift), np.eye(3))
            if c.matrix is not None:  # the axes of the body are turned with those of space
                words = (
                    f"{np.degrees(shift):.4g}° in space and in the body: {np.degrees(shift):.4g}"
                )
                yield words, _turned(c, _about(shift), _about(-shift))
    if "phi" in c.data.values:
        sine = np.sin(c.exact.theta)
        row = int(np.argmax(sine > min(UPRIGHT, float(sine.max()) / 2)))
        other = float(wrapped(c.exact.phi_mod[row] - c.data.values["phi"][row]))
        if abs(other) > TURNED:
            moved = c.updated(phi=c.data.values["phi"] + other)
            yield f"{np.degrees(other):.4g}", moved
            if vectors and abs(shift) > TURNED:
                yield f"{np.degrees(shift):.4g}", _turned(moved, _about(shift), np.eye(3))


def _spin_origin(c: Comparison) -> Undone:
    if c.given is None:
        return
    if c.matrix is not None or "vertical" in c.data.values:
        if c.matrix is not None:
            between = c.matrix[0].T @ c.reference.rotation[0]
            shift = float(np.arctan2(between[1, 0] - between[0, 1], between[0, 0] + between[1, 1]))
        else:
            shift = float(wrapped(c.exact.psi_mod[0] - c.angle("psi")[0]))
        if abs(shift) > TURNED:
            yield f"{np.degrees(shift):.4g}", _turned(c, np.eye(3), _about(shift))
    if "psi" in c.data.values:
        row = int(np.argmax(np.sin(c.exact.theta) > UPRIGHT))
        shift = float(wrapped(c.exact.psi_mod[row] - c.data.values["psi"][row]))
        if abs(shift) > TURNED:
            yield f"{np.degrees(shift):.4g}", c.updated(psi=c.data.values["psi"] + shift)


def _axis_with_spin(c: Comparison) -> Undone:
    axis = c.data.values.get("axis")
    if axis is None or c.given is None:
        return
    psi, phi = (c.data.values.get(name, c.reference.angle(name)) for name in ("psi", "phi"))
    azimuth = np.arctan2(axis[:, 0], -axis[:, 1])
    for sign, words in ((1, "with ψ"), (-1, "against ψ")):
        origin = azimuth[0] - sign * psi[0]
        theta = np.arctan2(norm(axis[:, :2]), axis[:, 2])
        yield words, c.updated(axis=axes(theta, phi + azimuth - sign * psi - origin))


# --- numbers of the problem ----------------------------------------------------------------------

SMALLER: Final = {"A": (5.0, 0.0)}  # between C/2, where all mass is far out, and A
OTHERS: Final = {"A": (0.0, 1.0)} | dict.fromkeys(
    ("C", "gMR", "the clock", "the time of the first row", "theta", "thetadot", "phidot", "spin"),
    (1.0, 1.0),
)


def _changed(c: Comparison, name: str, x: float) -> tuple[float, Comparison]:
    """One number changed by x, most by a factor 2^x, rates by x of twice what is usual."""
    factor, t = 2.0**x, c.data.t
    if name == "the clock":
        return factor, replace(c, data=replace(c.data, t=t * factor))
    if name == "the time of the first row":
        shift = x * (c.motion.period or float(t[-1]))
        return shift, replace(c, data=replace(c.data, t=t + shift))
    if name in ("A", "C", "gMR"):
        least = float(c.top.C) / 2 if name == "A" else 0.0
        value = least + (float(getattr(c.top, name)) - least) * factor
        return value, _with_top(c, **{name: value})
    key = c.given.held if name == "spin" and c.given else name
    value = float(getattr(c.given, key))
    if name == "theta":
        value = float(np.clip(value + x / 2, 0, np.pi))
    else:
        value += 2.2 * x * max(abs(value), SLOW * c.reference.fastest)
    return value, _start(c, **{key: value})


def _numbers(bounds: Mapping[str, tuple[float, float]]) -> Callable[[Comparison], Undone]:
    """Each number as it fits best, where it explains anything."""

    def undo(c: Comparison) -> Undone:
        if c.given is None:
            return
        windows = octaves(c.data.t.size)
        some = c.rows(windows.rows)

        def misfit(x: float, name: str) -> float:
            try:
                return sum(decades(_changed(some, name, x)[1], windows).values())
            except HeavyTopError:
                return np.inf

        here = misfit(0.0, "C")
        for name, (down, up) in bounds.items():
            grid = [*-EIGHT * down, 0.0, *EIGHT[::-1] * up]
            x, left = _smallest(partial(misfit, name=name), grid, here - AHEAD)
            if left < here - AHEAD:
                value, there = _changed(c, name, x)
                yield f"{name} = {value:.6g}", there

    return undo


def _smallest(
    f: Callable[[float], float], grid: Sequence[float], wanted: float
) -> tuple[float, float]:
    """Where a function is smallest, from a grid and, if it is small there, by Brent's method."""
    from scipy.optimize import minimize_scalar

    values = [f(x) for x in grid]
    k = int(np.argmin(values))
    if values[k] > wanted + AHEAD or not grid[k]:
        return grid[k], values[k]
    sides = (grid[max(0, k - 1)], grid[min(len(grid) - 1, k + 1)])
    found = minimize_scalar(f, bounds=sides, method="bounded", options={"xatol": 1e-10})
    return float(found.x), float(found.fun)


ANOTHER_MOTION: Final = {  # names that the start, or another number, may have as well
    *("azimuth-origin", "spin-origin", "spin-held", "spin-sign", "time-scale", "gravity-sign"),
    *("gyroscopic-sign", "no-gyroscopic-term", "inertia-about-centre"),
}
_SCALES: Final = (10, 0.1, 60, 1 / 60, 1e-6, 1 / 30, 1 / 25, 1 / 50, 1 / 100)
_PERMUTED: Final = ("y-down", "x-up", "x-down")

TABLE: Final = (
    Convention("time-origin", "the start of the scene is the first row, at t = {} s", _time_origin),
    Convention("milliseconds", "the times are in milliseconds{:.0}", _scaled_time(1e-3)),
    Convention("time-scale", "time runs backwards: {}", _scaled_time(-1), cost=1.5, rare=True),
    Convention("time-scale", "the times have to be multiplied by {}", _scaled_time(2, 0.5)),
    Convention("time-scale", "the times need the factor {}", _scaled_time(*_SCALES), rare=True),
    Convention("gravity-sign", "gravity has the other sign: gMR and −gMR are exchanged{}",
               _top(lambda A, C, gMR: {"gMR": -gMR}), True, 1.3),
    Convention("spin-held", "the spin: {}", _spin_held, True),
    Convention("spin-sign", "the spin has the other sign: {}", _spin_sign, True),
    Convention("gyroscopic-sign", "the gyroscopic term of Euler's equations has the wrong sign{}",
               _top(lambda A, C, gMR: {"C": 2 * A - C}), True),
    Convention("no-gyroscopic-term", "the gyroscopic term of Euler's equations is missing{}",
               _top(lambda A, C, gMR: {"C": A}), True),
    Convention("degrees", "{} are in degrees", _degrees),
    Convention("rpm", "{} in turns a minute", _rpm),
    Convention("quaternion-xyzw", "the quaternion is x, y, z, w{}", _scalar_last),
    Convention("omega-body", "the angular velocity is {}", _omega_frame),
    Convention("omega-sign", "ω has the other sign than the attitude's own derivative{}",
               _omega_sign),
    Convention("inverse-rotation", "the rotation leads from space to body{}", _inverse),
    Convention("exchanged-angles", "angles are exchanged: {}", _exchanged),
    Convention("elevation", "the tilt is an elevation above the horizontal{}", _elevation),
    Convention("from-below", "the tilt is counted from below{}", _from_below),
    Convention("y-up", "y is up: {}", _worlds(("y-up",), False)),
    Convention("z-down", "z is down: {}", _worlds(("z-down",), False), cost=1.5),
    Convention("axes-permuted", "{}", _worlds(_PERMUTED, False)),
    Convention("mirrored", "the world is mirrored: {}", _worlds(("",), True)),
    Convention("y-up+mirrored", "y is up, and the world is mirrored: {}",
               _worlds(("y-up",), True), cost=2.0),
    Convention("axis-with-spin", "the axis is drawn with the spin angle: it turns {}",
               _axis_with_spin),
    Convention("azimuth-origin", "φ is counted from another axis, turned by {}°", _azimuth_origin),
    Convention("spin-origin", "ψ is counted from another mark, turned by {}°", _spin_origin),
    Convention("inertia-about-centre", "A is about the centre of mass and not about the pivot: {}",
               _numbers(SMALLER), True, rare=True),
    Convention("another-number", "another number does the same: {}", _numbers(OTHERS), True,
               cost=2.0, rare=True),
)  # fmt: skip
INERTIA, NUMBER = len(TABLE) - 2, len(TABLE) - 1  # the rows of fits, which take longer
TURN_COST: Final = 0.5  # of a quarter turn that comes with a world
DOWN_COST: Final = 0.7  # of a world turned upside down with the body: a mirror may do the same


def cost(row: int, words: str) -> float:
    """How many names a variant counts for: above 1 where others are likelier to do the same."""
    return TABLE[row].cost + TURN_COST * words.endswith(" ") + DOWN_COST * (UPSIDE in words)
