"""Homogeneous solids of revolution on a common axis: what tops are made of.

Each is placed by its distance z from the pivot along the axis [m] and knows its mass, its centre
and its moments about its own centre; `heavytop.Top.from_solids` adds them up. Numbers are exact,
π included. Moments are the textbook's (Landau & Lifshitz, Mechanics, section 32, problem 2).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from heavytop.errors import ImpossibleTop, NotANumber
from heavytop.numbers import PI, Exact, Number

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


def disk(
    *,
    radius: Number,
    thickness: Number,
    centre: Number | None = None,
    base: Number | None = None,
    density: Number | None = None,
    mass: Number | None = None,
) -> Solid:
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
    sizes = {"radius": radius, "thickness": thickness}
    values = _read(sizes, {"centre": centre, "base": base}, {"density": density, "mass": mass})
    return _cylinder(values, values["radius"], Exact.of(0), values["thickness"])


def rod(
    *,
    radius: Number,
    length: Number,
    centre: Number | None = None,
    base: Number | None = None,
    density: Number | None = None,
    mass: Number | None = None,
) -> Solid:
    """A rod along the axis: the same cylinder as a disk, with the words for a long one.

    Parameters
    ----------
    radius, length : number
        [m].
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
        As for `disk`.

    Examples
    --------
    >>> print(rod(radius="0.001", length="0.1", base=0, mass="0.003").centre)
    0.05
    """
    sizes = {"radius": radius, "length": length}
    values = _read(sizes, {"centre": centre, "base": base}, {"density": density, "mass": mass})
    return _cylinder(values, values["radius"], Exact.of(0), values["length"])


def ring(
    *,
    outer: Number,
    inner: Number,
    thickness: Number,
    centre: Number | None = None,
    base: Number | None = None,
    density: Number | None = None,
    mass: Number | None = None,
) -> Solid:
    """A ring: a disk with a hole along the axis, through which a rod may go.

    Parameters
    ----------
    outer, inner, thickness : number
        Its two radii, and its length along the axis [m].
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
        As for `disk`, or the hole is not smaller than the ring.

    Examples
    --------
    >>> print(ring(outer="0.05", inner="0.03", thickness="0.01", base=0, mass=1).C_cm)
    0.0017
    """
    sizes = {"outer": outer, "inner": inner, "thickness": thickness}
    values = _read(sizes, {"centre": centre, "base": base}, {"density": density, "mass": mass})
    if (values["outer"] - values["inner"]).sign() != 1:
        raise ImpossibleTop([("inner", "less than outer")])
    return _cylinder(values, values["outer"], values["inner"], values["thickness"])


def cone(
    *,
    radius: Number,
    apex: Number,
    base: Number,
    density: Number | None = None,
    mass: Number | None = None,
) -> Solid:
    """A cone about the axis, from its apex to its flat base.

    Parameters
    ----------
    radius : number
        Radius of the base [m].
    apex, base : number
        Distances of the apex and of the base from the pivot [m]; either may be the larger.
    density, mass : number
        ρ [kg m⁻³] or M [kg]; one of them.

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
    sizes: dict[str, Number | None] = {"radius": radius}
    values = _read(sizes, {"apex": apex}, {"base": base}, {"density": density, "mass": mass})
    height = values["base"] - values["apex"]
    if height.sign() == 0:
        raise ImpossibleTop([("base", "apart from the apex")])
    r = values["radius"]
    M = _mass(values, PI * r**2 * height * (height.sign() or 1) / 3)
    centre = values["apex"] + height * 3 / 4
    return Solid(M, centre, M * 3 * (4 * r**2 + height**2) / 80, M * 3 * r**2 / 10)


def sphere(
    *,
    radius: Number,
    centre: Number,
    density: Number | None = None,
    mass: Number | None = None,
) -> Solid:
    """A ball whose centre is on the axis.

    Parameters
    ----------
    radius, centre : number
        Radius, and distance of the centre from the pivot [m].
    density, mass : number
        ρ [kg m⁻³] or M [kg]; one of them.

    Returns
    -------
    Solid

    Raises
    ------
    ImpossibleTop
        As for `disk`.

    Examples
    --------
    >>> print(sphere(radius="0.1", centre=1, mass=1).A)
    1.004
    """
    values = _read({"radius": radius}, {"centre": centre}, {"density": density, "mass": mass})
    M = _mass(values, PI * values["radius"] ** 3 * 4 / 3)
    moment = M * values["radius"] ** 2 * 2 / 5
    return Solid(M, values["centre"], moment, moment)


@dataclass(frozen=True, slots=True)
class Whole:
    """Several solids as one body: its mass, centre, and moments.

    Parameters
    ----------
    mass : Exact
        M [kg].
    centre : Exact
        Distance R of the centre of mass from the pivot [m].
    A, C : Exact
        Moments about the pivot, transverse and axial [kg m²].
    """

    mass: Exact
    centre: Exact
    A: Exact
    C: Exact

    @property
    def A_cm(self) -> Exact:
        """Transverse moment about the centre of mass, A − M R² [kg m²]."""
        return self.A - self.mass * self.centre**2


def whole(parts: Iterable[Solid]) -> Whole:
    """The body made of `parts`: masses and moments about the pivot add up.

    Parameters
    ----------
    parts : iterable of Solid
        At least one. They are added as they are: where one goes through another, say so with a
        `ring`.

    Returns
    -------
    Whole

    Raises
    ------
    ImpossibleTop
        There are no parts, or one of them is no `Solid`.
    """
    given: object = parts
    solids = tuple(given) if isinstance(given, Iterable) else ()
    if not solids or not all(isinstance(part, Solid) for part in solids):
        raise ImpossibleTop(
            [("parts", "at least one solid of heavytop.scene.solids, and nothing else")]
        )
    zero = Exact.of(0)
    mass = sum((part.mass for part in solids), zero)
    moment = sum((part.mass * part.centre for part in solids), zero)
    A = sum((part.A for part in solids), zero)
    return Whole(mass, moment / mass, A, sum((part.C_cm for part in solids), zero))


def _cylinder(values: Mapping[str, Exact], outer: Exact, inner: Exact, height: Exact) -> Solid:
    M = _mass(values, PI * (outer**2 - inner**2) * height)
    centre = values["centre"] if "centre" in values else values["base"] + height / 2
    across = outer**2 + inner**2
    return Solid(M, centre, M * (3 * across + height**2) / 12, M * across / 2)


def _mass(values: Mapping[str, Exact], volume: Exact) -> Exact:
    return values["mass"] if "mass" in values else values["density"] * volume


def _read(
    sizes: Mapping[str, Number | None], *choices: Mapping[str, Number | None]
) -> dict[str, Exact]:
    """Sizes, and one of each choice, as exact numbers; all that is wrong with them is raised."""
    given: dict[str, Number | None] = dict(sizes)
    broken = []
    for choice in choices:
        chosen = {name: value for name, value in choice.items() if value is not None}
        if len(chosen) != 1:
            broken.append((" or ".join(choice), "exactly one of them"))
        given |= chosen
    positive = {*sizes, "density", "mass"}
    values: dict[str, Exact] = {}
    for name, value in given.items():
        try:
            values[name] = Exact.of(value, ())  # type: ignore[arg-type]
        except NotANumber as error:
            broken.append((name, str(error)))
            continue
        if name in positive and values[name].sign() != 1:
            broken.append((name, "must be greater than 0"))
    if broken:
        raise ImpossibleTop(broken)
    return values
