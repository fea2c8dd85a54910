"""The boundaries between kinds, as curves: zeros of the functions whose signs tell the kinds apart.

Each function is looked at on a mesh of its own, and every place where it changes its sign along an
edge of the mesh is then found to the last digits, so that a curve does not depend on the pixels.
Places are counted in steps of the mesh along x and y: arrays of shape (2, k).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from heavytop.studies.atlas_plane import Array, Mask, Momenta, Plane

MESH: Final = 401  # points of the mesh along either axis
HALVINGS: Final = 60
_ROUNDING: Final = (
    1e-9  # of its terms: a function as small as that everywhere has no zero of its own
)
_UPRIGHT: Final = 1e-12  # of sinθ


class Boundary(NamedTuple):
    """A piece of a boundary.

    Attributes
    ----------
    name : str
        A key of `BOUNDARIES`.
    x, y : ndarray, shape (k,)
        Its points; a single one where a boundary is a point of the plane.
    """

    name: str
    x: Array
    y: Array

    def document(self) -> dict[str, Any]:
        """Return the curve for JSON."""
        return {"name": self.name, "x": self.x.tolist(), "y": self.y.tolist()}


class Terms(NamedTuple):
    """A function as a sum of two terms, and where its zero is a boundary."""

    one: Array
    other: Array
    where: Mask

    @property
    def value(self) -> Array:
        """The function."""
        return np.asarray(self.one + self.other)


def _cusp(m: Momenta) -> Terms:
    """E' p_ψ = gMR p_φ, between the poles, where gMR p_ψ cosθ is on both sides."""
    inside = abs(_p_phi(m)) < abs(m.p_psi)
    if not np.any(m.across):  # let go without φ̇: what is squared in E′ touches zero
        return Terms(m.top["thetadot"], 0 * m.p_psi, inside)
    return Terms(m.kinetic * m.p_psi, -m.top["gMR"] * m.across, inside)


def _through_top(m: Momenta) -> Terms:
    """p_φ = p_ψ, and the energy to get to θ = 0."""
    return Terms(_drift(m), 0 * m.p_psi, (_lift(m) > 0) & ~_asleep(m))


def _through_bottom(m: Momenta) -> Terms:
    """p_φ = −p_ψ, and the energy E' > −gMR to get to θ = π."""
    gMR, theta = m.top["gMR"], m.top["theta"]
    energy = m.kinetic + gMR * np.cos(theta)
    return Terms(_p_phi(m), m.p_psi, (energy > -gMR) & ~_asleep(m))


def _steady(m: Momenta) -> Terms:
    """A cosθ φ̇² − p_ψ φ̇ + gMR = 0, let go with θ̇ = 0."""
    A, gMR, theta, phidot = (m.top[name] for name in ("A", "gMR", "theta", "phidot"))
    still = (m.top["thetadot"] == 0) & (np.sin(theta) > _UPRIGHT)
    return Terms(A * np.cos(theta) * phidot**2 + gMR, -m.p_psi * phidot, still)


def _sleeping(m: Momenta) -> Terms:
    """p_ψ² = 4 A gMR, on the vertical and at rest there."""
    upright = (m.top["theta"] == 0) & _asleep(m)
    return Terms(m.p_psi**2, -4 * m.top["A"] * m.top["gMR"], upright)


def _separatrix(m: Momenta) -> Terms:
    """E' = gMR, where p_φ = p_ψ on the whole plane."""
    equal = np.all(abs(_drift(m)) <= _ROUNDING * (abs(m.p_psi) + abs(_p_phi(m))))
    return Terms(_lift(m), 0 * m.p_psi, equal & ~_asleep(m))


BOUNDARIES: Final[Mapping[str, Callable[[Momenta], Terms]]] = {
    "cusp": _cusp,
    "through-top": _through_top,
    "through-bottom": _through_bottom,
    "steady": _steady,
    "sleeping": _sleeping,
    "separatrix": _separatrix,
}
"""By name, the function whose zeros they are. Where p_φ = p_ψ is itself a curve, the separatrix is
the point of it at which E' = gMR."""


def _p_phi(m: Momenta) -> Array:
    return np.asarray(m.across + m.p_psi * np.cos(m.top["theta"]))


def _rise(m: Momenta) -> Array:
    """1 − cosθ, without cancellation near the top."""
    return np.asarray(2 * np.sin(m.top["theta"] / 2) ** 2)


def _drift(m: Momenta) -> Array:
    """p_φ − p_ψ."""
    return np.asarray(m.across - m.p_psi * _rise(m))


def _lift(m: Momenta) -> Array:
    """E' − gMR: positive where there is energy to get to θ = 0."""
    return np.asarray(m.kinetic - m.top["gMR"] * _rise(m))


def _asleep(m: Momenta) -> Mask:
    """Where the axis rests on the vertical."""
    return np.asarray((np.sin(m.top["theta"]) <= _UPRIGHT) & (m.top["thetadot"] == 0))


def curves(plane: Plane) -> tuple[Boundary, ...]:
    """Every boundary that crosses a plane; those that are points of it come last.

    Parameters
    ----------
    plane : Plane

    Notes
    -----
    A boundary that touches a pixel's corner of the mesh twice, or is smaller than a cell of it,
    is missed; the ends of curves are found to a cell.

    Examples
    --------
    Between loops and waves, at a kick of nothing:

    >>> from heavytop.scene.scene import load_scene
    >>> from heavytop.studies.atlas_plane import Axis
    >>> axes = Axis.of("phidot=-1:2:9"), Axis.of("psidot=100:150:9")
    >>> plane = Plane(load_scene("sicm-dropped"), *axes)
    >>> [(each.name, float(abs(each.x).max()) < 1e-12) for each in curves(plane)]
    [('cusp', True)]
    """
    found: list[Boundary] = []
    with np.errstate(all="ignore"):
        points = [("sleeping", place) for place in _thresholds_of_sleep(plane)]
        mesh = _momenta(plane, np.array(np.meshgrid(*2 * [np.arange(MESH, dtype=np.float64)])))
        for name, function in BOUNDARIES.items():
            for line in _zeros(plane, function, mesh):
                momenta = _momenta(plane, line)
                parts = _runs(function(momenta).where)
                found += [Boundary(name, *_values(plane, line[:, part])) for part in parts]
                if name == "through-top":
                    crossed = _crossings(_lift(momenta), line)
                    points += [("separatrix", place) for place in crossed]
    return (*found, *(Boundary(name, *_values(plane, place)) for name, place in points))


def _zeros(plane: Plane, function: Callable[[Momenta], Terms], mesh: Momenta) -> Iterator[Array]:
    """The zeros of a function, as lines of places."""
    from contourpy import contour_generator

    terms = function(mesh)
    size = abs(terms.one) + abs(terms.other)
    known = np.isfinite(size)
    nothing = np.all(abs(terms.value)[known] <= _ROUNDING * size[known])
    if nothing or not terms.where.any():
        return
    value = np.ma.masked_invalid(np.where(mesh.possible, terms.value, np.nan))
    for line in contour_generator(z=value).lines(0.0):
        yield _sharp(plane, function, np.asarray(line).T)


def _sharp(plane: Plane, function: Callable[[Momenta], Terms], places: Array) -> Array:
    """Places on edges of the mesh, moved along them to where the sign changes."""
    off_x, off_y = abs(places - np.rint(places))
    along = np.stack((off_y <= off_x, off_y > off_x))
    start = np.where(along, np.minimum(np.floor(places), MESH - 2), np.rint(places))

    def sign(share: Array) -> Array:
        return np.asarray(np.sign(function(_momenta(plane, start + share * along)).value))

    low, high = np.zeros_like(off_x), np.ones_like(off_x)
    below = sign(low)
    crossed = below * sign(high) < 0  # not where a zero is at a point of the mesh itself
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        same = sign(middle) == below
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return np.where(along & ~crossed, places, start + high * along)


def _thresholds_of_sleep(plane: Plane) -> Iterator[Array]:
    """The places on an edge of the plane where θ = 0 at which sleep becomes stable."""
    steps = np.arange(MESH, dtype=np.float64)
    for axis, edge in ((plane.x, (0 * steps, steps)), (plane.y, (steps, 0 * steps))):
        if axis.name == "theta" and axis.low.sign() == 0:
            terms = _sleeping(_momenta(plane, np.array(edge)))
            value = np.where(terms.where, terms.value, np.nan)
            for place in _crossings(value, np.array(edge)):
                yield _sharp(plane, _sleeping, place)


def _crossings(value: Array, line: Array) -> Iterator[Array]:
    """The places at which a function changes its sign along a line."""
    for k in np.flatnonzero(value[1:] * value[:-1] < 0).tolist():
        share = value[k] / (value[k] - value[k + 1])
        yield line[:, k : k + 1] + share * (line[:, k + 1 : k + 2] - line[:, k : k + 1])


def _momenta(plane: Plane, places: Array) -> Momenta:
    return Momenta.of(plane.at(*_values(plane, places)))


def _values(plane: Plane, places: Array) -> tuple[Array, Array]:
    """The values of x and y at places."""
    x, y = (
        axis.at(each / (MESH - 1)) for axis, each in zip((plane.x, plane.y), places, strict=True)
    )
    return x, y


def _runs(where: Mask) -> list[slice]:
    """The runs of places where a zero is a boundary, of two places at least."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], where, [False])).astype(np.int8)))
    return [slice(*pair) for pair in edges.reshape(-1, 2).tolist() if pair[1] - pair[0] > 1]
