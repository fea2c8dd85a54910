"""The plane of an atlas: two axes through a scene, the top of every pixel, and where kinds meet.

The boundaries between kinds are the zeros of functions, whose signs distinguish the kinds. Each is
evaluated on a mesh that does not depend on the pixels; where it changes its sign along an edge of
the mesh its zero is then found to the last digits.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from math import lcm, pi
from typing import Any, Final, NamedTuple

import numpy as np

from heavytop.analytic.motion import Motion
from heavytop.classification.arrays import Mask
from heavytop.errors import Refused
from heavytop.exact import Exact
from heavytop.exact.pairs import Array
from heavytop.exact.parse import of_one_unit
from heavytop.results.atlas import ROLES as ROLES
from heavytop.results.table import Row
from heavytop.scene.quantities import PLAIN_NUMBER, QUANTITY_READERS
from heavytop.scene.scene import Scene
from heavytop.text import nearest

MOST_VALUES: Final = 1_000_000  # along one axis
WIDEST_TILE: Final = 4096  # pixels in a row of a tile
VERTICAL_SINE: Final = 1e-12  # sinθ of an axis on the vertical
MESH: Final = 401  # points along either axis, at which boundaries are looked for
CURVE_HALVINGS: Final = 60
# of its terms: a function as small as that everywhere has no zero of its own
PLANE_ROUNDING: Final = 1e-9

# --- axes -----------------------------------------------------------------------------------------


FORM: Final = "NAME=FROM:TO:COUNT, such as phidot=-20:20:2000 (or …:COUNT:log)"
_TEXT: Final = re.compile(
    r"\s*(?:(?:top|start)\.)?([^=]*?)\s*="
    r"([^:]*[^:\s][^:]*):([^:]*[^:\s][^:]*):\s*(\d{1,20})\s*(?::\s*(log)\s*)?"
)


@dataclass(frozen=True)
class Axis:
    """The values of one number of a scene along an axis; a pixel is the top at its middle.

    Attributes
    ----------
    name : str
        One of `ROLES`.
    low, high : Exact
        The first and the last value, the first the smaller.
    count : int
        How many there are, both ends among them.
    log : bool
        Whether neighbours have the same ratio and not the same difference.
    """

    name: str
    low: Exact
    high: Exact
    count: int
    log: bool = False

    @classmethod
    def of(cls, text: object) -> Axis:
        """Return the axis of a text, whose ends are read as a scene reads such a number.

        Raises
        ------
        Refused, NotANumber
            It has no name of a number, no range, or too many pixels or too few.

        Examples
        --------
        >>> Axis.of("phidot=-20:20:5").values
        array([-20., -10.,   0.,  10.,  20.])
        """
        match = _TEXT.fullmatch(text) if isinstance(text, str) else None
        if match is None:
            raise Refused(f"a text {FORM}")
        name, *ends, count, scale = match.groups()
        if name not in ROLES:
            raise Refused(f"NAME must be one of {', '.join(ROLES)}", nearest(name, ROLES))
        low, high = map(QUANTITY_READERS.get(name, PLAIN_NUMBER), of_one_unit(*ends))
        if not 2 <= int(count) <= MOST_VALUES:
            raise Refused(f"from 2 to {MOST_VALUES} pixels")
        if not float(low) < float(high):
            raise Refused("FROM is to be less than TO, as doubles")
        if scale and (low.sign(), high.sign()) not in ((1, 1), (-1, -1)):
            raise Refused("a logarithmic axis does not reach 0")
        return cls(name, low, high, int(count), scale == "log")

    @classmethod
    def of_range(cls, known: Mapping[str, Any]) -> Axis:
        """Return the axis of the `range` in a result."""
        return cls(**{**known, "low": Exact.of(known["low"]), "high": Exact.of(known["high"])})

    @property
    def text(self) -> str:
        """The text from which `of` reads the axis."""
        return f"{self.name}={self.low}:{self.high}:{self.count}{':log' if self.log else ''}"

    @property
    def range(self) -> dict[str, Any]:
        """The axis as a result has it."""
        ends = {"low": float(self.low), "high": float(self.high)}
        return {"name": self.name, **ends, "count": self.count, "log": self.log}

    @cached_property
    def values(self) -> Array:
        """The values, increasing; on a linear axis each is the double nearest the exact one."""
        if self.log:
            values = self.at(np.arange(self.count) / (self.count - 1))
            values[0], values[-1] = float(self.low), float(self.high)
            return values
        return np.fromiter(even_values(self.low, self.high, self.count), np.float64, self.count)

    def at(self, share: Array) -> Array:
        """Return the values at shares, 0 to 1, of the way from the low end to the high one."""
        low, high = float(self.low), float(self.high)
        if self.log:
            return np.asarray(low * (high / low) ** share)
        return np.asarray(low * (1 - share) + high * share)


def even_values(low: Exact, high: Exact, count: int) -> Iterator[float]:
    """Return evenly spaced numbers from one to another, each the double nearest the exact one.

    >>> [*even_values(Exact.of("0"), Exact.of("0.3"), 4)]
    [0.0, 0.1, 0.2, 0.3]
    """
    first, last = (Fraction(float(x)) if x.fraction is None else x.fraction for x in (low, high))
    step = (last - first) / max(count - 1, 1)
    below = lcm(first.denominator, step.denominator)
    begun, rise = int(first * below), int(step * below)  # integers: fractions are ten times slower
    return ((begun + rise * k) / below for k in range(count))


# --- the plane ------------------------------------------------------------------------------------


Tile = tuple[slice, slice]
"""A rectangle of pixels that is computed at once: slices of the y axis and of the x axis."""


@dataclass(frozen=True)
class Plane:
    """Two axes through the top and start of a scene.

    Parameters
    ----------
    scene : Scene
        Gives every number that no axis changes, rounded to the nearest double.
    x, y : Axis
        They set different things: two axes for the spin, such as psidot and p_psi, are impossible.
    """

    scene: Scene
    x: Axis
    y: Axis

    @property
    def shape(self) -> tuple[int, int]:
        """Pixels along y, and along x."""
        return self.y.count, self.x.count

    def tiles(self, most: int) -> dict[str, Tile]:
        """Return the tiles of the plane by name, each of at most so many pixels."""
        width = min(self.x.count, WIDEST_TILE)
        height = max(1, most // width)
        return {
            f"{row:07d}/{column:07d}": np.s_[row : row + height, column : column + width]
            for row in range(0, self.y.count, height)
            for column in range(0, self.x.count, width)
        }

    def tops(self, tile: Tile) -> dict[str, Any]:
        """Return the tops and starts of a tile, as `heavytop.classify_many` takes them.

        Impossible ones are nan. On an axis of p_phi, p_psi or E the rates that give it are rounded
        to doubles, so that the pixel is that of the rounded rates.
        """
        rows, columns = tile
        return self.at(self.x.values[columns][None, :], self.y.values[rows][:, None])

    def at(self, x: Array, y: Array) -> dict[str, Any]:
        """Return the tops and starts at points of the plane, given as arrays that broadcast."""
        numbers = self.held | {self.x.name: x, self.y.name: y}
        with np.errstate(all="ignore"):
            return _with_rates(numbers, float(self.scene.start.thetadot))

    @cached_property
    def held(self) -> dict[str, Any]:
        """The numbers of the scene that no axis changes, by name."""
        top, start = self.scene.top, self.scene.start
        numbers = {name: getattr(top, name) for name in ("A", "C", "gMR")}
        names = ("theta", "thetadot", "phidot", start.held)
        numbers |= {name: getattr(start, name) for name in names}
        changed = {ROLES[axis.name] for axis in (self.x, self.y)}
        return {name: float(value) for name, value in numbers.items() if ROLES[name] not in changed}

    @property
    def place(self) -> tuple[float, float]:
        """Where the scene itself lies, on the map or beside it."""
        top, start = self.scene.top, self.scene.start
        given = (start, top, Motion(top, start).constants)
        names = (self.x.name, self.y.name)
        x, y = (next(float(getattr(of, n)) for of in given if hasattr(of, n)) for n in names)
        return x, y


def _with_rates(numbers: Mapping[str, Any], branch: float) -> dict[str, Any]:
    """Return numbers of a scene with rates for momenta and energy; θ̇ has the sign of `branch`.

    p_ψ = C ω3, p_φ = A φ̇ sin²θ + p_ψ cosθ, E = ½A (θ̇² + φ̇² sin²θ) + ½C ω3² + gMR cosθ.
    """
    found = dict(numbers)
    A, C, gMR, theta = (found[name] for name in ("A", "C", "gMR", "theta"))
    u, sine = np.cos(theta), np.where(np.equal(theta, pi), 0.0, np.sin(theta))
    if "p_psi" in found:
        found["omega3"] = found.pop("p_psi") / C
    if "p_phi" in found:
        p_phi = found.pop("p_phi")
        if "psidot" in found:
            found["phidot"] = (p_phi - C * found["psidot"] * u) / (A * sine**2 + C * u**2)
        else:  # a pole is reached with p_φ = p_ψ cosθ alone, and φ̇ is its limit there
            p_psi = C * found["omega3"]
            missed = p_phi - p_psi * u
            limit = np.where(missed == 0, p_psi * u / (2 * A), np.nan)
            found["phidot"] = np.where(sine == 0, limit, missed / (A * sine**2))
    if "E" in found:
        phidot = found["phidot"]
        omega3 = found["omega3"] if "omega3" in found else found["psidot"] + phidot * u
        least = A * (phidot * sine) ** 2 / 2 + C * omega3**2 / 2 + gMR * u
        found["thetadot"] = np.copysign(np.sqrt(2 * (found.pop("E") - least) / A), branch)
    return found


# --- boundaries -----------------------------------------------------------------------------------


class Terms(NamedTuple):
    """A function as a sum of two terms, where its zero is a boundary, where a top is possible."""

    one: Array
    other: Array
    where: Mask
    possible: Mask

    @property
    def value(self) -> Array:
        """The function."""
        return np.asarray(self.one + self.other)


def boundaries(tops: Mapping[str, Any], let_go: bool) -> dict[str, Terms]:
    """Return the functions whose zeros are the boundaries, at some tops and starts, by name.

    `let_go`: the whole plane has φ̇ = 0, not only some points. Where p_φ = p_ψ is itself a curve,
    the separatrix is the point of it at which E' = gMR.
    """
    wide = np.broadcast_arrays(*(np.asarray(each, np.float64) for each in tops.values()))
    top = dict(zip(tops, wide, strict=True))
    names = ("A", "C", "gMR", "theta", "thetadot", "phidot")
    A, C, gMR, theta, thetadot, phidot = (top[name] for name in names)
    u, sine, rise = np.cos(theta), np.sin(theta), 2 * np.sin(theta / 2) ** 2
    omega3 = top["omega3"] if "omega3" in top else top["psidot"] + phidot * u
    kinetic = A * (thetadot**2 + (phidot * sine) ** 2) / 2
    across, p_psi = A * phidot * sine**2, C * omega3
    p_phi = across + p_psi * u
    p_minus, lift = across - p_psi * rise, kinetic - gMR * rise  # without cancellation
    still, none = thetadot == 0, 0 * p_psi
    awake = ~((sine <= VERTICAL_SINE) & still)  # does not rest on the vertical
    possible = np.isfinite(kinetic + p_psi) & (A > 0) & (C > 0) & (2 * A >= C)
    possible &= (theta >= 0) & (theta <= pi)
    inside = abs(p_phi) < abs(p_psi)  # gMR p_ψ cosθ is on both sides of E' p_ψ = gMR p_φ
    cusp = (kinetic * p_psi, -gMR * across)
    if let_go:  # else the function, with θ̇², touches zero without a change of sign
        cusp = (thetadot, none)
    equal = np.all(abs(p_minus) <= PLANE_ROUNDING * (abs(p_psi) + abs(p_phi)))
    falls = kinetic + gMR * u > -gMR  # it has the energy to get to θ = π
    found = {
        "cusp": (*cusp, inside),
        "through-top": (p_minus, none, (lift > 0) & awake),  # there p_φ = p_ψ: it gets to θ = 0
        "through-bottom": (p_phi, p_psi, falls & awake),
        "steady": (A * u * phidot**2 + gMR, -p_psi * phidot, still & (sine > VERTICAL_SINE)),
        "sleeping": (p_psi**2, -4 * A * gMR, (theta == 0) & ~awake),
        "separatrix": (lift, none, equal & awake),
    }
    return {name: Terms(*each, possible) for name, each in found.items()}


def curves(plane: Plane) -> tuple[Row, ...]:
    """Return ``name``, ``x`` and ``y`` of every boundary that crosses a plane; points come last.

    In the functions below places are arrays of shape (2, k), in steps of the mesh along x and y. A
    boundary that crosses an edge of the mesh twice, or is smaller than a cell of it, is missed; the
    ends of curves are found to a cell.

    Examples
    --------
    Between loops and waves, at a kick of nothing:

    >>> from heavytop.scene.scene import load_scene
    >>> axes = Axis.of("phidot=-1:2:9"), Axis.of("psidot=100:150:9")
    >>> plane = Plane(load_scene("sicm-dropped"), *axes)
    >>> [(each.name, float(abs(each.x).max()) < 1e-12) for each in curves(plane)]
    [('cusp', True)]
    """
    found = []
    with np.errstate(all="ignore"):
        mesh = np.array(np.meshgrid(*2 * [np.arange(MESH, dtype=np.float64)]))
        for name, terms in _boundaries_at(plane, mesh).items():
            for line in _zeros(plane, name, terms):
                here = _boundaries_at(plane, line)
                where = here[name].where
                marked = np.ma.array(where, mask=where)
                for part in np.ma.clump_masked(marked):  # type: ignore[no-untyped-call]
                    piece = _piece(plane, name, line[:, part])
                    if piece.x.size > 1 or name == "sleeping":  # the end of a line, where θ = 0
                        found.append(piece)
                if name == "through-top":
                    lift = here["separatrix"].value
                    for k in np.flatnonzero(lift[1:] * lift[:-1] < 0).tolist():
                        share = lift[k] / (lift[k] - lift[k + 1])
                        place = line[:, k] + share * (line[:, k + 1] - line[:, k])
                        found.append(_piece(plane, "separatrix", place[:, None]))
    return tuple(sorted(found, key=lambda each: each.x.size == 1))


def _zeros(plane: Plane, name: str, terms: Terms) -> Iterator[Array]:
    """Yield the zeros of a function, as lines of places."""
    from contourpy import contour_generator

    size = abs(terms.one) + abs(terms.other)
    known = np.isfinite(size)
    nothing = np.all(abs(terms.value)[known] <= PLANE_ROUNDING * size[known])
    if nothing or not terms.where.any():
        return
    value = np.ma.masked_invalid(np.where(terms.possible, terms.value, np.nan))
    for line in contour_generator(z=value).lines(0.0):
        yield _sharpen(plane, name, np.asarray(line).T)


def _sharpen(plane: Plane, name: str, places: Array) -> Array:
    """Return places on edges of the mesh, moved along these to where the sign changes."""
    off_x, off_y = abs(places - np.rint(places))
    along = np.stack((off_y <= off_x, off_y > off_x))
    start = np.where(along, np.minimum(np.floor(places), MESH - 2), np.rint(places))

    def sign(share: Array) -> Array:
        return np.asarray(np.sign(_boundaries_at(plane, start + share * along)[name].value))

    low, high = np.zeros_like(off_x), np.ones_like(off_x)
    below = sign(low)
    crossed = below * sign(high) < 0  # not where a zero is at a point of the mesh itself
    for _ in range(CURVE_HALVINGS):
        middle = (low + high) / 2
        same = sign(middle) == below
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return np.where(along & ~crossed, places, start + high * along)


def _boundaries_at(plane: Plane, places: Array) -> dict[str, Terms]:
    """Return the functions of the boundaries at places."""
    return boundaries(plane.at(*_values(plane, places)), plane.held.get("phidot") == 0)


def _piece(plane: Plane, name: str, places: Array) -> Row:
    """Return a piece of a boundary through places."""
    x, y = _values(plane, places)
    return Row(name=name, x=x, y=y)


def _values(plane: Plane, places: Array) -> tuple[Array, ...]:
    """Return the values of x and y at places."""
    axes = zip((plane.x, plane.y), places, strict=True)
    return tuple(axis.at(each / (MESH - 1)) for axis, each in axes)
