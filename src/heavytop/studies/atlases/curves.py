"""The boundaries between kinds, as curves: zeros of the functions whose signs tell the kinds apart.

Each function is looked at on a mesh of its own, and every place where it changes its sign along an
edge of the mesh is then found to the last digits, so that a curve does not know of the pixels.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from heavytop.studies.atlases.axes import Axis
from heavytop.studies.atlases.plane import Array, Plane

MESH: Final = 401  # points of the mesh along either axis
HALVINGS: Final = 60
_UNSEEN: Final = 1e-9  # of its terms: a function as small as that everywhere has no zero of its own


@dataclass(frozen=True, eq=False)
class Curve:
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
    where: Any


@dataclass(frozen=True, slots=True)
class Momenta:
    """Constants of the motion at places of a plane.

    Attributes
    ----------
    top : mapping of str to ndarray
        The tops and starts.
    kinetic, across, p_psi : ndarray
        ½A (θ̇² + φ̇² sin²θ), A φ̇ sin²θ and p_ψ.
    """

    top: Mapping[str, Array]
    kinetic: Array
    across: Array
    p_psi: Array

    @property
    def energy(self) -> Array:
        """E', without the energy of the spin."""
        return self.kinetic + self.top["gMR"] * np.cos(self.top["theta"])

    @property
    def lift(self) -> Array:
        """E' − gMR: positive where there is energy to get to θ = 0."""
        return self.kinetic - self.top["gMR"] * self._rise

    @property
    def p_phi(self) -> Array:
        """p_φ."""
        return self.across + self.p_psi * np.cos(self.top["theta"])

    @property
    def drift(self) -> Array:
        """p_φ − p_ψ, without cancellation near the top."""
        return self.across - self.p_psi * self._rise

    @property
    def _rise(self) -> Array:
        return 2 * np.sin(self.top["theta"] / 2) ** 2

    @property
    def possible(self) -> Any:
        """Where a top and a start have such numbers."""
        A, C, theta = self.top["A"], self.top["C"], self.top["theta"]
        moves = np.isfinite(self.kinetic + self.p_psi)
        return moves & (A > 0) & (C > 0) & (2 * A >= C) & (theta >= 0) & (theta <= np.pi)

    @property
    def swings(self) -> Any:
        """Where the axis does not rest on the vertical."""
        return (np.sin(self.top["theta"]) > 1e-12) | (self.top["thetadot"] != 0)

    @classmethod
    def of(cls, tops: Mapping[str, Any]) -> Momenta:
        """The constants of tops and starts."""
        top = {name: np.asarray(each, np.float64) for name, each in tops.items()}
        A, C, theta, phidot = (top[name] for name in ("A", "C", "theta", "phidot"))
        sine = np.sin(theta)
        omega3 = top["omega3"] if "omega3" in top else top["psidot"] + phidot * np.cos(theta)
        kinetic = A * (top["thetadot"] ** 2 + (phidot * sine) ** 2) / 2
        return cls(top, kinetic, A * phidot * sine**2, C * omega3)


def _cusp(m: Momenta) -> Terms:
    """E' p_ψ = gMR p_φ, between the poles, where gMR p_ψ cosθ is on both sides."""
    inside = abs(m.p_phi) < abs(m.p_psi)
    if not np.any(m.across):  # let go without φ̇: what is squared in E′ touches zero
        return Terms(m.top["thetadot"], 0 * m.p_psi, inside)
    return Terms(m.kinetic * m.p_psi, -m.top["gMR"] * m.across, inside)


def _through_top(m: Momenta) -> Terms:
    """p_φ = p_ψ, and the energy to get to θ = 0."""
    return Terms(m.drift, 0 * m.p_psi, (m.lift > 0) & m.swings)


def _through_bottom(m: Momenta) -> Terms:
    """p_φ = −p_ψ, and the energy to get to θ = π."""
    return Terms(m.p_phi, m.p_psi, (m.energy > -m.top["gMR"]) & m.swings)


def _steady(m: Momenta) -> Terms:
    """A cosθ φ̇² − p_ψ φ̇ + gMR = 0, let go with θ̇ = 0."""
    A, theta, phidot = (m.top[name] for name in ("A", "theta", "phidot"))
    pull = A * np.cos(theta) * phidot**2 + m.top["gMR"]
    return Terms(pull, -m.p_psi * phidot, (m.top["thetadot"] == 0) & (np.sin(theta) > 1e-12))


def _sleeping(m: Momenta) -> Terms:
    """p_ψ² = 4 A gMR, on the vertical and at rest there."""
    upright = (m.top["theta"] == 0) & ~m.swings
    return Terms(m.p_psi**2, -4 * m.top["A"] * m.top["gMR"], upright)


def _separatrix(m: Momenta) -> Terms:
    """E' = gMR, where p_φ = p_ψ on the whole plane."""
    close = abs(m.drift) <= _UNSEEN * (abs(m.p_psi) + abs(m.p_phi))
    return Terms(m.lift, 0 * m.lift, np.all(close) & m.swings)


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


def curves(plane: Plane) -> tuple[Curve, ...]:
    """Every boundary that crosses a plane.

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
    >>> axes = Axis.of("phidot=-1:2:9"), Axis.of("psidot=100:150:9")
    >>> plane = Plane(load_scene("sicm-dropped"), *axes)
    >>> [(each.name, float(abs(each.x).max()) < 1e-12) for each in curves(plane)]
    [('cusp', True)]
    """
    mesh = _Mesh(plane)
    return tuple(curve for name in BOUNDARIES for curve in mesh.curves(name)) + tuple(mesh.points())


class _Mesh:
    """A plane on a mesh of its own; places are told by numbers of steps along its axes."""

    def __init__(self, plane: Plane) -> None:
        self.plane = plane
        self.shape = MESH, MESH
        steps = np.arange(MESH, dtype=np.float64)
        self.momenta = self._momenta(steps[None, :], steps[:, None])

    def curves(self, name: str) -> Iterator[Curve]:
        """The curves of one boundary."""
        for i, j in self._lines(name):
            where = np.broadcast_to(self._terms(name, i, j).where, i.shape)
            for part in _parts(where):
                yield Curve(name, *self._places(i[part], j[part]))

    def points(self) -> Iterator[Curve]:
        """The boundaries that are points of this plane.

        They are the separatrix, E' = gMR on the curve p_φ = p_ψ, and the threshold of sleep, which
        lies on an edge where θ = 0.
        """
        yield from self._asleep()
        for i, j in self._lines("through-top"):
            lift = np.broadcast_to(self._momenta(i, j).lift, i.shape)
            for k in np.flatnonzero(lift[1:] * lift[:-1] < 0).tolist():
                share = lift[k] / (lift[k] - lift[k + 1])
                here = (np.atleast_1d(s[k] + share * (s[k + 1] - s[k])) for s in (i, j))
                yield Curve("separatrix", *self._places(*here))

    def _asleep(self) -> Iterator[Curve]:
        steps, edge = np.arange(MESH, dtype=np.float64), np.zeros(MESH)
        for axis, at in ((self.plane.x, (edge, steps)), (self.plane.y, (steps, edge))):
            if axis.name != "theta" or axis.low.sign() != 0:
                continue
            terms = BOUNDARIES["sleeping"](self._momenta(*at))
            value, where = np.broadcast_arrays(terms.one + terms.other, terms.where)
            for k in np.flatnonzero((value[1:] * value[:-1] < 0) & where[1:] & where[:-1]).tolist():
                share = value[k] / (value[k] - value[k + 1])
                here = (np.atleast_1d(s[k] + share * (s[k + 1] - s[k])) for s in at)
                yield Curve("sleeping", *self._places(*self._sharp("sleeping", *here)))

    def _lines(self, name: str) -> Iterator[tuple[Array, Array]]:
        """The zeros of a function, as lines of places."""
        from contourpy import contour_generator

        terms = self._wide(BOUNDARIES[name], self.momenta)
        if not terms.where.any() or _vanishes(terms):
            return
        possible = np.broadcast_to(self.momenta.possible, self.shape)
        value = np.ma.masked_invalid(np.where(possible, terms.one + terms.other, np.nan))
        for line in contour_generator(z=value).lines(0.0):
            yield self._sharp(name, *np.asarray(line).T)

    def _sharp(self, name: str, i: Array, j: Array) -> tuple[Array, Array]:
        """Places on edges of the mesh, moved along them to where the sign changes."""
        along_i = abs(j - np.rint(j)) <= abs(i - np.rint(i))
        i, j = np.where(along_i, i, np.rint(i)), np.where(along_i, np.rint(j), j)
        low_i, low_j = np.where(along_i, np.floor(i), i), np.where(along_i, j, np.floor(j))
        step = np.minimum(1.0, MESH - 1 - np.where(along_i, low_i, low_j))
        low, high = np.zeros_like(i), step

        def sign(share: Array) -> Any:
            at = low_i + np.where(along_i, share, 0.0), low_j + np.where(along_i, 0.0, share)
            terms = self._terms(name, *at)
            return np.sign(terms.one + terms.other)

        here = np.where(along_i, i - low_i, j - low_j)
        below = sign(low)
        crossed = below * sign(high) < 0  # not where a zero is at a point of the mesh itself
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            same = sign(middle) == below
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        share = np.where(crossed, high, here)
        return low_i + np.where(along_i, share, 0.0), low_j + np.where(along_i, 0.0, share)

    def _terms(self, name: str, i: Array, j: Array) -> Terms:
        return BOUNDARIES[name](self._momenta(i, j))

    def _wide(self, function: Callable[[Momenta], Terms], momenta: Momenta) -> Terms:
        with np.errstate(all="ignore"):
            return Terms(*(np.broadcast_to(each, self.shape) for each in function(momenta)))

    def _momenta(self, i: Array, j: Array) -> Momenta:
        with np.errstate(all="ignore"):
            return Momenta.of(self.plane.at(*self._places(i, j)))

    def _places(self, i: Array, j: Array) -> tuple[Array, Array]:
        return _value(self.plane.x, i), _value(self.plane.y, j)


def _value(axis: Axis, step: Array) -> Array:
    """The value of an axis so many steps of the mesh from its low end."""
    low, high, share = float(axis.low), float(axis.high), step / (MESH - 1)
    if axis.log:
        return np.asarray(low * (high / low) ** share)
    return np.asarray(low * (1 - share) + high * share)


def _vanishes(terms: Terms) -> bool:
    """Whether a function is nothing but rounding, on all of the plane."""
    size = abs(terms.one) + abs(terms.other)
    known = np.isfinite(size)
    return not known.any() or bool(
        np.all(abs(terms.one + terms.other)[known] <= _UNSEEN * size[known])
    )


def _parts(where: NDArray[np.bool_]) -> list[slice]:
    """The runs of places where a zero is a boundary, of two places at least."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], where, [False])).astype(np.int8)))
    return [slice(*pair) for pair in edges.reshape(-1, 2).tolist() if pair[1] - pair[0] > 1]
