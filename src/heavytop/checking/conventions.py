"""The table of conventions that data may be written in, and how each is undone.

Rows stand in the order in which conventions are undone. An undo is a function of a comparison: it
yields variants of it without the convention, each with the words for its sentence.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
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

BETTER_BY: Final = 0.5  # decades by which another number must reduce the misfit
QUARTER: Final = np.pi / 2
IDENTITY: Final = np.eye(3)
OMEGAS: Final = ("omega", "omega_body")
IN_BODY: Final = {"matrix", "omega_body", "vertical"}


class Variant(NamedTuple):
    """The data without a convention, words for its sentence, and a cost on top of its row's."""

    words: str
    data: Comparison
    cost: float = 0.0


Variants = Iterator[Variant]
Undo = Callable[[Comparison], Variants]


class Convention(NamedTuple):
    """A name, a sentence with a place for the words of a variant, the undo, and its subject.

    Another start, or another number, may have the same effect as an origin, a clock, or other
    physics; of physics one error at a time is looked for.
    """

    name: str
    sentence: str
    undo: Undo
    about: Literal["description", "origin", "physics", "number"] = "description"
    cost: float = 1.0  # above 1 where a convention with the same effect is preferred
    rare: bool = False  # not tried in pairs, but added to the best explanations
    clock: bool = False  # whether it changes the times

    @property
    def doubtful(self) -> bool:
        """Whether another start, or another number, may have the same effect."""
        return self.about in ("origin", "physics")

    @property
    def physics(self) -> bool:
        """Whether it changes the motion, and not only its description."""
        return self.about in ("physics", "number")

    @property
    def is_global(self) -> bool:
        """Whether it changes the motion or the times, and so every quantity."""
        return self.physics or self.clock


# --- values, one by one --------------------------------------------------------------------------

Change = dict[str, Callable[[Array], Any]]


def _apply(c: Comparison, change: Change) -> Comparison:
    """The data with changed values of those quantities that they have."""
    return c.replace_values(**{x: f(c.values[x]) for x, f in change.items() if x in c.values})


def _undo_changes(*variants: tuple[str, Change]) -> Undo:
    """The undo with a variant for each change; no two change the same quantities of the data."""

    def undo(c: Comparison) -> Variants:
        before = [set[str]()]
        for words, change in variants:
            if (names := change.keys() & c.values) not in before:
                before.append(names)
                yield Variant(words, _apply(c, change))

    return undo


def _change_all(function: Callable[[Array], Any], *names: str) -> Change:
    """The change of all these quantities by one function."""
    return dict.fromkeys(names, function)


def _unit_conventions(kind: str, undo: Callable[[Unit], Undo]) -> Iterator[Convention]:
    """The conventions of the units of a kind: of each that has a name for its convention."""
    units = [unit for unit in HEADER_UNITS if unit.kind == kind and unit.convention]
    return (Convention(x.convention, x.sentence, undo(x), clock=kind == "time") for x in units)


def _undo_time_unit(unit: Unit) -> Undo:
    """The undo of another unit of time, in the times, the rates, or both."""
    name, times = unit.convention, _change_all(lambda t: t * unit.factor, "t")
    rates = _change_all(lambda x: x / unit.factor, *RATES, *OMEGAS)
    those, per = f"the times are in {name}", f"the rates are per {name.removesuffix('s')}"
    return _undo_changes((those, times), (f"{those} and {per}", times | rates), (per, rates))


ANGLE_GROUPS: Final = {
    "angles": ANGLES, "angles and rates": (*ANGLES, *RATES), "rates": RATES, "ω": OMEGAS,
    "angles, rates and ω": (*ANGLES, *RATES, *OMEGAS),
}  # fmt: skip
RATE_GROUPS: Final = {", ".join(x): x for x in (RATES, ("psidot",), *zip(OMEGAS, strict=True))}


def _undo_unit(groups: Mapping[str, tuple[str, ...]], unit: Unit) -> Undo:
    """The undo of another unit, in one of these groups of quantities."""
    scale = partial(_change_all, lambda x: x * unit.factor)
    return _undo_changes(*((words, scale(*names)) for words, names in groups.items()))


def _scale_times(*factors: float) -> Undo:
    """The undo of wrong times: they are multiplied by one of these factors."""
    return lambda c: (Variant(f"{x:g}", c.replace_values(t=c.t * x)) for x in factors)


def _shift_times(c: Comparison) -> Variants:
    """Yield the data with times counted from the first row."""
    if c.given is not None and (first := float(c.t[0])):
        yield Variant(f"{first:g}", c.replace_values(t=c.t - first))


def _exchange_frames(c: Comparison) -> Variants:
    """Yield the data with ω in the other frame, of space or of the body."""
    frames = "in the body, not in space", "in space, not in the body"
    for name, other, words in zip(OMEGAS, OMEGAS[::-1], frames, strict=True):
        if name in c.arrays and other not in c.values:
            yield Variant(words, c.replace_values(**{other: c.values[name], name: None}))


def _put_scalar_first(c: Comparison) -> Variants:
    """Yield the data with the last component of the quaternion in front, as its scalar."""
    if "quaternion" in c.values:
        q = np.roll(c.values["quaternion"], 1, axis=1)
        yield Variant("", c.replace_values(quaternion=q, matrix=matrices(q)))


def _exchange_angles(c: Comparison) -> Variants:
    """Yield the data with angles, and their rates, in another order."""
    values = c.values
    for order in permutations(ANGLES):
        pairs = [(name, other) for name, other in zip(ANGLES, order, strict=True) if name != other]
        swapped = {n + dot: values.get(o + dot) for n, o in pairs for dot in ("", "dot")}
        known = {name for name, other in swapped.items() if other is not None}
        if known and known == swapped.keys() & values.keys():
            yield Variant(", ".join(f"{o} is {n}" for n, o in pairs), c.replace_values(**swapped))


# --- another motion ------------------------------------------------------------------------------


def _change_moments(change: Callable[[Top], dict[str, float]]) -> Undo:
    """The undo by other moments of the top, where they differ and C is not negative."""

    def undo(c: Comparison) -> Variants:
        other = c.with_numbers(**change(c.top))
        if other.top != c.top and float(other.top.C) >= 0:
            yield Variant("", other)

    return undo


def _hold_other_spin(c: Comparison) -> Variants:
    """Yield the comparison with the spin of the scene as the other one of ψ̇ and ω₃."""
    if c.given is not None:
        other = "psidot" if c.given.held == "omega3" else "omega3"
        words = f"{c.given.held} of the scene was taken for {other}"
        yield Variant(words, c.with_numbers(**{other: float(c.given.spin)}))


def _reverse_spin(c: Comparison) -> Variants:
    """Yield the comparison with the spin reversed, in the motion or in the data."""
    if c.given is not None and c.given.spin != 0:
        words = "the body spins the other way round"
        yield Variant(words, c.with_numbers(**{c.given.held: -float(c.given.spin)}))
    change = _change_all(np.negative, "psi", "psidot")
    yield from _undo_changes(("ψ is counted the other way round", change))(c)


# --- worlds --------------------------------------------------------------------------------------

Y_UP: Final = "x z -y"  # the data's x, y, z by those of the package
MIRROR: Final = np.diag([1.0, -1.0, 1.0])


def _frame(spelled: str) -> Array:
    """The matrix from the package's x, y, z to the data's."""
    signs = [[-1.0 if "-" in word else 1.0] for word in spelled.split()]
    return np.eye(3)[["xyz".index(word[-1]) for word in spelled.split()]] * signs


def _axis_letters(world: Array) -> str:
    """The words that name the axes of the data by those of the package."""
    names = ("−" * int(row.sum() < 0) + "xyz"[int(abs(row).argmax())] for row in world)
    return f"the data's x, y, z are the package's {', '.join(names)}"


def _rotation_about(angle: float) -> Array:
    """The rotation by an angle about the z axis."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def _turn_axes(c: Comparison, space: Array, body: Array = IDENTITY) -> Comparison:
    """The data with other axes of space, `space` e, and other axes of the body, R `body`."""
    upward = -1.0 if space[2, 2] < 0 else 1.0  # a vertical points up in every world, but along −z
    turned = {
        "matrix": lambda R: space @ R @ body,
        "axis": lambda e: e @ space.T,
        "omega": lambda omega: np.linalg.det(space) * omega @ space.T,
        "omega_body": lambda omega: np.linalg.det(body) * omega @ body,
        "vertical": lambda g: upward * g @ body,
    }
    return _apply(c, turned)


def _undo_axes(*spelled: str, mirrored: bool = False) -> Undo:
    """The undo of other axes of space, of the body too or not, and turned by a quarter or not."""

    def undo(c: Comparison) -> Variants:
        vectors, R = c.values.keys() & (IN_BODY | {"axis"}), c.values.get("matrix")
        for up in map(_frame, spelled if vectors else ()):
            space = MIRROR @ up.T if mirrored else up.T
            bodies = [space.T, IDENTITY] if vectors & IN_BODY else [IDENTITY]
            if R is not None and mirrored and np.linalg.det(R[0]) > 0:
                bodies = [space.T]
            for body in bodies:
                with_body = body is not IDENTITY
                inverted = with_body and bool(up[:2, 2].min() < 0)
                # a mirror may do the same as a world turned upside down with the body
                more, cost = ", the body's axis too" * inverted, 0.7 * inverted
                turned = _turn_axes(c, space, body)
                yield Variant(f"{_axis_letters(space.T)}{more}", turned, cost)
                if quarter := round(_offset(turned, "phi") / QUARTER) * QUARTER:
                    about = np.rint(_rotation_about(quarter))
                    other = _turn_axes(turned, about, about.T if with_body else IDENTITY)
                    yield Variant(f"{_axis_letters((about @ space).T)}{more}", other, cost + 0.5)
            if not mirrored and R is not None:
                yield Variant(f"{_axis_letters(up)} in the body", _turn_axes(c, IDENTITY, up))

    return undo


# --- origins -------------------------------------------------------------------------------------


def _offset(c: Comparison, name: str) -> float:
    """The difference of an angle in the first row that determines it [rad]; 0 below a degree."""
    mine, sine = c.derived.get(name), c.exact.sine
    if c.given is None or mine is None:
        return 0.0
    row = int(np.argmax(sine > min(0.05, float(sine.max()) / 2)))
    turn = float(wrap(c.exact.value(name)[row] - mine[row]))
    return turn if abs(turn) > 0.02 else 0.0


def _turn_azimuth(c: Comparison) -> Variants:
    """Yield the data with φ counted from the package's axis."""
    if turn := _offset(c, "phi"):
        words, about = f"{np.degrees(turn):.4g}°", _rotation_about(turn)
        data = _apply(_turn_axes(c, about), {"phi": lambda phi: phi + turn})
        yield Variant(words, data)
        if "matrix" in c.values:  # the axes of the body are turned with those of space
            yield Variant(f"{words} in space and in the body", _turn_axes(data, IDENTITY, about.T))


def _turn_spin(c: Comparison) -> Variants:
    """Yield the data with ψ counted from the package's mark on the body."""
    if turn := _offset(c, "psi"):
        turned = _turn_axes(c, IDENTITY, _rotation_about(turn))
        yield Variant(f"{np.degrees(turn):.4g}°", _apply(turned, {"psi": lambda psi: psi + turn}))


def _take_spin_off(c: Comparison) -> Variants:
    """Yield the data with the spin angle subtracted from the azimuth of the axis."""
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

GROWN: Final = tuple(0.5**k for k in range(8))  # first changes, over the largest change allowed
CHANGED: Final = (*GROWN, *(-x for x in GROWN))
SHRUNK: Final = tuple(-(0.5**k) for k in range(6))  # at least 3 %: no coarse step has this effect
NUMBERS: Final = ("C", "gMR", "the clock", "the time of the first row",
                  "theta", "thetadot", "phidot", "spin")  # fmt: skip


def _change_number(c: Comparison, name: str, x: float) -> tuple[float, Comparison]:
    """A number of the problem, changed by x of the largest change allowed, and the comparison."""
    if name == "the clock":
        return 1 + x, c.replace_values(t=c.t * (1 + x))
    if name == "the time of the first row":
        shift = x * (c.motion.period or float(c.t[-1]))
        return shift, c.replace_values(t=c.t + shift)
    key = c.start.held if name == "spin" else name
    value = float(getattr(c.top if name in MOMENT_NAMES else c.start, key))
    # A is at least C/2, that of a flat body
    most = {"A": value - float(c.top.C) / 2, "C": value, "gMR": value, "theta": 0.5}
    value += x * most.get(name, 2 * max(abs(value), 0.1 * c.exact.fastest))
    if name == "theta":
        value = float(np.clip(value, 0, np.pi))
    return value, c.with_numbers(**{key: value})


def _undo_fit(parts: Mapping[str, Sequence[float]]) -> Undo:
    """The undo by other numbers: each as it fits best, where the fit is clearly better."""

    def undo(c: Comparison) -> Variants:
        from scipy.optimize import minimize_scalar

        if c.given is None:
            return
        rows, begins = octaves(c.t.size)

        def misfit(x: float, name: str) -> float:
            try:
                return float(decades(_change_number(c, name, x)[1].rows(rows), begins).sum())
            except HeavyTopError:
                return 0.0  # the misfit where nothing fits

        accepted = misfit(0.0, "C") - BETTER_BY
        for name, grid in parts.items():
            least, x = min((misfit(x, name), x) for x in (0.0, *grid))
            if x:
                nearer = x / 2 if abs(x) > min(map(abs, grid)) else 0.0
                sides = sorted((float(np.clip(2 * x, -1, 1)), nearer))
                options = {"method": "bounded", "options": {"xatol": 1e-10}}
                found = minimize_scalar(misfit, None, sides, (name,), **options)
                least, x = min((least, x), (float(found.fun), float(found.x)))
            if least < accepted:
                value, other = _change_number(c, name, x)
                yield Variant(f"{name} = {value:.6g}", other)

    return undo


# --- the table -----------------------------------------------------------------------------------

SCALES: Final = (-1, 10, 0.1, 1 / 60, 1e-6, 1 / 30, 1 / 25, 1 / 50, 1 / 100)

TABLE: Final = (
    Convention("time-origin", "the start of the scene is the first row, at t = {} s", _shift_times),
    *_unit_conventions("time", _undo_time_unit),
    Convention("time-scale", "the times have to be multiplied by {}", _scale_times(2, 0.5),
               "origin", clock=True),
    Convention("time-scale", "the times need the factor {}", _scale_times(*SCALES), "origin", 1.5,
               rare=True, clock=True),
    Convention("gravity-sign", "gravity has the other sign: gMR and −gMR are exchanged{}",
               _change_moments(lambda top: {"gMR": -float(top.gMR)}), "physics", 1.3),
    Convention("spin-held", "the spin: {}", _hold_other_spin, "physics"),
    Convention("spin-sign", "the spin has the other sign: {}", _reverse_spin, "physics"),
    Convention("gyroscopic-sign", "the gyroscopic term of Euler's equations has the wrong sign{}",
               _change_moments(lambda top: {"C": float(2 * top.A - top.C)}), "physics"),
    Convention("no-gyroscopic-term", "the gyroscopic term of Euler's equations is missing{}",
               _change_moments(lambda top: {"C": float(top.A)}), "physics"),
    *_unit_conventions("angle", partial(_undo_unit, ANGLE_GROUPS)),
    *_unit_conventions("rate", partial(_undo_unit, RATE_GROUPS)),
    Convention("quaternion-xyzw", "the quaternion is x, y, z, w{}", _put_scalar_first),
    Convention("omega-body", "the angular velocity is {}", _exchange_frames),
    Convention("omega-sign", "ω has the other sign than the attitude's own derivative{}",
               _undo_changes(("", _change_all(np.negative, *OMEGAS)))),
    Convention("inverse-rotation", "the rotation leads from space to body{}",
               _undo_changes(("", {"matrix": lambda R: np.swapaxes(R, 1, 2)}))),
    Convention("exchanged-angles", "angles are exchanged: {}", _exchange_angles),
    Convention("elevation", "the tilt is an elevation above the horizontal{}", _undo_changes(
        ("", {"theta": lambda x: QUARTER - x, "thetadot": np.negative}))),
    Convention("from-below", "the tilt is counted from below{}", _undo_changes(
        ("", {"theta": lambda x: np.pi - x, "thetadot": np.negative}))),
    Convention("y-up", "y is up: {}", _undo_axes(Y_UP)),
    Convention("z-down", "z is down: {}", _undo_axes("x -y -z"), cost=1.5),
    Convention("axes-permuted", "{}", _undo_axes("x -z y", "z x y", "-z y x")),
    Convention("mirrored", "the world is mirrored: {}", _undo_axes("x y z", mirrored=True)),
    Convention("mirrored", "{} the other way round", _undo_changes(
        ("φ counts", _change_all(np.negative, "phi", "phidot")),
        ("φ and ψ count", _change_all(np.negative, "phi", "phidot", "psi", "psidot")))),
    Convention("y-up+mirrored", "y is up, and the world is mirrored: {}",
               _undo_axes(Y_UP, mirrored=True), cost=2.0),
    Convention("axis-with-spin", "the axis is drawn with the spin angle: it turns {}",
               _take_spin_off),
    Convention("azimuth-origin", "φ is counted from another axis, turned by {}", _turn_azimuth,
               "origin"),
    Convention("spin-origin", "ψ is counted from another mark, turned by {}", _turn_spin,
               "origin"),
    Convention("inertia-about-centre", "A is about the centre of mass and not about the pivot: {}",
               _undo_fit({"A": SHRUNK}), "physics", rare=True),
    Convention("another-number", "another number explains the data: {}",
               _undo_fit({"A": GROWN} | dict.fromkeys(NUMBERS, CHANGED)), "number", 2.0, rare=True),
)  # fmt: skip
INERTIA_ROW, NUMBER_ROW = len(TABLE) - 2, len(TABLE) - 1  # the rows of fits, which take longer
