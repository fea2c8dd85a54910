"""The conventions that data may be written in: each row says how to undo one.

Rows stand in the order in which conventions are undone. An undo gives comparisons as they would be
without the convention, each with the words that go into its sentence.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import permutations
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from heavytop.checking.comparison import MOMENT_NAMES, Comparison, axes, decades, octaves, wrap
from heavytop.checking.headers import HEADER_UNITS, Unit
from heavytop.checking.reading import matrices, norm
from heavytop.errors import HeavyTopError
from heavytop.exact.pairs import Array
from heavytop.scene.quantities import ANGLES, RATES
from heavytop.scene.top import Top

BETTER_BY: Final = 0.5  # decades, by which another number has to explain more
QUARTER: Final = np.pi / 2
IDENTITY: Final = np.eye(3)
OMEGAS: Final = ("omega", "omega_body")
IN_BODY: Final = {"matrix", "omega_body", "vertical"}


class Variant(NamedTuple):
    """The data without a convention, words for its sentence, and what it costs beside its row."""

    words: str
    data: Comparison
    cost: float = 0.0


Variants = Iterator[Variant]
Undo = Callable[[Comparison], Variants]


class Convention(NamedTuple):
    """A name, a sentence with a place for words of the undo, the undo, and what it is about.

    Another start, or another number, may do the same as an origin, a clock, or other physics; of
    physics one error at a time is looked for.
    """

    name: str
    sentence: str
    undo: Undo
    about: Literal["description", "origin", "physics", "number"] = "description"
    cost: float = 1.0  # above 1 where it stands back behind others that do the same
    rare: bool = False  # not tried in pairs, but on top of the best
    clock: bool = False  # the times are others

    @property
    def doubtful(self) -> bool:
        """Whether another start, or another number, may do the same."""
        return self.about in ("origin", "physics")

    @property
    def physics(self) -> bool:
        """Whether the motion is another one, not its description."""
        return self.about in ("physics", "number")

    @property
    def is_global(self) -> bool:
        """Whether everything changes: the motion or the times."""
        return self.physics or self.clock


# --- values, one by one --------------------------------------------------------------------------

Change = dict[str, Callable[[Array], Any]]


def _change(c: Comparison, change: Change) -> Comparison:
    """Other values of some quantities, and other times."""
    return c.replace_values(**{x: f(c.values[x]) for x, f in change.items() if x in c.values})


def _map(*variants: tuple[str, Change]) -> Undo:
    """Other values of some quantities; no two variants change the same ones."""

    def undo(c: Comparison) -> Variants:
        before = [set[str]()]
        for words, change in variants:
            if (names := change.keys() & c.values) not in before:
                before.append(names)
                yield Variant(words, _change(c, change))

    return undo


def _all(function: Callable[[Array], Any], *names: str) -> Change:
    return dict.fromkeys(names, function)


def _unit_conventions(kind: str, undo: Callable[[Unit], Undo]) -> Iterator[Convention]:
    """The conventions of the units that have one."""
    units = [unit for unit in HEADER_UNITS if unit.kind == kind and unit.convention]
    clock = kind == "time"
    return (Convention(x.convention, x.sentence, undo(x), clock=clock) for x in units)


def _in_unit_of_time(unit: Unit) -> Undo:
    """Times, rates, or both in another unit of time."""
    name, times = unit.convention, _all(lambda t: t * unit.factor, "t")
    rates = _all(lambda x: x / unit.factor, *RATES, *OMEGAS)
    those, per = f"the times are in {name}", f"the rates are per {name.removesuffix('s')}"
    return _map((those, times), (f"{those} and {per}", times | rates), (per, rates))


def _in_unit_of_angle(unit: Unit) -> Undo:
    """Angles, rates, ω, or some of them in another unit of angles."""
    groups = {"angles": ANGLES, "angles and rates": (*ANGLES, *RATES), "rates": RATES, "ω": OMEGAS,
              "angles, rates and ω": (*ANGLES, *RATES, *OMEGAS)}  # fmt: skip
    return _map(*((x, _all(lambda y: y * unit.factor, *y)) for x, y in groups.items()))


def _in_unit_of_rate(unit: Unit) -> Undo:
    """Rates, one of them, or ω in another unit of rates."""
    groups = RATES, ("psidot",), ("omega",), ("omega_body",)
    return _map(*((", ".join(x), _all(lambda y: y * unit.factor, *x)) for x in groups))


def _scale_times(*factors: float) -> Undo:
    return lambda c: (Variant(f"{x:g}", c.replace_values(t=c.t * x)) for x in factors)


def _shift_times(c: Comparison) -> Variants:
    first = float(c.t[0])
    if c.given is not None and first:
        yield Variant(f"{first:g}", c.replace_values(t=c.t - first))


def _exchange_frames(c: Comparison) -> Variants:
    words = "in the body, not in space", "in space, not in the body"
    for name, other, meant in zip(OMEGAS, OMEGAS[::-1], words, strict=True):
        if name in c.arrays and other not in c.values:
            yield Variant(meant, c.replace_values(**{other: c.values[name], name: None}))


def _put_scalar_last(c: Comparison) -> Variants:
    if "quaternion" in c.values:
        q = np.roll(c.values["quaternion"], 1, axis=1)
        yield Variant("", c.replace_values(quaternion=q, matrix=matrices(q)))


def _exchange_angles(c: Comparison) -> Variants:
    values = c.values
    for order in permutations(ANGLES):
        pairs = [(name, other) for name, other in zip(ANGLES, order, strict=True) if name != other]
        swapped = {n + dot: values.get(o + dot) for n, o in pairs for dot in ("", "dot")}
        there = {name for name, other in swapped.items() if other is not None}
        if there and there == swapped.keys() & values.keys():
            yield Variant(", ".join(f"{o} is {n}" for n, o in pairs), c.replace_values(**swapped))


# --- another motion ------------------------------------------------------------------------------


def _moments(change: Callable[[Top], dict[str, float]]) -> Undo:
    """Other moments of the top, where they are others and there is such a top."""

    def undo(c: Comparison) -> Variants:
        other = c.with_numbers(**change(c.top))
        if other.top != c.top and float(other.top.C) >= 0:
            yield Variant("", other)

    return undo


def _hold_other_spin(c: Comparison) -> Variants:
    if c.given is not None:
        other = "psidot" if c.given.held == "omega3" else "omega3"
        words = f"{c.given.held} of the scene was taken for {other}"
        yield Variant(words, c.with_numbers(**{other: float(c.given.spin)}))


def _reverse_spin(c: Comparison) -> Variants:
    if c.given is not None and c.given.spin != 0:
        words = "the body spins the other way round"
        yield Variant(words, c.with_numbers(**{c.given.held: -float(c.given.spin)}))
    yield from _map(("ψ is counted the other way round", _all(np.negative, "psi", "psidot")))(c)


# --- worlds --------------------------------------------------------------------------------------

Y_UP: Final = "x z -y"  # the data's x, y, z in those of the package
MIRROR: Final = np.diag([1.0, -1.0, 1.0])


def _frame(spelled: str) -> Array:
    """What takes the package's x, y, z to the data's."""
    signs = [[-1.0 if "-" in word else 1.0] for word in spelled.split()]
    return np.eye(3)[["xyz".index(word[-1]) for word in spelled.split()]] * signs


def _axis_letters(world: Array) -> str:
    """The package's axes that the data's x, y, z are."""
    names = ("−" * int(row.sum() < 0) + "xyz"[int(abs(row).argmax())] for row in world)
    return f"the data's x, y, z are the package's {', '.join(names)}"


def _rotation_about(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def _turn(c: Comparison, space: Array, body: Array = IDENTITY) -> Comparison:
    """The data in another space, `space` e, and of a body with other axes, R `body`."""
    upward = -1.0 if space[2, 2] < 0 else 1.0  # a vertical points up in every world, but along −z
    turned = {
        "matrix": lambda R: space @ R @ body,
        "axis": lambda e: e @ space.T,
        "omega": lambda omega: np.linalg.det(space) * omega @ space.T,
        "omega_body": lambda omega: np.linalg.det(body) * omega @ body,
        "vertical": lambda g: upward * g @ body,
    }
    return _change(c, turned)


def _frames(*spelled: str, mirrored: bool = False) -> Undo:
    """Other axes of space, with those of the body or without, and what a quarter turn makes."""

    def undo(c: Comparison) -> Variants:
        given, R = c.values.keys() & (IN_BODY | {"axis"}), c.values.get("matrix")
        for up in map(_frame, spelled if given else ()):
            space = MIRROR @ up.T if mirrored else up.T
            bodies = [space.T, IDENTITY] if given & IN_BODY else [IDENTITY]
            if R is not None and mirrored and np.linalg.det(R[0]) > 0:
                bodies = [space.T]
            for body in bodies:
                carried = body is not IDENTITY
                upside = carried and bool(up[:2, 2].min() < 0)
                # a mirror may do the same as a world turned upside down with the body
                down, cost = ", the body's axis too" * upside, 0.7 * upside
                turned = _turn(c, space, body)
                yield Variant(f"{_axis_letters(space.T)}{down}", turned, cost)
                if quarter := round(_offset(turned, "phi") / QUARTER) * QUARTER:
                    about = np.rint(_rotation_about(quarter))
                    other = _turn(turned, about, about.T if carried else IDENTITY)
                    yield Variant(f"{_axis_letters((about @ space).T)}{down}", other, cost + 0.5)
            if not mirrored and R is not None:
                yield Variant(f"{_axis_letters(up)} in the body", _turn(c, IDENTITY, up))

    return undo


# --- origins -------------------------------------------------------------------------------------


def _offset(c: Comparison, name: str) -> float:
    """By how much an angle differs in the first row that shows it [rad]; 0 below a degree."""
    mine, sine = c.derived.get(name), c.exact.sine
    if c.given is None or mine is None:
        return 0.0
    row = int(np.argmax(sine > min(0.05, float(sine.max()) / 2)))
    turn = float(wrap(c.exact.value(name)[row] - mine[row]))
    return turn if abs(turn) > 0.02 else 0.0


def _turn_azimuth(c: Comparison) -> Variants:
    if turn := _offset(c, "phi"):
        words, about = f"{np.degrees(turn):.4g}°", _rotation_about(turn)
        turned = _change(_turn(c, about), {"phi": lambda phi: phi + turn})
        yield Variant(words, turned)
        if "matrix" in c.values:  # the axes of the body are turned with those of space
            yield Variant(f"{words} in space and in the body", _turn(turned, IDENTITY, about.T))


def _turn_spin(c: Comparison) -> Variants:
    if turn := _offset(c, "psi"):
        turned = _change(_turn(c, IDENTITY, _rotation_about(turn)), {"psi": lambda psi: psi + turn})
        yield Variant(f"{np.degrees(turn):.4g}°", turned)


def _take_spin_off(c: Comparison) -> Variants:
    axis = c.values.get("axis")
    if axis is None or c.given is None:
        return
    psi, phi = (c.values.get(name, c.exact.value(name)) for name in ("psi", "phi"))
    azimuth, theta = np.arctan2(axis[:, 0], -axis[:, 1]), np.arctan2(norm(axis[:, :2]), axis[:, 2])
    for sign, words in ((1, "with ψ"), (-1, "against ψ")):
        turned = azimuth - sign * psi
        around = axes(theta, phi + turned - turned[0])
        yield Variant(words, c.replace_values(axis=norm(axis)[:, None] * around))


# --- numbers of the problem ----------------------------------------------------------------------

GROWN: Final = tuple(0.5**k for k in range(8))  # the parts by which a number is changed at first
CHANGED: Final = (*GROWN, *(-x for x in GROWN))
SHRUNK: Final = tuple(-(0.5**k) for k in range(6))  # by 3 % at least, which no coarse step does
NUMBERS: Final = ("C", "gMR", "the clock", "the time of the first row",
                  "theta", "thetadot", "phidot", "spin")  # fmt: skip


def _change_number(c: Comparison, name: str, x: float) -> tuple[float, Comparison]:
    """A number of the problem changed by the part x of what it is changed at most."""
    if name == "the clock":
        return 1 + x, c.replace_values(t=c.t * (1 + x))
    if name == "the time of the first row":
        shift = x * (c.motion.period or float(c.t[-1]))
        return shift, c.replace_values(t=c.t + shift)
    key = c.start.held if name == "spin" else name
    value = float(getattr(c.top if name in MOMENT_NAMES else c.start, key))
    # A from C/2, where all mass is far out
    most = {"A": value - float(c.top.C) / 2, "C": value, "gMR": value, "theta": 0.5}
    value += x * most.get(name, 2 * max(abs(value), 0.1 * c.exact.fastest))
    if name == "theta":
        value = float(np.clip(value, 0, np.pi))
    return value, c.with_numbers(**{key: value})


def _fit(parts: Mapping[str, Sequence[float]]) -> Undo:
    """Each number as it fits best, where it explains anything."""

    def undo(c: Comparison) -> Variants:
        from scipy.optimize import minimize_scalar

        if c.given is None:
            return
        rows, begins = octaves(c.t.size)
        some = c.rows(rows)

        def misfit(x: float, name: str) -> float:
            try:
                return float(decades(_change_number(some, name, x)[1], begins).sum())
            except HeavyTopError:
                return 0.0  # as where nothing fits

        wanted = misfit(0.0, "C") - BETTER_BY
        for name, grid in parts.items():
            least, x = min((misfit(x, name), x) for x in (0.0, *grid))
            if x:
                nearer = x / 2 if abs(x) > min(map(abs, grid)) else 0.0
                sides = sorted((float(np.clip(2 * x, -1, 1)), nearer))
                how = {"method": "bounded", "options": {"xatol": 1e-10}}
                found = minimize_scalar(misfit, None, sides, (name,), **how)
                least, x = min((least, x), (float(found.fun), float(found.x)))
            if least < wanted:
                value, other = _change_number(c, name, x)
                yield Variant(f"{name} = {value:.6g}", other)

    return undo


# --- the table -----------------------------------------------------------------------------------

SCALES: Final = (-1, 10, 0.1, 1 / 60, 1e-6, 1 / 30, 1 / 25, 1 / 50, 1 / 100)

TABLE: Final = (
    Convention("time-origin", "the start of the scene is the first row, at t = {} s", _shift_times),
    *_unit_conventions("time", _in_unit_of_time),
    Convention("time-scale", "the times have to be multiplied by {}", _scale_times(2, 0.5),
               "origin", clock=True),
    Convention("time-scale", "the times need the factor {}", _scale_times(*SCALES), "origin", 1.5,
               rare=True, clock=True),
    Convention("gravity-sign", "gravity has the other sign: gMR and −gMR are exchanged{}",
               _moments(lambda top: {"gMR": -float(top.gMR)}), "physics", 1.3),
    Convention("spin-held", "the spin: {}", _hold_other_spin, "physics"),
    Convention("spin-sign", "the spin has the other sign: {}", _reverse_spin, "physics"),
    Convention("gyroscopic-sign", "the gyroscopic term of Euler's equations has the wrong sign{}",
               _moments(lambda top: {"C": float(2 * top.A - top.C)}), "physics"),
    Convention("no-gyroscopic-term", "the gyroscopic term of Euler's equations is missing{}",
               _moments(lambda top: {"C": float(top.A)}), "physics"),
    *_unit_conventions("angle", _in_unit_of_angle),
    *_unit_conventions("rate", _in_unit_of_rate),
    Convention("quaternion-xyzw", "the quaternion is x, y, z, w{}", _put_scalar_last),
    Convention("omega-body", "the angular velocity is {}", _exchange_frames),
    Convention("omega-sign", "ω has the other sign than the attitude's own derivative{}",
               _map(("", _all(np.negative, *OMEGAS)))),
    Convention("inverse-rotation", "the rotation leads from space to body{}",
               _map(("", {"matrix": lambda R: np.swapaxes(R, 1, 2)}))),
    Convention("exchanged-angles", "angles are exchanged: {}", _exchange_angles),
    Convention("elevation", "the tilt is an elevation above the horizontal{}", _map(
        ("", {"theta": lambda x: QUARTER - x, "thetadot": np.negative}))),
    Convention("from-below", "the tilt is counted from below{}", _map(
        ("", {"theta": lambda x: np.pi - x, "thetadot": np.negative}))),
    Convention("y-up", "y is up: {}", _frames(Y_UP)),
    Convention("z-down", "z is down: {}", _frames("x -y -z"), cost=1.5),
    Convention("axes-permuted", "{}", _frames("x -z y", "z x y", "-z y x")),
    Convention("mirrored", "the world is mirrored: {}", _frames("x y z", mirrored=True)),
    Convention("mirrored", "{} the other way round", _map(
        ("φ counts", _all(np.negative, "phi", "phidot")),
        ("φ and ψ count", _all(np.negative, "phi", "phidot", "psi", "psidot")))),
    Convention("y-up+mirrored", "y is up, and the world is mirrored: {}",
               _frames(Y_UP, mirrored=True), cost=2.0),
    Convention("axis-with-spin", "the axis is drawn with the spin angle: it turns {}",
               _take_spin_off),
    Convention("azimuth-origin", "φ is counted from another axis, turned by {}", _turn_azimuth,
               "origin"),
    Convention("spin-origin", "ψ is counted from another mark, turned by {}", _turn_spin,
               "origin"),
    Convention("inertia-about-centre", "A is about the centre of mass and not about the pivot: {}",
               _fit({"A": SHRUNK}), "physics", rare=True),
    Convention("another-number", "another number does the same: {}",
               _fit({"A": GROWN} | dict.fromkeys(NUMBERS, CHANGED)), "number", 2.0, rare=True),
)  # fmt: skip
INERTIA_ROW, NUMBER_ROW = len(TABLE) - 2, len(TABLE) - 1  # the rows of fits, which take longer
