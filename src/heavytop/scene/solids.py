"""Homogeneous solids of revolution, which a top may be made of.

A solid is placed on the axis by its distance z from the pivot [m]; `Top.from_solids` adds them up.
Moments are the textbook's (Landau & Lifshitz, Mechanics, section 32, problem 2).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

from heavytop.errors import ImpossibleTop, Refused
from heavytop.exact import PI, Exact, Number
from heavytop.scene.arguments import Numbers, Way, exact_numbers, items_of, positive
from heavytop.scene.quantities import QUANTITY_READERS
from heavytop.text import nearest

ALUMINIUM = Exact.of(2700)
"""Density of aluminium [kg m⁻³]."""

STEEL = Exact.of(7850)
"""Density of a carbon steel [kg m⁻³]."""


@dataclass(frozen=True, slots=True)
class Solid:
    """A body of revolution on the axis of the top.

    Parameters
    ----------
    mass : Exact
        M [kg].
    centre : Exact
        Distance z of its centre of mass from the pivot [m]; negative below it.
    A_cm, C_cm : Exact
        Moments about its centre of mass, transverse and axial [kg m²].
    """

    mass: Exact
    centre: Exact
    A_cm: Exact
    C_cm: Exact

    @property
    def A(self) -> Exact:
        """Moment about a transverse axis through the pivot, A_cm + M z² [kg m²]."""
        return self.A_cm + self.mass * self.centre**2

    @property
    def C(self) -> Exact:
        """Moment about the axis, C_cm [kg m²]."""
        return self.C_cm


def disk(*, radius: Number, thickness: Number, **given: Number) -> Solid:
    """A disk: a cylinder about the axis.

    Parameters
    ----------
    radius, thickness : number
        Radius, and length along the axis [m].
    centre, base : number
        Distance from the pivot of its middle, or of its lower end [m]; one of them.
    density, mass : number
        ρ [kg m⁻³] or M [kg]; one of them.

    Returns
    -------
    Solid

    Raises
    ------
    ImpossibleTop
        Some value is no number, a size or the matter is not positive, or both or neither of a
        pair are given; every fault is listed.

    Examples
    --------
    >>> print(disk(radius="0.05", thickness="0.01", centre="0.06", mass="0.2").C_cm)
    0.00025
    """
    return solid("disk", radius=radius, thickness=thickness, **given)


def rod(*, radius: Number, length: Number, **given: Number) -> Solid:
    """A rod along the axis: the same cylinder as a disk, with the words for a long one.

    Parameters
    ----------
    radius, length : number
        [m].
    centre, base, density, mass : number
        As for `disk`.

    Returns
    -------
    Solid

    Examples
    --------
    >>> print(rod(radius="0.001", length="0.1", base=0, mass="0.003").centre)
    0.05
    """
    return solid("rod", radius=radius, length=length, **given)


def ring(*, outer: Number, inner: Number, thickness: Number, **given: Number) -> Solid:
    """A ring: a disk with a hole along the axis, through which a rod may go.

    Parameters
    ----------
    outer, inner, thickness : number
        Its two radii, and its length along the axis [m].
    centre, base, density, mass : number
        As for `disk`.

    Returns
    -------
    Solid

    Raises
    ------
    ImpossibleTop
        As for `disk`, or the hole is not smaller than the ring.

    Examples
    --------
    >>> print(ring(outer="0.05", inner="0.03", thickness="0.01", base=0, mass=1).C_cm)
    0.0017
    """
    return solid("ring", outer=outer, inner=inner, thickness=thickness, **given)


def cone(*, radius: Number, apex: Number, base: Number, **given: Number) -> Solid:
    """A cone about the axis, from its apex to its flat base.

    Parameters
    ----------
    radius : number
        Radius of the base [m].
    apex, base : number
        Distances of the apex and of the base from the pivot [m]; either may be the larger.
    density, mass : number
        As for `disk`.

    Returns
    -------
    Solid

    Raises
    ------
    ImpossibleTop
        As for `disk`, or apex and base are not apart.

    Examples
    --------
    >>> print(cone(radius="0.05", apex=0, base="0.1", mass=1).A)
    0.006375
    """
    return solid("cone", radius=radius, apex=apex, base=base, **given)


def sphere(*, radius: Number, centre: Number, **given: Number) -> Solid:
    """A ball whose centre is on the axis.

    Parameters
    ----------
    radius, centre : number
        Radius, and distance of the centre from the pivot [m].
    density, mass : number
        As for `disk`.

    Returns
    -------
    Solid

    Examples
    --------
    >>> print(sphere(radius="0.1", centre=1, mass=1).A)
    1.004
    """
    return solid("sphere", radius=radius, centre=centre, **given)


def combine(parts: Iterable[Solid]) -> Solid:
    """The body made of `parts`: masses and moments about the pivot add up.

    Where one part goes through another, say so with a `ring`: they are added as they are.
    """
    of_each = ((part.mass, part.mass * part.centre, part.A, part.C) for part in parts)
    mass, moment, A, C = (sum(values, Exact.of(0)) for values in zip(*of_each, strict=True))
    return Solid(mass, moment / mass, A - moment**2 / mass, C)


def read_solids(value: object) -> tuple[Solid, ...]:
    """The solids of a list, each given as a `Solid` or as a table with its shape and sizes."""
    given = items_of(value)
    if not given or not all(isinstance(each, Solid | dict) for each in given):
        rule = 'the parts of a body, at least one solid, such as {shape = "disc", radius = 0.1, …}'
        raise Refused(rule)
    solids, faults = [], []
    for number, each in enumerate(given, start=1):
        try:
            solids.append(each if isinstance(each, Solid) else solid(**each))
        except ImpossibleTop as error:
            faults += [f"of solid {number} {fault}" for fault in error.faults]
    if faults:
        raise Refused("; ".join(faults))
    return tuple(solids)


# --- a solid by the name of its shape --------------------------------------------------------


def solid(shape: object = None, **given: object) -> Solid:
    """The solid of a shape of `SOLIDS`, with its sizes, place, and density or mass."""
    if not isinstance(shape, str) or shape not in SOLIDS:
        rule = f"one of {', '.join(SOLIDS)} {nearest(shape, SOLIDS)}"
        raise ImpossibleTop([("shape", rule.rstrip())])
    way = SOLIDS[shape]
    readers = {name: _READERS[name] for slot in way.slots for name in slot}
    values = exact_numbers(ImpossibleTop, way, given, readers)
    found = way.make(values)
    mass = values["mass"] if "mass" in values else values["density"] * found["volume"]
    return Solid(mass, found["centre"], mass * found["across"], mass * found["along"])


def _cylinder(values: Numbers) -> dict[str, Exact]:
    """Volume, centre and moments by the mass of a cylinder, which may have a hole."""
    height = values["thickness"] if "thickness" in values else values["length"]
    outer = values["outer"] if "outer" in values else values["radius"]
    inner = values.get("inner", Exact.of(0))
    if (outer - inner).sign() != 1:
        raise ImpossibleTop([("inner", "must be less than outer")])
    along = (outer**2 + inner**2) / 2
    return {
        "volume": PI * (outer**2 - inner**2) * height,
        "centre": values["centre"] if "centre" in values else values["base"] + height / 2,
        "across": along / 2 + height**2 / 12,
        "along": along,
    }


def _cone(values: Numbers) -> dict[str, Exact]:
    """Volume, centre and moments by the mass of a cone."""
    r, height = values["radius"], values["base"] - values["apex"]
    if height.sign() == 0:
        raise ImpossibleTop([("base", "apart from the apex")])
    return {
        "volume": PI * r**2 * height * (height.sign() or 1) / 3,
        "centre": values["apex"] + height * 3 / 4,
        "across": (4 * r**2 + height**2) * 3 / 80,
        "along": r**2 * 3 / 10,
    }


def _sphere(values: Numbers) -> dict[str, Exact]:
    """Volume, centre and moments by the mass of a ball."""
    r = values["radius"]
    volume, moment = PI * r**3 * 4 / 3, r**2 * 2 / 5
    return {"volume": volume, "centre": values["centre"], "across": moment, "along": moment}


def _shape(name: str, make: Callable[..., dict[str, Any]], *sizes: str) -> Way:
    """The values that determine a solid: its sizes, its place, and density or mass."""
    place = () if {"apex", "centre"} & {*sizes} else (("centre", "base"),)
    return Way(name, (*((size,) for size in sizes), *place, ("density", "mass")), make)


_POSITIVE: Final = ("radius", "outer", "inner", "thickness", "length", "density", "mass")
_READERS: Final = {**QUANTITY_READERS, **{x: positive(QUANTITY_READERS[x]) for x in _POSITIVE}}
SOLIDS: Final[Mapping[str, Way]] = {
    "cone": _shape("a cone", _cone, "radius", "apex", "base"),
    "cylinder": _shape("a cylinder", _cylinder, "radius", "length"),
    "disc": _shape("a disc", _cylinder, "radius", "thickness"),
    "disk": _shape("a disk", _cylinder, "radius", "thickness"),
    "ring": _shape("a ring", _cylinder, "outer", "inner", "thickness"),
    "rod": _shape("a rod", _cylinder, "radius", "length"),
    "sphere": _shape("a sphere", _sphere, "radius", "centre"),
}
"""For each shape its sizes [m], and what computes volume, centre and moments by the mass [m²]."""
