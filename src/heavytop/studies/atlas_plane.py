"""The plane of an atlas: two axes through a scene, the top of every pixel, and where kinds meet.

The boundaries between kinds are the zeros of the functions whose signs tell the kinds apart. Each
function is looked at on a mesh of its own, and every place where it changes its sign along an edge
of the mesh is then found to the last digits, so that a curve does not depend on the pixels.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from math import pi
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from heavytop.analytic.motion import Motion
from heavytop.classification.arrays import IMPOSSIBLE, TAG_NAMES, VERDICT_NAMES
from heavytop.classification.kinds import Kind
from heavytop.exact import Exact
from heavytop.results.atlas import ROLES as ROLES
from heavytop.scene.arguments import Refused
from heavytop.scene.quantities import PLAIN_NUMBER, QUANTITY_READERS
from heavytop.scene.scene import Scene
from heavytop.text import nearest

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Columns = dict[str, NDArray[Any]]

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
    r"\s*([^=]*?)\s*=([^:]*[^:\s][^:]*):([^:]*[^:\s][^:]*):\s*(\d{1,20})\s*(?::\s*(log)\s*)?"
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
        """The axis that a text says; its ends are read as a scene reads such a number.

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
        low, high = map(QUANTITY_READERS.get(name, PLAIN_NUMBER), ends)
        if not 2 <= int(count) <= MOST_VALUES:
            raise Refused(f"from 2 to {MOST_VALUES} pixels")
        if not float(low) < float(high):
            raise Refused("FROM is to be less than TO, as doubles")
        if scale and (low.sign(), high.sign()) not in ((1, 1), (-1, -1)):
            raise Refused("a logarithmic axis does not reach 0")
        return cls(name, low, high, int(count), scale == "log")

    @classmethod
    def of_range(cls, known: Mapping[str, Any]) -> Axis:
        """The axis that a result names."""
        return cls(**{**known, "low": Exact.of(known["low"]), "high": Exact.of(known["high"])})

    @property
    def text(self) -> str:
        """The axis as it can be read again."""
        return f"{self.name}={self.low}:{self.high}:{self.count}{':log' if self.log else ''}"

    @property
    def range(self) -> dict[str, Any]:
        """The axis in a result."""
        ends = {"low": float(self.low), "high": float(self.high)}
        return {"name": self.name, **ends, "count": self.count, "log": self.log}

    @cached_property
    def values(self) -> Array:
        """The values, increasing: of a linear axis each the double nearest the exact one."""
        last = self.count - 1
        if self.log:
            values = self.at(np.arange(self.count) / last)
            values[0], values[-1] = float(self.low), float(self.high)
            return values
        low, high = ((end.fraction or Fraction(float(end))) for end in (self.low, self.high))
        scale = low.denominator * high.denominator
        first, final, under = int(low * scale), int(high * scale), scale * last
        # A quotient of integers is rounded once.
        exact = ((first * (last - k) + final * k) / under for k in range(self.count))
        return np.fromiter(exact, np.float64, self.count)

    def at(self, share: Array) -> Array:
        """The values at a share of the way from the low end to the high one."""
        low, high = float(self.low), float(self.high)
        if self.log:
            return np.asarray(low * (high / low) ** share)
        return np.asarray(low * (1 - share) + high * share)


# --- the plane ------------------------------------------------------------------------------------


Tile = tuple[slice, slice]
"""A rectangle of pixels that is computed at once: slices of the y axis and of the x axis."""


@dataclass(frozen=True)
class Plane:
    """Two axes through the top and start of a scene.

    Parameters
    ----------
    scene : Scene
        Says every number that no axis changes. Doubles nearest to its numbers are used.
    x, y : Axis
        They set different things: two axes for the spin, such as psidot and p_psi, do not go.
    """

    scene: Scene
    x: Axis
    y: Axis

    @property
    def shape(self) -> tuple[int, int]:
        """Pixels along y, and along x."""
        return self.y.count, self.x.count

    def tiles(self, most: int) -> dict[str, Tile]:
        """Cut the plane into tiles of at most so many pixels, always the same ones, by name."""
        width = min(self.x.count, WIDEST_TILE)
        height = max(1, most // width)
        return {
            f"{row:07d}/{column:07d}": np.s_[row : row + height, column : column + width]
            for row in range(0, self.y.count, height)
            for column in range(0, self.x.count, width)
        }

    def tops(self, tile: Tile) -> dict[str, Any]:
        """The tops and starts of a tile, as `heavytop.classify_many` takes them.

        What no top or start can be is nan. Where an axis holds p_phi, p_psi or E the rates that
        give it are rounded to doubles, so that the pixel is that of the rounded rates.
        """
        rows, columns = tile
        return self.at(self.x.values[columns][None, :], self.y.values[rows][:, None])

    def at(self, x: Array, y: Array) -> dict[str, Any]:
        """The tops and starts at places of the plane, given as arrays that broadcast."""
        with np.errstate(all="ignore"):
            return _with_rates(
                self.held | {self.x.name: x, self.y.name: y}, float(self.scene.start.thetadot)
            )

    @cached_property
    def held(self) -> dict[str, Any]:
        """The numbers of the scene that no axis changes, by name."""
        top, start = self.scene.top, self.scene.start
        numbers = {name: getattr(top, name) for name in ("A", "C", "gMR")} | {
            name: getattr(start, name) for name in ("theta", "thetadot", "phidot", start.held)
        }
        changed = {ROLES[axis.name] for axis in (self.x, self.y)}
        return {name: float(value) for name, value in numbers.items() if ROLES[name] not in changed}

    @property
    def place(self) -> tuple[float, float]:
        """Where the scene itself lies, on the map or beside it."""
        top, start = self.scene.top, self.scene.start
        given = (start, top, Motion(top, start).constants)
        x, y = (
            next(float(getattr(each, axis.name)) for each in given if hasattr(each, axis.name))
            for axis in (self.x, self.y)
        )
        return x, y


def _with_rates(numbers: Mapping[str, Any], branch: float) -> dict[str, Any]:
    """Numbers of a scene, with rates in place of momenta and energy; θ̇ has the sign of `branch`.

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


class Momenta(NamedTuple):
    """Constants of the motion at places of a plane, as arrays of one shape.

    Attributes
    ----------
    top : mapping of str to ndarray
        The tops and starts.
    kinetic, across : ndarray
        ½A (θ̇² + φ̇² sin²θ) and A φ̇ sin²θ.
    p_psi, p_phi : ndarray
    p_minus, lift : ndarray
        p_φ − p_ψ and E' − gMR, without cancellation near the top: where p_φ = p_ψ the axis gets to
        θ = 0 if `lift` is positive.
    asleep, possible : ndarray of bool
        Where the axis rests on the vertical, and where a top and a start have such numbers.
    """

    top: Mapping[str, Array]
    kinetic: Array
    across: Array
    p_psi: Array
    p_phi: Array
    p_minus: Array
    lift: Array
    asleep: Mask
    possible: Mask


def constants(tops: Mapping[str, Any]) -> Momenta:
    """The constants of tops and starts."""
    wide = np.broadcast_arrays(*(np.asarray(each, np.float64) for each in tops.values()))
    top = dict(zip(tops, wide, strict=True))
    A, C, theta, thetadot, phidot = (top[n] for n in ("A", "C", "theta", "thetadot", "phidot"))
    u, sine, rise = np.cos(theta), np.sin(theta), 2 * np.sin(theta / 2) ** 2
    omega3 = top["omega3"] if "omega3" in top else top["psidot"] + phidot * u
    kinetic = A * (thetadot**2 + (phidot * sine) ** 2) / 2
    across, p_psi = A * phidot * sine**2, C * omega3
    asleep = (sine <= VERTICAL_SINE) & (thetadot == 0)
    finite = np.isfinite(kinetic + p_psi)
    possible = finite & (A > 0) & (C > 0) & (2 * A >= C) & (theta >= 0) & (theta <= pi)
    return Momenta(
        top, kinetic, across, p_psi, across + p_psi * u, across - p_psi * rise,
        kinetic - top["gMR"] * rise, asleep, possible,
    )  # fmt: skip


# --- θ = π ----------------------------------------------------------------------------------------
# The double nearest π is not π, but that is what it means. Seen from below, θ → π − θ, ψ → −ψ and
# g → −g, such a start is at θ = 0, where doubles are exact.

_TURNED: Final = ("gMR", "thetadot", "psidot", "omega3")


def mirrored(tops: Mapping[str, Any], bottom: Mask) -> dict[str, Any]:
    """The tops, those at the bottom as they are seen from below."""
    turned = {name: np.where(bottom, -tops[name], tops[name]) for name in _TURNED if name in tops}
    return {**tops, **turned, "theta": np.where(bottom, 0.0, tops["theta"])}


def restored(columns: Columns, tops: Mapping[str, Any], bottom: Mask) -> Columns:
    """The columns of mirrored tops, as they are seen from above."""
    found, kind = dict(columns), columns["kind"]
    swapped = np.arange(len(VERDICT_NAMES), dtype=np.uint8)
    poles = [VERDICT_NAMES.index(each) for each in (Kind.THROUGH_TOP, Kind.THROUGH_BOTTOM)]
    swapped[poles] = poles[::-1]
    found["kind"] = np.where(bottom, swapped[kind], kind)
    if "tags" in found:
        weighted = bottom & np.not_equal(tops["gMR"], 0) & (kind != IMPOSSIBLE)
        inverted = np.uint8(1 << TAG_NAMES.index("inverted-gravity"))
        found["tags"] = np.where(weighted, found["tags"] ^ inverted, found["tags"])
        found["theta_min"] = np.where(bottom, pi - columns["theta_max"], columns["theta_min"])
        found["theta_max"] = np.where(bottom, pi - columns["theta_min"], columns["theta_max"])
        found["spin"] = np.where(bottom, -found["spin"], found["spin"])
    return found


# --- boundaries -----------------------------------------------------------------------------------


class Boundary(NamedTuple):
    """A piece of a boundary.

    Attributes
    ----------
    name : str
        A key of `boundaries`.
    x, y : ndarray, shape (k,)
        Its points; a single one where a boundary is a point of the plane.
    """

    name: str
    x: Array
    y: Array


class Terms(NamedTuple):
    """A function as a sum of two terms, and where its zero is a boundary."""

    one: Array
    other: Array
    where: Mask

    @property
    def value(self) -> Array:
        """The function."""
        return np.asarray(self.one + self.other)


def boundaries(m: Momenta) -> dict[str, Terms]:
    """By the name of a boundary, the function whose zeros it is, at some places.

    Where p_φ = p_ψ is itself a curve, the separatrix is the point of it at which E' = gMR.
    """
    A, gMR, theta, phidot = (m.top[name] for name in ("A", "gMR", "theta", "phidot"))
    none, u, still = 0 * m.p_psi, np.cos(theta), m.top["thetadot"] == 0
    inside = abs(m.p_phi) < abs(m.p_psi)  # gMR p_ψ cosθ is on both sides of E' p_ψ = gMR p_φ
    cusp = Terms(m.kinetic * m.p_psi, -gMR * m.across, inside)
    if not np.any(m.across):  # let go without φ̇: what is squared in E′ touches zero
        cusp = Terms(m.top["thetadot"], none, inside)
    equal = np.all(abs(m.p_minus) <= PLANE_ROUNDING * (abs(m.p_psi) + abs(m.p_phi)))
    falls = m.kinetic + gMR * u > -gMR  # it has the energy to get to θ = π
    return {
        "cusp": cusp,
        "through-top": Terms(m.p_minus, none, (m.lift > 0) & ~m.asleep),
        "through-bottom": Terms(m.p_phi, m.p_psi, falls & ~m.asleep),
        "steady": Terms(
            A * u * phidot**2 + gMR, -m.p_psi * phidot, still & (np.sin(theta) > VERTICAL_SINE)
        ),
        "sleeping": Terms(m.p_psi**2, -4 * A * gMR, (theta == 0) & m.asleep),
        "separatrix": Terms(m.lift, none, equal & ~m.asleep),
    }


def curves(plane: Plane) -> tuple[Boundary, ...]:
    """Every boundary that crosses a plane; those that are points of it come last.

    Places on the way are counted in steps of the mesh along x and y: arrays of shape (2, k).
    A boundary that touches a pixel's corner of the mesh twice, or is smaller than a cell of it,
    is missed; the ends of curves are found to a cell.

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
        mesh = _momenta(plane, np.array(np.meshgrid(*2 * [np.arange(MESH, dtype=np.float64)])))
        for name, terms in boundaries(mesh).items():
            for line in _zeros(plane, name, terms, mesh.possible):
                momenta = _momenta(plane, line)
                where = boundaries(momenta)[name].where
                marked = np.ma.array(where, mask=where)
                for part in np.ma.clump_masked(marked):  # type: ignore[no-untyped-call]
                    piece = Boundary(name, *_values(plane, line[:, part]))
                    if piece.x.size > 1 or name == "sleeping":  # the end of a line, where θ = 0
                        found.append(piece)
                if name == "through-top":
                    lift = momenta.lift
                    for k in np.flatnonzero(lift[1:] * lift[:-1] < 0).tolist():
                        share = lift[k] / (lift[k] - lift[k + 1])
                        place = line[:, k] + share * (line[:, k + 1] - line[:, k])
                        found.append(Boundary("separatrix", *_values(plane, place[:, None])))
    return tuple(sorted(found, key=lambda each: each.x.size == 1))


def _zeros(plane: Plane, name: str, terms: Terms, possible: Mask) -> Iterator[Array]:
    """The zeros of a function, as lines of places."""
    from contourpy import contour_generator

    size = abs(terms.one) + abs(terms.other)
    known = np.isfinite(size)
    nothing = np.all(abs(terms.value)[known] <= PLANE_ROUNDING * size[known])
    if nothing or not terms.where.any():
        return
    value = np.ma.masked_invalid(np.where(possible, terms.value, np.nan))
    for line in contour_generator(z=value).lines(0.0):
        yield _sharp(plane, name, np.asarray(line).T)


def _sharp(plane: Plane, name: str, places: Array) -> Array:
    """Places on edges of the mesh, moved along them to where the sign changes."""
    off_x, off_y = abs(places - np.rint(places))
    along = np.stack((off_y <= off_x, off_y > off_x))
    start = np.where(along, np.minimum(np.floor(places), MESH - 2), np.rint(places))

    def sign(share: Array) -> Array:
        momenta = _momenta(plane, start + share * along)
        return np.asarray(np.sign(boundaries(momenta)[name].value))

    low, high = np.zeros_like(off_x), np.ones_like(off_x)
    below = sign(low)
    crossed = below * sign(high) < 0  # not where a zero is at a point of the mesh itself
    for _ in range(CURVE_HALVINGS):
        middle = (low + high) / 2
        same = sign(middle) == below
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return np.where(along & ~crossed, places, start + high * along)


def _momenta(plane: Plane, places: Array) -> Momenta:
    return constants(plane.at(*_values(plane, places)))


def _values(plane: Plane, places: Array) -> tuple[Array, Array]:
    """The values of x and y at places."""
    x, y = (
        axis.at(each / (MESH - 1)) for axis, each in zip((plane.x, plane.y), places, strict=True)
    )
    return x, y
