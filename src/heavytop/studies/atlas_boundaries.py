"""The boundaries between kinds, as curves: zeros of the functions whose signs tell the kinds apart.

Each function is looked at on a mesh of its own, and every place where it changes its sign along an
edge of the mesh is then found to the last digits, so that a curve does not depend on the pixels.
Places are counted in steps of the mesh along x and y: arrays of shape (2, k).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Final, NamedTuple

import numpy as np

from heavytop.studies.atlas_plane import UPRIGHT, Array, Mask, Momenta, Plane, constants

MESH: Final = 401  # points of the mesh along either axis
HALVINGS: Final = 60
_ROUNDING: Final = (
    1e-9  # of its terms: a function as small as that everywhere has no zero of its own
)


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
    inside = abs(m.p_phi) < abs(m.p_psi)
    if not np.any(m.across):  # let go without φ̇: what is squared in E′ touches zero
        return Terms(m.top["thetadot"], 0 * m.p_psi, inside)
    return Terms(m.kinetic * m.p_psi, -m.top["gMR"] * m.across, inside)


def _through_top(m: Momenta) -> Terms:
    """p_φ = p_ψ, and the energy to get to θ = 0."""
    return Terms(m.p_minus, 0 * m.p_psi, (m.lift > 0) & ~m.asleep)


def _through_bottom(m: Momenta) -> Terms:
    """p_φ = −p_ψ, and the energy E' > −gMR to get to θ = π."""
    gMR, theta = m.top["gMR"], m.top["theta"]
    energy = m.kinetic + gMR * np.cos(theta)
    return Terms(m.p_phi, m.p_psi, (energy > -gMR) & ~m.asleep)


def _steady(m: Momenta) -> Terms:
    """A cosθ φ̇² − p_ψ φ̇ + gMR = 0, let go with θ̇ = 0."""
    A, gMR, theta, phidot = (m.top[name] for name in ("A", "gMR", "theta", "phidot"))
    still = (m.top["thetadot"] == 0) & (np.sin(theta) > UPRIGHT)
    return Terms(A * np.cos(theta) * phidot**2 + gMR, -m.p_psi * phidot, still)


def _sleeping(m: Momenta) -> Terms:
    """p_ψ² = 4 A gMR, on the vertical and at rest there."""
    upright = (m.top["theta"] == 0) & m.asleep
    return Terms(m.p_psi**2, -4 * m.top["A"] * m.top["gMR"], upright)


def _separatrix(m: Momenta) -> Terms:
    """E' = gMR, where p_φ = p_ψ on the whole plane."""
    equal = np.all(abs(m.p_minus) <= _ROUNDING * (abs(m.p_psi) + abs(m.p_phi)))
    return Terms(m.lift, 0 * m.p_psi, equal & ~m.asleep)


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
    points: list[Boundary] = []
    with np.errstate(all="ignore"):
        mesh = _momenta(plane, np.array(np.meshgrid(*2 * [np.arange(MESH, dtype=np.float64)])))
        for name, function in BOUNDARIES.items():
            for line in _zeros(plane, function, mesh):
                momenta = _momenta(plane, line)
                for part in _runs(function(momenta).where):
                    piece = Boundary(name, *_values(plane, line[:, part]))
                    if piece.x.size > 1:
                        found.append(piece)
                    elif name == "sleeping":  # the end of a line, on an edge where θ = 0
                        points.append(piece)
                if name == "through-top":
                    lift = momenta.lift
                    for k in np.flatnonzero(lift[1:] * lift[:-1] < 0).tolist():
                        share = lift[k] / (lift[k] - lift[k + 1])
                        place = line[:, k] + share * (line[:, k + 1] - line[:, k])
                        points.append(Boundary("separatrix", *_values(plane, place[:, None])))
    return (*found, *points)


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


def _momenta(plane: Plane, places: Array) -> Momenta:
    return constants(plane.at(*_values(plane, places)))


def _values(plane: Plane, places: Array) -> tuple[Array, Array]:
    """The values of x and y at places."""
    x, y = (
        axis.at(each / (MESH - 1)) for axis, each in zip((plane.x, plane.y), places, strict=True)
    )
    return x, y


def _runs(where: Mask) -> list[slice]:
    """The runs of places where a zero is a boundary."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], where, [False])).astype(np.int8)))
    return [slice(*pair) for pair in edges.reshape(-1, 2).tolist()]
