"""Homogeneous solids of revolution, of which a top may be made.

A solid is placed on the axis by its distance z from the pivot [m]; `Top.from_solids` adds them up.
Moments are the textbook's (Landau & Lifshitz, Mechanics, section 32, problem 2).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

from heavytop.errors import ImpossibleTop
from heavytop.exact import PI, Exact, Number
from heavytop.names import nearest
from heavytop.scene.arguments import Broken, exact_numbers, not_positive

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


def disk(*, radius: Number, thickness: Number, **given: Number | None) -> Solid:
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


def rod(*, radius: Number, length: Number, **given: Number | None) -> Solid:
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


def ring(*, outer: Number, inner: Number, thickness: Number, **given: Number | None) -> Solid:
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


def cone(*, radius: Number, apex: Number, base: Number, **given: Number | None) -> Solid:
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


def sphere(*, radius: Number, centre: Number, **given: Number | None) -> Solid:
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


def whole(parts: Iterable[Solid]) -> Solid:
    """The body made of `parts`: masses and moments about the pivot add up.

    Where one part goes through another, say so with a `ring`: they are added as they are.
    """
    given: object = parts
    solids = tuple(given) if isinstance(given, Iterable) else ()
    if not solids or not all(isinstance(part, Solid) for part in solids):
        rule = "at least one solid of heavytop.scene.top, and nothing else"
        raise ImpossibleTop([("parts", rule)])
    of_each = ((part.mass, part.mass * part.centre, part.A, part.C) for part in solids)
    mass, moment, A, C = (sum(values, Exact.of(0)) for values in zip(*of_each, strict=True))
    return Solid(mass, moment / mass, A - moment**2 / mass, C)


# --- a solid by the name of its shape --------------------------------------------------------


def solid(shape: object = None, **given: Any) -> Solid:
    """The solid of a shape of `SHAPES`, by the sizes that the shape has."""
    if not isinstance(shape, str) or shape not in SHAPES:
        rule = f"one of {', '.join(SHAPES)}"
        raise ImpossibleTop([("shape", f"{rule} {nearest(shape, SHAPES)}".rstrip())])
    sizes, build = SHAPES[shape]
    chosen = {name: value for name, value in given.items() if value is not None}
    broken: Broken = [
        (name, "missing: a size of a " + shape) for name in sizes if name not in chosen
    ]
    pairs = [pair for pair in _PAIRS if not {*sizes} & {*pair}]
    unclear = (pair for pair in pairs if len(chosen.keys() & {*pair}) != 1)
    broken += [(" or ".join(pair), "exactly one of them") for pair in unclear]
    names = [*sizes, *(name for pair in pairs for name in pair)]
    foreign = chosen.keys() - {*names}
    broken += [(name, f"a {shape} takes {', '.join(names)}") for name in foreign]
    numbers = {name: value for name, value in chosen.items() if name not in foreign}
    return build(
        exact_numbers(
            ImpossibleTop, numbers, lambda values: broken + not_positive(values, _POSITIVE)
        )
    )


def _cylinder(values: Mapping[str, Exact]) -> Solid:
    height = values["thickness"] if "thickness" in values else values["length"]
    outer = values["outer"] if "outer" in values else values["radius"]
    inner = values.get("inner", Exact.of(0))
    if (outer - inner).sign() != 1:
        raise ImpossibleTop([("inner", "less than outer")])
    M = _mass(values, PI * (outer**2 - inner**2) * height)
    centre = values["centre"] if "centre" in values else values["base"] + height / 2
    across = outer**2 + inner**2
    return Solid(M, centre, M * (3 * across + height**2) / 12, M * across / 2)


def _cone(values: Mapping[str, Exact]) -> Solid:
    r, height = values["radius"], values["base"] - values["apex"]
    if height.sign() == 0:
        raise ImpossibleTop([("base", "apart from the apex")])
    M = _mass(values, PI * r**2 * height * (height.sign() or 1) / 3)
    centre = values["apex"] + height * 3 / 4
    return Solid(M, centre, M * 3 * (4 * r**2 + height**2) / 80, M * 3 * r**2 / 10)


def _sphere(values: Mapping[str, Exact]) -> Solid:
    M = _mass(values, PI * values["radius"] ** 3 * 4 / 3)
    moment = M * values["radius"] ** 2 * 2 / 5
    return Solid(M, values["centre"], moment, moment)


def _mass(values: Mapping[str, Exact], volume: Exact) -> Exact:
    return values["mass"] if "mass" in values else values["density"] * volume


_PAIRS: Final = (("centre", "base"), ("density", "mass"))
_POSITIVE: Final = ("radius", "outer", "inner", "thickness", "length", "density", "mass")
_DISK: Final = ("radius", "thickness"), _cylinder
_ROD: Final = ("radius", "length"), _cylinder
SHAPES: Final[Mapping[str, tuple[tuple[str, ...], Callable[..., Solid]]]] = {
    "cone": (("radius", "apex", "base"), _cone),
    "cylinder": _ROD,
    "disc": _DISK,
    "disk": _DISK,
    "ring": (("outer", "inner", "thickness"), _cylinder),
    "rod": _ROD,
    "sphere": (("radius", "centre"), _sphere),
}
"""Sizes of each shape [m], and what makes a solid of them."""
