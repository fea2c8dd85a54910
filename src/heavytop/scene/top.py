"""Top: what spins, and the homogeneous solids it may be made of.

The moments of a top are about the pivot: A about any transverse axis, C about the symmetry axis;
gMR is weight times the distance from the pivot to the centre of mass. A solid is placed on the
axis by its distance z from the pivot [m]; `Top.from_solids` adds solids up. Moments of solids are
the textbook's (Landau & Lifshitz, Mechanics, section 32, problem 2). Numbers are exact, π included.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypedDict, Unpack

from heavytop.display import Shown
from heavytop.errors import ImpossibleBodyWarning, ImpossibleTop
from heavytop.exact import PI, Exact, Number
from heavytop.scene.arguments import Wrong, as_call, exact_numbers, not_positive, set_fields, short

ALUMINIUM = Exact.of(2700)
"""Density of aluminium [kg m⁻³]."""

STEEL = Exact.of(7850)
"""Density of a carbon steel [kg m⁻³]."""


@dataclass(frozen=True, slots=True, init=False, repr=False)
class Top(Shown):
    """An axisymmetric rigid body on a fixed pivot, under gravity.

    Parameters
    ----------
    A : number
        Moment of inertia about any transverse axis through the pivot [kg m²].
    C : number
        Moment of inertia about the symmetry axis [kg m²]; 0 for a point mass, which has no spin.
    gMR : number
        Weight times the distance from pivot to centre of mass [kg m² s⁻²]; of either sign.

    Raises
    ------
    ImpossibleTop
        Some value is no number, A is not positive, or C is negative; every fault is listed.

    Warns
    -----
    ImpossibleBodyWarning
        C > 2A, which no rigid body can have; the equations hold all the same.

    Examples
    --------
    >>> top = Top(A="3.28e-4", C="6.60e-5", gMR="0.0456")
    >>> print(top.gMR)
    0.0456
    >>> top
    Top(A='3.28e-4', C='6.60e-5', gMR='0.0456')

    References
    ----------
    Sussman & Wisdom, *Structure and Interpretation of Classical Mechanics*, section 2.10.
    """

    A: Exact
    C: Exact
    gMR: Exact
    impossible: str = field(compare=False, repr=False)
    """The inequality of rigid bodies that it breaks; empty where it breaks none."""

    def __init__(self, A: Number, C: Number, gMR: Number) -> None:
        self._set(A, C, gMR)
        self._warn()

    @classmethod
    def of_numbers(cls, A: Number, C: Number, gMR: Number) -> Top:
        """The top with numbers that are computed, of which no user is to be warned.

        Parameters
        ----------
        A, C, gMR : number
            As of `Top` [kg m², kg m², kg m² s⁻²].

        Examples
        --------
        >>> Top.of_numbers(1, 5, 1).warning
        'C = 5 > 2A = 2: no rigid body has these moments of inertia'
        """
        top = cls.__new__(cls)
        top._set(A, C, gMR)
        return top

    def _set(self, A: Number, C: Number, gMR: Number, impossible: str = "") -> None:
        given = {"A": A, "C": C, "gMR": gMR}
        values = exact_numbers(ImpossibleTop, given, broken_body)
        if not impossible and (2 * values["A"] - values["C"]).sign() == -1:
            impossible = f"C = {short(values['C'])} > 2A = {short(2 * values['A'])}"
        set_fields(self, values | {"impossible": impossible})

    def _warn(self) -> None:
        if self.impossible:
            warnings.warn(self.warning, ImpossibleBodyWarning, stacklevel=3)

    @property
    def warning(self) -> str:
        """That no rigid body has these moments, and why; empty where some body has them."""
        return self.impossible and f"{self.impossible}: no rigid body has these moments of inertia"

    def __repr__(self) -> str:
        return as_call("Top", A=self.A, C=self.C, gMR=self.gMR)

    @classmethod
    def from_parts(
        cls, *, mass: Number, distance: Number, A_cm: Number, C_cm: Number, gravity: Number
    ) -> Top:
        """The top of mass M whose centre of mass lies R from the pivot (parallel axes).

        Parameters
        ----------
        mass : number
            M [kg], positive.
        distance : number
            R [m], along the axis from the pivot; negative below it.
        A_cm, C_cm : number
            Moments about the centre of mass, transverse and axial [kg m²].
        gravity : number
            g [m s⁻²].

        Raises
        ------
        ImpossibleTop
            Some value is no number, mass or A = A_cm + M R² is not positive, or C_cm is negative.

        Warns
        -----
        ImpossibleBodyWarning
            C_cm > 2 A_cm, or A < M R², which no rigid body can have.

        Examples
        --------
        >>> top = Top.from_parts(mass=15, distance=1, A_cm="0.234375", C_cm="0.46875",
        ...                      gravity="9.81")
        >>> print(top.A, top.C, top.gMR)
        15.234375 0.46875 147.15
        """
        given = {"mass": mass, "distance": distance, "A_cm": A_cm, "C_cm": C_cm}
        parts = exact_numbers(ImpossibleTop, given | {"gravity": gravity}, broken_body)
        M, R, A, C, g = parts.values()
        impossible = ""
        if A.sign() == -1:
            impossible = f"A = {short(A + M * R**2)} < M R² = {short(M * R**2)}"
        elif (2 * A - C).sign() == -1:
            impossible = f"C_cm = {short(C)} > 2 A_cm = {short(2 * A)}"
        top = cls.__new__(cls)
        top._set(A + M * R**2, C, M * g * R, impossible)
        top._warn()
        return top

    @classmethod
    def from_solids(cls, parts: Iterable[Solid], gravity: Number) -> Top:
        """The top made of homogeneous solids of revolution on its axis.

        Parameters
        ----------
        parts : iterable of Solid
            Disks, rods, rings, cones and spheres of `heavytop.scene.top`, each with its place.
        gravity : number
            g [m s⁻²].

        Raises
        ------
        ImpossibleTop
            There are no parts, one of them is no `Solid`, or gravity is no number.

        Examples
        --------
        An aluminium disk on a steel rod: the book's A = 3.28e-4, C = 6.60e-5 and gMR = 0.0456.

        >>> from heavytop.scene.top import ALUMINIUM, STEEL, ring, rod
        >>> wheel = ring(outer="0.042", inner="0.0015", thickness="0.005", centre="0.0505",
        ...              density=ALUMINIUM)
        >>> handle = rod(radius="0.0015", length="0.178", base=0, density=STEEL)
        >>> top = Top.from_solids([wheel, handle], gravity="9.80665")
        >>> print(f"{float(top.A):.3g} {float(top.C):.3g} {float(top.gMR):.3g}")
        0.000328 6.6e-05 0.0456
        """
        g = exact_numbers(ImpossibleTop, {"gravity": gravity}, broken_body)["gravity"]
        body = whole(parts)
        return cls(A=body.A, C=body.C, gMR=body.mass * body.centre * g)


def broken_body(values: Mapping[str, Exact]) -> list[Wrong]:
    """The rules that the mass and the moments, or those of them that are there, break."""
    broken = not_positive(values, ("A", "mass"))
    negative = (name for name in ("C", "C_cm") if name in values and values[name].sign() == -1)
    return broken + [Wrong(name, "must not be negative") for name in negative]


# --- homogeneous solids of revolution on the axis --------------------------------------------


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


class Matter(TypedDict, total=False):
    """What a solid is made of: its density ρ [kg m⁻³] or its mass M [kg], one of them."""

    density: Number | None
    mass: Number | None


class Placed(Matter, total=False):
    """Where it is: distance from the pivot of its middle or of its lower end [m], one of them."""

    centre: Number | None
    base: Number | None


def disk(*, radius: Number, thickness: Number, **given: Unpack[Placed]) -> Solid:
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
    values = _values("disk", given, Placed, radius=radius, thickness=thickness)
    return _cylinder(values, values["radius"], Exact.of(0), values["thickness"])


def rod(*, radius: Number, length: Number, **given: Unpack[Placed]) -> Solid:
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
    values = _values("rod", given, Placed, radius=radius, length=length)
    return _cylinder(values, values["radius"], Exact.of(0), values["length"])


def ring(*, outer: Number, inner: Number, thickness: Number, **given: Unpack[Placed]) -> Solid:
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
    values = _values("ring", given, Placed, outer=outer, inner=inner, thickness=thickness)
    if (values["outer"] - values["inner"]).sign() != 1:
        raise ImpossibleTop([("inner", "less than outer")])
    return _cylinder(values, values["outer"], values["inner"], values["thickness"])


def cone(*, radius: Number, apex: Number, base: Number, **given: Unpack[Matter]) -> Solid:
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
    values = _values("cone", given, Matter, radius=radius, apex=apex, base=base)
    r, height = values["radius"], values["base"] - values["apex"]
    if height.sign() == 0:
        raise ImpossibleTop([("base", "apart from the apex")])
    M = _mass(values, PI * r**2 * height * (height.sign() or 1) / 3)
    centre = values["apex"] + height * 3 / 4
    return Solid(M, centre, M * 3 * (4 * r**2 + height**2) / 80, M * 3 * r**2 / 10)


def sphere(*, radius: Number, centre: Number, **given: Unpack[Matter]) -> Solid:
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
    values = _values("sphere", given, Matter, radius=radius, centre=centre)
    M = _mass(values, PI * values["radius"] ** 3 * 4 / 3)
    moment = M * values["radius"] ** 2 * 2 / 5
    return Solid(M, values["centre"], moment, moment)


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


def _cylinder(values: Mapping[str, Exact], outer: Exact, inner: Exact, height: Exact) -> Solid:
    M = _mass(values, PI * (outer**2 - inner**2) * height)
    centre = values["centre"] if "centre" in values else values["base"] + height / 2
    across = outer**2 + inner**2
    return Solid(M, centre, M * (3 * across + height**2) / 12, M * across / 2)


def _mass(values: Mapping[str, Exact], volume: Exact) -> Exact:
    return values["mass"] if "mass" in values else values["density"] * volume


_PAIRS = (("centre", "base"), ("density", "mass"))
_POSITIVE = ("radius", "outer", "inner", "thickness", "length", "density", "mass")


def _values(
    solid: str, given: Mapping[str, Any], known: type[Matter], **sizes: Number
) -> dict[str, Exact]:
    """Sizes, and one of each pair that may be given, as exact numbers; every fault is raised."""
    if strange := given.keys() - known.__annotations__.keys():
        raise TypeError(f"{solid}() got an unexpected keyword argument {min(strange)!r}")
    chosen = {name: value for name, value in given.items() if value is not None}
    pairs = [pair for pair in _PAIRS if pair[0] in known.__annotations__]
    unclear = [pair for pair in pairs if len(chosen.keys() & {*pair}) != 1]
    broken = [Wrong(" or ".join(pair), "exactly one of them") for pair in unclear]
    return exact_numbers(
        ImpossibleTop, sizes | chosen, lambda values: broken + not_positive(values, _POSITIVE)
    )
