"""Top: what spins.

Moments are about the pivot: A about any transverse axis, C about the symmetry axis; gMR is weight
times the distance from the pivot to the centre of mass.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from heavytop.errors import ImpossibleTop
from heavytop.numbers import Exact, Number
from heavytop.scene.checking import Broken, fill, made, read, short
from heavytop.scene.solids import Solid, whole


@dataclass(frozen=True, slots=True, init=False, repr=False)
class Top:
    """An axisymmetric rigid body on a fixed pivot, under gravity.

    Parameters
    ----------
    A : number
        Moment of inertia about any transverse axis through the pivot [kg m²].
    C : number
        Moment of inertia about the symmetry axis [kg m²].
    gMR : number
        Weight times the distance from pivot to centre of mass [kg m² s⁻²]; of either sign.

    Raises
    ------
    ImpossibleTop
        Some value is no number, A or C is not positive, or C > 2A; every fault is listed.

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

    def __init__(self, A: Number, C: Number, gMR: Number) -> None:
        broken, values = read(A=A, C=C, gMR=gMR)
        if broken := broken + broken_moments(values):
            raise ImpossibleTop(broken)
        fill(self, values)

    def __repr__(self) -> str:
        return made("Top", A=self.A, C=self.C, gMR=self.gMR)

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
            Some value is no number, mass, A_cm or C_cm is not positive, or C_cm > 2 A_cm.

        Examples
        --------
        >>> top = Top.from_parts(mass=15, distance=1, A_cm="0.234375", C_cm="0.46875",
        ...                      gravity="9.81")
        >>> print(top.A, top.C, top.gMR)
        15.234375 0.46875 147.15
        """
        broken, parts = read(mass=mass, distance=distance, A_cm=A_cm, C_cm=C_cm, gravity=gravity)
        if broken := broken + broken_parts(parts):
            raise ImpossibleTop(broken)
        M, R = parts["mass"], parts["distance"]
        return cls(A=parts["A_cm"] + M * R**2, C=parts["C_cm"], gMR=M * parts["gravity"] * R)

    @classmethod
    def from_solids(cls, parts: Iterable[Solid], gravity: Number) -> Top:
        """The top made of homogeneous solids of revolution on its axis.

        Parameters
        ----------
        parts : iterable of Solid
            Disks, rods, rings, cones and spheres of `heavytop.scene.solids`, each with its place.
        gravity : number
            g [m s⁻²].

        Raises
        ------
        ImpossibleTop
            There are no parts, one of them is no `Solid`, or gravity is no number.

        Examples
        --------
        An aluminium disk on a steel rod: the book's A = 3.28e-4, C = 6.60e-5 and gMR = 0.0456.

        >>> from heavytop.scene.solids import ALUMINIUM, STEEL, ring, rod
        >>> wheel = ring(outer="0.042", inner="0.0015", thickness="0.005", centre="0.0505",
        ...              density=ALUMINIUM)
        >>> handle = rod(radius="0.0015", length="0.178", base=0, density=STEEL)
        >>> top = Top.from_solids([wheel, handle], gravity="9.80665")
        >>> print(f"{float(top.A):.3g} {float(top.C):.3g} {float(top.gMR):.3g}")
        0.000328 6.6e-05 0.0456
        """
        broken, values = read(gravity=gravity)
        if broken:
            raise ImpossibleTop(broken)
        body = whole(parts)
        return cls(A=body.A, C=body.C, gMR=body.mass * body.centre * values["gravity"])


def broken_moments(values: Mapping[str, Exact]) -> Broken:
    """The rules that A and C, or those of the two that are there, break."""
    broken = _not_positive(values, ("A", "C"))
    return broken or _too_flat(values, "A", "C", "must be at most 2A = {} about the pivot")


def broken_parts(parts: Mapping[str, Exact]) -> Broken:
    """The rules that mass, A_cm and C_cm, or those of them that are there, break."""
    broken = _not_positive(parts, ("mass", "A_cm", "C_cm"))
    return broken or _too_flat(parts, "A_cm", "C_cm", "must be at most 2 A_cm = {}")


def _not_positive(values: Mapping[str, Exact], names: Collection[str]) -> Broken:
    there = (name for name in names if name in values)
    return [(name, "must be greater than 0") for name in there if values[name].sign() != 1]


def _too_flat(values: Mapping[str, Exact], A: str, C: str, rule: str) -> Broken:
    """C ≤ 2A, with equality for a disc through the point the moments are about."""
    if A in values and C in values and (2 * values[A] - values[C]).sign() == -1:
        return [(C, rule.format(short(2 * values[A])))]
    return []
