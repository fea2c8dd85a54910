"""The energy–momentum diagram of a scene: places, steady precession, lines, and a circuit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import starmap
from math import sqrt
from typing import Any, Final, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from heavytop.analytic.critical_set import valley
from heavytop.analytic.energy_momentum import EnergyMomentum, Place, energy_momentum
from heavytop.analytic.motion import Motion
from heavytop.display import Plotted
from heavytop.errors import ImpossibleStart
from heavytop.results.base import Column, Number, Part, Result, SceneTables, Text, finite
from heavytop.scene.scene import Scene

POINTS: Final = 401  # of the edge
BEYOND: Final = 1.35  # how far a picture reaches beyond what it has to show: up, and
ASIDE: Final = 1.6
ROWS: Final = 28  # of a sheet, and
COLUMNS: Final = 17
FARTHEST: Final = 2.6  # momenta over √(A |gMR|) to which the sheets are followed

Array: TypeAlias = npt.NDArray[np.float64]
Sheet: TypeAlias = Mapping[Text, tuple[Column, ...]]
"""By name, the rows of equal p_psi of a sheet of the critical set."""


@dataclass(frozen=True)
class Spot(Part):
    """A place in the plane of energy and momentum."""

    p_phi: Number
    E_prime: Number


@dataclass(frozen=True)
class Start(Spot):
    """The place of a scene, and its kind."""

    kind: Text


@dataclass(frozen=True, kw_only=True)
class CriticalSet(Part):
    """The relative equilibria over all p_psi."""

    sheets: tuple[Sheet, ...]
    sleeping: Mapping[Text, Column]
    focus_focus: Mapping[Text, Column]
    hanging: Mapping[Text, Column]


@dataclass(frozen=True, kw_only=True)
class Diagram(Result, Plotted):
    """The energy–momentum diagram of a scene's top at its p_psi.

    Attributes
    ----------
    scene : SceneTables
    p_psi : float
    ratio : float or None
        p_psi^2/4A|gMR|.
    start : Start
    standing, hanging : Spot
        Places of the axis on the vertical.
    focus_focus : Spot or None
        The focus–focus point, of the unstable upright top; None where sleeping is stable.
    depth : float or None
        How far above the edge that is.
    window : mapping
        What a picture shows: two p_phi, and two E_prime.
    edge : mapping
        Columns of steady precession: p_phi, E_prime, theta, rate, fast.
    cusps, through_top, through_bottom : tuple of Spot, or None
        Lines from one place to another.
    circuit : mapping or None
        Around the focus–focus point; None where there is no room for one.
    critical_set : CriticalSet or None
        The two sheets over all p_psi, the focus–focus line, and the edges of the
        sheets, sleeping and hanging tops; None without gravity.
    """

    schema: Literal["heavytop/energy-momentum/1"] = "heavytop/energy-momentum/1"
    scene: SceneTables
    p_psi: Number
    ratio: Number | None
    start: Start
    standing: Spot
    hanging: Spot
    focus_focus: Spot | None
    depth: Number | None
    window: Mapping[Text, Column]
    edge: Mapping[Text, tuple[Number | bool | None, ...]]
    cusps: tuple[Spot, ...] | None
    through_top: tuple[Spot, ...]
    through_bottom: tuple[Spot, ...]
    circuit: Mapping[Text, Number | Column | tuple[Column, ...]] | None
    critical_set: CriticalSet | None


def diagram_of(scene: Scene) -> Diagram:
    """Return the energy–momentum diagram of a scene's top at its p_psi; nothing is integrated.

    Parameters
    ----------
    scene : Scene
        Its top and its start; span and wants play no part.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> found = diagram_of(load_scene("sleeping-unstable"))
    >>> found.circuit["winding"], found.start.kind
    (1, 'sleeping')
    """
    diagram = energy_momentum(scene.top, scene.top.C * scene.start.omega3)
    motion = Motion(scene.top, scene.start)
    known = motion.constants.floats
    here = Place(known["p_phi"], known["E_prime"])
    window = _window(diagram, here)
    p_psi, gMR, high = float(diagram.p_psi), float(diagram.top.gMR), window["E_prime"][1]
    return Diagram(
        scene=SceneTables(**scene.document()),
        p_psi=p_psi,
        ratio=diagram.ratio,
        start=Start(*here, str(motion.kind)),
        standing=Spot(*diagram.standing),
        hanging=Spot(*diagram.hanging),
        focus_focus=Spot(*diagram.focus_focus) if diagram.focus_focus else None,
        depth=diagram.depth,
        window=window,
        edge=_edge(diagram, window["p_phi"]),
        cusps=tuple(starmap(Spot, diagram.cusps)) if diagram.cusps else None,
        through_top=tuple(Spot(p_psi, energy) for energy in (gMR, high)),
        through_bottom=tuple(Spot(-p_psi, energy) for energy in (-gMR, high)),
        circuit=_circuit(diagram),
        critical_set=_critical_set(diagram),
    )


def _window(diagram: EnergyMomentum, here: Place) -> dict[str, tuple[float, float]]:
    """What a picture shows: both verticals and the scene's own place, with what is around them."""
    weight, p_psi = abs(float(diagram.top.gMR)), abs(float(diagram.p_psi))
    unit = sqrt(float(diagram.top.A) * weight)
    wide = ASIDE * max(p_psi, unit, abs(here.p_phi)) or 1.0
    floor = min(float(diagram.least(p)) for p in (-wide, 0.0, wide, diagram.hanging.p_phi))
    high = max(weight, here.E_prime, float(max(diagram.least([-p_psi, p_psi]))), weight / 2)
    high = high or float(diagram.least(wide)) or 1.0
    reach = (BEYOND - 1) * (high - floor)
    return {"p_phi": (-wide, wide), "E_prime": (floor - reach / 4, high + 2 * reach)}


def _edge(diagram: EnergyMomentum, span: tuple[float, float]) -> dict[str, tuple[Any, ...]]:
    """The steady precessions across the window, and the corners among them."""
    corners = [diagram.hanging.p_phi, diagram.standing.p_phi]
    edge = diagram.edge(np.union1d(np.linspace(span[0], span[1], POINTS), corners))
    return {name: _listed(values) for name, values in edge._asdict().items()}


def _circuit(diagram: EnergyMomentum) -> dict[str, Any] | None:
    try:
        found = diagram.circuit()
    except ImpossibleStart:  # no focus–focus point, or one too near to the edge
        return None
    names = ("s", "p_phi", "E_prime", "period", "precession", "spin", "principal_precession")
    return {name: _listed(getattr(found, name)) for name in names} | {
        "winding": found.winding,
        "spin_winding": found.spin_winding,
        "monodromy": tuple(map(tuple, found.monodromy)),
        "largest_step": found.largest_step,
    }


def _critical_set(diagram: EnergyMomentum) -> CriticalSet | None:
    """The critical set over all p_ψ; None without gravity."""
    if not diagram.g:
        return None
    A, root = float(diagram.top.A), sqrt(abs(diagram.g))
    side = 1.0 if diagram.g > 0 else -1.0
    b = FARTHEST * root * np.linspace(-1, 1, ROWS)
    inside = 2 * root * np.linspace(-1, 1, ROWS)
    beyond = np.concatenate((b[b < -2 * root], [-2 * root, 2 * root], b[b > 2 * root]))
    lines = {"sleeping": (beyond, side), "focus_focus": (inside, side), "hanging": (b, -side)}
    ends = FARTHEST * root, -FARTHEST * root
    return CriticalSet(
        sheets=tuple(_sheet(A, diagram.g, b, end) for end in ends),
        **{name: _line(A, b, pole, pole * diagram.g) for name, (b, pole) in lines.items()},
    )


def _sheet(A: float, g: float, b: Array, end: float) -> dict[str, Any]:
    """One sheet as rows of equal p_ψ, each from the hanging axis to p_φ = `end`."""
    hanging = np.copysign(b, -b * g)
    a = hanging[:, None] + (end - hanging)[:, None] * np.linspace(0, 1, COLUMNS)
    found = valley(g, a + b[:, None], a - b[:, None])
    p_psi = np.repeat(b[:, None], COLUMNS, axis=1)
    columns = {"p_psi": A * p_psi, "p_phi": A * a, "E_prime": A * found.energy, "rate": found.rate}
    return {name: tuple(map(_listed, rows)) for name, rows in columns.items()}


def _line(A: float, b: Array, pole: float, h: float) -> dict[str, Column]:
    """An axis on the vertical, at the given p_ψ/A."""
    columns = {"p_psi": b, "p_phi": pole * b, "E_prime": np.full(b.shape, h)}
    return {name: _listed(A * values) for name, values in columns.items()}


def _listed(values: npt.NDArray[Any]) -> tuple[Any, ...]:
    return tuple(map(finite, values.tolist()))
