"""The plane of an atlas: the top and start of every pixel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from heavytop.analytic.motion import Motion
from heavytop.scene.scene import Scene
from heavytop.studies.atlases.axes import ROLES, Axis

Array = NDArray[np.float64]

WIDEST: Final = 4096  # pixels in a row of a tile


@dataclass(frozen=True, slots=True)
class Tile:
    """A rectangle of pixels, which is computed at once.

    Attributes
    ----------
    rows, columns : slice
        Which values of the y axis, and of the x axis.
    """

    rows: slice
    columns: slice

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.rows.stop - self.rows.start, self.columns.stop - self.columns.start

    @property
    def name(self) -> str:
        """The name of the task that computes it."""
        return f"{self.rows.start:07d}/{self.columns.start:07d}"


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

    @property
    def pixels(self) -> int:
        """How many pixels there are."""
        return self.x.count * self.y.count

    def tiles(self, most: int) -> tuple[Tile, ...]:
        """Cut the plane into tiles of at most so many pixels, always the same ones."""
        width = min(self.x.count, WIDEST)
        height = max(1, most // width)
        rows, columns = _cut(self.y.count, height), _cut(self.x.count, width)
        return tuple(Tile(*each) for each in product(rows, columns))

    @cached_property
    def values(self) -> tuple[Array, Array]:
        """The values of x and of y."""
        return self.x.values, self.y.values

    def tops(self, tile: Tile) -> dict[str, Array]:
        """The tops and starts of a tile, as `heavytop.classify_many` takes them.

        What no top or start can be is nan. Where an axis holds p_phi, p_psi or E the rates that
        give it are rounded to doubles, so that the pixel is that of the rounded rates.
        """
        x, y = self.values
        return self.at(x[tile.columns][None, :], y[tile.rows][:, None])

    def at(self, x: Array, y: Array) -> dict[str, Array]:
        """The tops and starts at places of the plane, given as arrays that broadcast."""
        given: dict[str, Any] = self._base | {self.x.name: x, self.y.name: y}
        with np.errstate(all="ignore"):
            return _started(given)

    @property
    def held(self) -> dict[str, float]:
        """The numbers of the scene that no axis changes, by name."""
        return {name: value for name, value in self._base.items() if name != "branch"}

    @property
    def place(self) -> tuple[float, float]:
        """Where the scene itself lies, on the map or beside it."""
        top, start = self.scene.top, self.scene.start
        constants = Motion(top, start).constants
        x, y = (
            next(getattr(each, axis.name) for each in (start, top, constants)
                 if hasattr(each, axis.name))
            for axis in (self.x, self.y)
        )  # fmt: skip
        return float(x), float(y)

    @cached_property
    def _base(self) -> dict[str, float]:
        """The numbers of the scene that no axis changes."""
        top, start = self.scene.top, self.scene.start
        base = {name: float(getattr(top, name)) for name in ("A", "C", "gMR")}
        names = ("theta", "thetadot", "phidot", start.held)
        base |= {name: float(getattr(start, name)) for name in names}
        changed = {ROLES[axis.name].sets for axis in (self.x, self.y)}
        kept = {name: value for name, value in base.items() if ROLES[name].sets not in changed}
        return kept | {"branch": base["thetadot"]}  # on which side a given E starts


def _started(given: Mapping[str, Any]) -> dict[str, Array]:
    """Numbers of a scene, with rates in place of momenta and energy.

    p_ψ = C ω3, p_φ = A φ̇ sin²θ + p_ψ cosθ, E = ½A (θ̇² + φ̇² sin²θ) + ½C ω3² + gMR cosθ.
    """
    top = {name: given[name] for name in ("A", "C", "gMR", "theta")}
    upside_down = np.equal(top["theta"], np.pi)  # the double nearest π means π
    sine = np.where(upside_down, 0.0, np.sin(top["theta"]))
    place = _Place(top["A"], top["C"], np.cos(top["theta"]), sine)
    spin = {name: given[name] for name in ("psidot", "omega3") if name in given}
    if "p_psi" in given:
        spin = {"omega3": given["p_psi"] / place.C}
    phidot = given["phidot"] if "phidot" in given else place.phidot(given["p_phi"], **spin)
    omega3 = spin["omega3"] if "omega3" in spin else spin["psidot"] + phidot * place.u
    thetadot = given.get("thetadot")
    if thetadot is None:
        still = place.kinetic(phidot, omega3) + top["gMR"] * place.u
        thetadot = np.copysign(np.sqrt(2 * (given["E"] - still) / place.A), given["branch"])
    return {**top, "thetadot": thetadot, "phidot": phidot, **spin}


class _Place(NamedTuple):
    """Moments, cosine and sine of the tilt."""

    A: Any
    C: Any
    u: Any
    sine: Any

    def phidot(self, p_phi: Any, psidot: Any = None, omega3: Any = None) -> Any:
        """φ̇ of a given p_φ; nan at a pole that it does not reach, and its limit where it does."""
        A, C, u, sine = self
        if omega3 is None:
            return (p_phi - C * psidot * u) / (A * sine**2 + C * u**2)
        missed = p_phi - C * omega3 * u
        pole = np.where(missed == 0, C * omega3 * u / (2 * A), np.nan)
        return np.where(sine == 0, pole, missed / (A * np.where(sine == 0, 1, sine**2)))

    def kinetic(self, phidot: Any, omega3: Any) -> Any:
        """The kinetic energy while θ is at rest."""
        return self.A * (phidot * self.sine) ** 2 / 2 + self.C * omega3**2 / 2


def _cut(count: int, size: int) -> list[slice]:
    return [slice(k, min(k + size, count)) for k in range(0, count, size)]
