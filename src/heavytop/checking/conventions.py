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
RPM: Final = 2 * np.pi / 60
IDENTITY: Final = np.eye(3)
BELOW: Final = ("thetadot", "elevation", "elevationdot")
TILTS: Final = (*ANGLES, "elevation")
TURNS: Final = (*RATES, "elevationdot")
Undone = Iterator[tuple[str, Comparison]]


class Convention(NamedTuple):
    """A name, a sentence with a place for words of the undo, and the undo."""

    name: str
    sentence: str
    undo: Callable[[Comparison], Undone]
    physics: bool = False  # whether the motion is another one, not its description
    cost: float = 1.0  # above 1 where it stands back behind others that do the same
    rare: bool = False  # not tried in pairs, but on top of the best


# --- values, one by one --------------------------------------------------------------------------

Mapped = dict[str, Callable[[Array], Any]]
SPINS: Final = ("omega", "omega_body")


def _mapped(*variants: tuple[str, Mapped]) -> Callable[[Comparison], Undone]:
    """Other values of some quantities; no two variants change the same ones."""

    def undo(c: Comparison) -> Undone:
        before: set[tuple[str, ...]] = {()}
        for words, functions in variants:
            changed = {x: functions[x](c.data.values[x]) for x in functions if x in c.data.values}
            if (names := tuple(changed)) not in before:
                before.add(names)
                yield words, c.updated(**changed)

    return undo


def _all(function: Callable[[Array], Any], *names: str) -> Mapped:
    return dict.fromkeys(names, function)


def _times(*factors: float) -> Callable[[Comparison], Undone]:
    def undo(c: Comparison) -> Undone:
        for factor in factors:
            yield f"{factor:g}", replace(c, data=replace(c.data, t=c.data.t * factor))

    return undo


def _time_origin(c: Comparison) -> Undone:
    first = float(c.data.t[0])
    if c.given is not None and first:
        yield f"{first:g}", replace(c, data=replace(c.data, t=c.data.t - first))


def _omega_frame(c: Comparison) -> Undone:
    for name, other, words in (
        ("omega", "omega_body", "in the body, not in space"),
        ("omega_body", "omega", "in space, not in the body"),
    ):
        if name in c.data.values and other not in c.data.values:
            yield words, c.updated(**{other: c.data.values[name], name: None})


def _exchanged(c: Comparison) -> Undone:
    values = c.data.values
    for order in ("θψφ", "φθψ", "ψφθ", "φψθ", "ψθφ"):
        others = [dict(zip("θφψ", ANGLES, strict=True))[letter] for letter in order]
        pairs = [(n, o) for n, o in zip(ANGLES, others, strict=True) if n != o]
        swapped = {n + dot: values.get(o + dot) for n, o in pairs for dot in ("", "dot")}
        there = {name for name, other in swapped.items() if other is not None}
        if there and there == swapped.keys() & values.keys():
            yield ", ".join(f"{o} is {n}" for n, o in pairs), c.updated(**swapped)


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
        held, other = sorted(("omega3", "psidot"), key=lambda name: name != c.start.held)
        words = f"{held} of the scene was taken for {other}"
        yield words, _start(c, **{other: c.given.spin})


def _spin_sign(c: Comparison) -> Undone:
    if c.given is not None and c.given.spin != 0:
        yield "the body spins the other way round", _start(c, **{c.given.held: -c.given.spin})
    words = "ψ is counted the other way round"
    yield from _mapped((words, _all(np.negative, "psi", "psidot")))(c)


def _top(change: Callable[[Top], dict[str, Any]]) -> Callable[[Comparison], Undone]:
    def undo(c: Comparison) -> Undone:
        there = _with_top(c, **change(c.top))
        if there.top != c.top and float(there.top.C) >= 0:
            yield "", there

    return undo


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
IN_BODY: Final = {"matrix", "quaternion", "omega_body", "vertical"}


def _world(spelled: str) -> Array:
    """What takes the package's x, y, z to the data's."""
    signs = [[-1.0 if "-" in word else 1.0] for word in spelled.split()]
    return np.eye(3)[["xyz".index(word[-1]) for word in spelled.split()]] * signs


def _letters(world: Array) -> str:
    """The package's axes that the data's x, y, z are."""
    names = ("−" * int(row.sum() < 0) + "xyz"[int(abs(row).argmax())] for row in world)
    return f"the data's x, y, z are the package's {', '.join(names)}"


def _about(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def _turned(c: Comparison, space: Array, body: Array = IDENTITY) -> Comparison:
    """The data in another space, `space` e, and of a body with other axes, R `body`."""
    turned: dict[str, Any] = {}
    if c.matrix is not None:
        turned = {"matrix": space @ c.matrix @ body, "quaternion": None}
    outer, inner = np.linalg.det(space), np.linalg.det(body)
    for names, by, improper in (
        (("axis",), space.T, 1.0),
        (("omega",), space.T, np.sign(outer)),
        (("omega_body", "momentum_body"), body, np.sign(inner)),
        (("vertical",), body, 1.0),
    ):
        turned |= {x: improper * c.data.values[x] @ by for x in names if x in c.data.values}
    return c.updated(**turned)


def _worlds(names: tuple[str, ...], mirrored: bool) -> Callable[[Comparison], Undone]:
    def undo(c: Comparison) -> Undone:
        there = c.data.values.keys() & (IN_BODY | {"axis"})
        if not there and mirrored and names == ("",):
            yield from _mapped(
                ("φ and ψ count the other way round",
                 _all(np.negative, "phi", "phidot", "psi", "psidot")),
                ("φ counts the other way round", _all(np.negative, "phi", "phidot")),
            )(c)  # fmt: skip
        for name in names if there else ():
            up = _world(WORLDS[name])
            space = MIRROR @ up.T if mirrored else up.T
            bodies = [space.T, IDENTITY] if there & IN_BODY else [IDENTITY]
            if c.matrix is not None and mirrored and np.linalg.det(c.matrix[0]) > 0:
                bodies = [space.T]
            for body in bodies:
                down = UPSIDE * (body is not IDENTITY and name in ("y-down", "x-down"))
                first = _turned(c, space, body)
                quarter = round(_azimuth(first) / QUARTER) * QUARTER
                if _upright(first):
                    yield f"{_letters(space.T)}{down}", first
                if _upright(first) and quarter:
                    about = np.rint(_about(quarter))
                    other = _turned(first, about, IDENTITY if body is IDENTITY else about.T)
                    yield f"{_letters((about @ space).T)}{down} ", other
            if not mirrored and c.matrix is not None and _upright(_turned(c, IDENTITY, up)):
                yield f"{_letters(up)} in the body", _turned(c, IDENTITY, up)

    return undo


def _upright(c: Comparison) -> bool:
    """Whether the first row may have the tilt of the start, which no azimuth changes."""
    if c.axis is None or c.given is None or c.since[0]:
        return True
    return bool(abs(c.axis[0, 2] - np.cos(float(c.given.theta))) < TILTED)


# --- origins -------------------------------------------------------------------------------------


def _azimuth(c: Comparison) -> float:
    """By how much the first rows have to be turned about the vertical [rad]."""
    if c.axis is None or c.given is None:
        return 0.0
    mine, other = c.axis, c.exact.axis
    across = np.minimum(norm(mine[:, :2]), norm(other[:, :2]))
    row = int(np.argmax(across > min(UPRIGHT, float(across.max()))))
    (x, y), (u, v) = mine[row, :2], other[row, :2]
    return float(np.arctan2(x * v - y * u, x * u + y * v))


def _shift(c: Comparison, name: str) -> float:
    """By how much an angle differs in the first rows [rad]."""
    if name not in c.data.values:
        return 0.0
    sine = c.reference.sine
    row = int(np.argmax(sine > min(UPRIGHT, float(sine.max()) / 2)))
    return float(wrapped(c.reference.angle(name)[row] - c.data.values[name][row]))


def _azimuth_origin(c: Comparison) -> Undone:
    if c.given is None:
        return
    vectors = c.data.values.keys() & {"axis", "matrix", "quaternion", "omega"}
    turn, shift = _azimuth(c) if vectors else 0.0, _shift(c, "phi")
    turned, words = _turned(c, _about(turn)), f"{np.degrees(turn):.4g}"
    if abs(turn) > TURNED:
        yield words, turned
        if c.matrix is not None:  # the axes of the body are turned with those of space
            both = _turned(c, _about(turn), _about(-turn))
            yield f"{words}° in space and in the body: {words}", both
    if abs(shift) > TURNED:
        phi = c.data.values["phi"] + shift
        yield f"{np.degrees(shift):.4g}", c.updated(phi=phi)
        if abs(turn) > TURNED:
            yield words, turned.updated(phi=phi)


def _spin_origin(c: Comparison) -> Undone:
    if c.given is None:
        return
    turn, shift = 0.0, _shift(c, "psi")
    if c.matrix is not None:
        between = c.matrix[0].T @ c.reference.rotation[0]
        turn = float(np.arctan2(between[1, 0] - between[0, 1], between[0, 0] + between[1, 1]))
    elif "vertical" in c.data.values:
        turn = float(wrapped(c.exact.psi_mod[0] - c.angle("psi")[0]))
    if abs(turn) > TURNED:
        yield f"{np.degrees(turn):.4g}", _turned(c, IDENTITY, _about(turn))
    if abs(shift) > TURNED:
        yield f"{np.degrees(shift):.4g}", c.updated(psi=c.data.values["psi"] + shift)


def _axis_with_spin(c: Comparison) -> Undone:
    axis = c.data.values.get("axis")
    if axis is None or c.given is None:
        return
    psi, phi = (c.data.values.get(name, c.reference.angle(name)) for name in ("psi", "phi"))
    azimuth, theta = np.arctan2(axis[:, 0], -axis[:, 1]), np.arctan2(norm(axis[:, :2]), axis[:, 2])
    for sign, words in ((1, "with ψ"), (-1, "against ψ")):
        turned = azimuth - sign * psi
        yield words, c.updated(axis=axes(theta, phi + turned - turned[0]))


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
        value += 2 * x * max(abs(value), SLOW * c.reference.fastest)
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
    x, least = float(found.x), float(found.fun)
    return (x, least) if least < values[k] else (grid[k], values[k])


ANOTHER_MOTION: Final = {  # names that the start, or another number, may have as well
    *("azimuth-origin", "spin-origin", "spin-held", "spin-sign", "time-scale", "gravity-sign"),
    *("gyroscopic-sign", "no-gyroscopic-term", "inertia-about-centre"),
}
_SCALES: Final = (10, 0.1, 60, 1 / 60, 1e-6, 1 / 30, 1 / 25, 1 / 50, 1 / 100)
_PERMUTED: Final = ("y-down", "x-up", "x-down")

TABLE: Final = (
    Convention("time-origin", "the start of the scene is the first row, at t = {} s", _time_origin),
    Convention("milliseconds", "the times are in milliseconds{:.0}", _times(1e-3)),
    Convention("time-scale", "time runs backwards: {}", _times(-1), cost=1.5, rare=True),
    Convention("time-scale", "the times have to be multiplied by {}", _times(2, 0.5)),
    Convention("time-scale", "the times need the factor {}", _times(*_SCALES), rare=True),
    Convention("gravity-sign", "gravity has the other sign: gMR and −gMR are exchanged{}",
               _top(lambda top: {"gMR": -float(top.gMR)}), True, 1.3),
    Convention("spin-held", "the spin: {}", _spin_held, True),
    Convention("spin-sign", "the spin has the other sign: {}", _spin_sign, True),
    Convention("gyroscopic-sign", "the gyroscopic term of Euler's equations has the wrong sign{}",
               _top(lambda top: {"C": float(2 * top.A - top.C)}), True),
    Convention("no-gyroscopic-term", "the gyroscopic term of Euler's equations is missing{}",
               _top(lambda top: {"C": float(top.A)}), True),
    Convention("degrees", "{} are in degrees", _mapped(
        ("angles", _all(np.radians, *TILTS)),
        ("angles and rates", _all(np.radians, *TILTS, *TURNS)),
        ("rates", _all(np.radians, *TURNS)),
        ("ω", _all(np.radians, *SPINS)),
        ("angles, rates and ω", _all(np.radians, *TILTS, *TURNS, *SPINS)))),
    Convention("rpm", "{} in turns a minute", _mapped(
        *((", ".join(names), _all(lambda x: x * RPM, *names))
          for names in (RATES, ("psidot",), ("omega",), ("omega_body",))))),
    Convention("quaternion-xyzw", "the quaternion is x, y, z, w{}",
               _mapped(("", {"quaternion": lambda q: np.roll(q, 1, axis=1)}))),
    Convention("omega-body", "the angular velocity is {}", _omega_frame),
    Convention("omega-sign", "ω has the other sign than the attitude's own derivative{}",
               _mapped(("", _all(np.negative, *SPINS)))),
    Convention("inverse-rotation", "the rotation leads from space to body{}", _mapped(
        ("", {"matrix": lambda R: np.swapaxes(R, 1, 2),
              "quaternion": lambda q: q * [1, -1, -1, -1]}))),
    Convention("exchanged-angles", "angles are exchanged: {}", _exchanged),
    Convention("elevation", "the tilt is an elevation above the horizontal{}", _mapped(
        ("", {"theta": lambda x: QUARTER - x, "thetadot": np.negative}))),
    Convention("from-below", "the tilt is counted from below{}", _mapped(
        ("", {"theta": lambda x: np.pi - x} | _all(np.negative, *BELOW)))),
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
