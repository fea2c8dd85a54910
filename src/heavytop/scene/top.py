"""Top: the rigid body.

The moments of a top are about the pivot: A about any transverse axis, C about the symmetry axis;
gMR is weight times the distance from the pivot to the centre of mass. Numbers are exact.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from heavytop.errors import ImpossibleBodyWarning, ImpossibleTop
from heavytop.exact import Exact, Number
from heavytop.exact.number import ZERO
from heavytop.scene import arguments
from heavytop.scene.arguments import Numbers, Reader, Way, drop_none, exact_numbers, short_text
from heavytop.scene.quantities import QUANTITY_READERS
from heavytop.scene.solids import Solid, combine, read_solids
from heavytop.text import Shown


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
    mass, distance : number, optional
        M [kg] and R [m], which only the force on the pivot needs; R is negative below the pivot.

    Attributes
    ----------
    given : tuple of (str, object)
        The top as it was given, by the keys of a scene file.

    Raises
    ------
    ImpossibleTop
        Some value is no number, A is not positive, or C is negative; every fault is listed.

    Warns
    -----
    ImpossibleBodyWarning
        C > 2A, or moments about the centre of mass that no rigid body can have; the equations hold
        all the same.

    Examples
    --------
    >>> top = Top(A="3.28e-4", C="6.60e-5", gMR="0.0456")
    >>> print(top.gMR)
    0.0456
    >>> top
    Top(A='3.28e-4', C='6.60e-5', gMR='0.0456')

    References
    ----------
    Sussman & Wisdom, *Structure and Interpretation of Classical Mechanics* (2001), section 2.10.
    """

    A: Exact
    C: Exact
    gMR: Exact
    mass: Exact | None = field(compare=False)
    distance: Exact | None = field(compare=False)
    given: tuple[tuple[str, Any], ...] = field(compare=False)
    warning: str = field(compare=False, repr=False)
    """The inequality of rigid bodies that its moments break; empty where they break none."""

    def __init__(
        self,
        A: Number,
        C: Number,
        gMR: Number,
        mass: Number | None = None,
        distance: Number | None = None,
    ) -> None:
        self._read({"A": A, "C": C, "gMR": gMR} | drop_none(mass=mass, distance=distance))

    @classmethod
    def of(cls, given: Mapping[str, object], warn: bool = True) -> Top:
        """The top that the keys of a scene's ``[top]`` determine.

        Parameters
        ----------
        given : mapping from str to object
            Keys of `heavytop.scene.top.TOP`, and their values.
        warn : bool
            Whether to warn of moments that no rigid body has.

        Raises
        ------
        ImpossibleTop
            A value breaks its rule, or too many or too few are given.

        Examples
        --------
        >>> print(Top.of({"mass": 2, "distance": 3, "gravity": 10, "A_cm": 1, "C": 1}).A)
        19
        """
        top = cls.__new__(cls)
        top._read(given, warn)
        return top

    @classmethod
    def of_numbers(cls, A: Number, C: Number, gMR: Number) -> Top:
        """The top with computed numbers; it never warns of moments that no rigid body has.

        Parameters
        ----------
        A, C, gMR : number
            As of `Top` [kg m², kg m², kg m² s⁻²].

        Examples
        --------
        >>> Top.of_numbers(1, 5, 1).warning
        'C = 5 > 2A = 2: no rigid body has these moments of inertia'
        """
        return cls.of({"A": A, "C": C, "gMR": gMR}, warn=False)

    def _read(self, given: Mapping[str, object], warn: bool = True) -> None:
        """Set the fields of a top that is given by keys of the way that fits them best."""
        names = [name for name in given if name in TOP]
        way = min(WAYS, key=lambda each: each.distance(names))
        values = exact_numbers(ImpossibleTop, way, given, TOP)
        found = way.make(values)
        if found["A"].sign() != 1:  # A_cm of parts may be anything, A may not
            raise ImpossibleTop([("A", "must be greater than 0")])
        source = found if "solids" in values else values
        about = {"given": tuple(source.items()), "warning": _moment_warning(found)}
        arguments.set_fields(self, {"mass": None, "distance": None} | found | about)
        if warn and self.warning:
            warnings.warn(self.warning, ImpossibleBodyWarning, stacklevel=4)

    def reaction(self, axis: Any, omega: Any, number: Callable[[Exact], Any] = float) -> Any:
        """The force of the pivot on the top, in space, by Newton's law: M R ë + M g.

        Parameters
        ----------
        axis, omega : array_like, shape (…, 3)
            The axis e and the angular velocity [rad/s], in space.
        number : callable
            The function from exact numbers of the top to the type of the arrays' numbers.

        Returns
        -------
        ndarray, shape (…, 3)
            [N].

        Raises
        ------
        ImpossibleTop
            Mass and distance are not given.

        Examples
        --------
        >>> top = Top.from_parts(mass=2, distance="0.5", A=1, C=1, gravity=10)
        >>> [float(force) for force in top.reaction([0, 0, 1], [0, 0, 3])]
        [0.0, 0.0, 20.0]
        """
        import numpy as np

        if self.mass is None or self.distance is None:
            raise ImpossibleTop([("mass", "missing: the force needs mass and distance")])
        gravity = dict(self.given).get("gravity")
        if gravity is None and self.distance == 0:
            raise ImpossibleTop([("gravity", "missing: gMR = 0 of a balanced top has no weight")])
        A, C, gMR, M, R = map(number, (self.A, self.C, self.gMR, self.mass, self.distance))
        weight = number(self.gMR / self.distance if gravity is None else self.mass * gravity)
        e, omega, up = np.asarray(axis), np.asarray(omega), np.array([0, 0, 1])
        rate, omega3 = np.cross(omega, e), np.sum(omega * e, axis=-1, keepdims=True)
        across = gMR / A * np.cross(up, e) - C / A * omega3 * rate  # e × ë, by Euler's equations
        acceleration = np.cross(across, e) - np.sum(rate * rate, axis=-1, keepdims=True) * e
        return M * R * acceleration + weight * up

    def __repr__(self) -> str:
        return arguments.call_text("Top", A=self.A, C=self.C, gMR=self.gMR)

    @classmethod
    def from_parts(
        cls,
        *,
        mass: Number,
        distance: Number,
        gravity: Number,
        A_cm: Number | None = None,
        C_cm: Number | None = None,
        A: Number | None = None,
        C: Number | None = None,
    ) -> Top:
        """The top of mass M whose centre of mass lies R from the pivot (parallel axes).

        Parameters
        ----------
        mass : number
            M [kg], positive.
        distance : number
            R [m], along the axis from the pivot; negative below it.
        gravity : number
            g [m s⁻²].
        A_cm, C_cm : number, optional
            Moments about the centre of mass, transverse and axial [kg m²]; or
        A, C : number, optional
            moments about the pivot [kg m²]: one of either pair.

        Raises
        ------
        ImpossibleTop
            Some value is no number, both or none of a pair are given, mass or A = A_cm + M R² is
            not positive, or C is negative.

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
        given = {"mass": mass, "distance": distance, "gravity": gravity}
        return cls.of(given | drop_none(A_cm=A_cm, C_cm=C_cm, A=A, C=C))

    @classmethod
    def from_solids(cls, parts: Iterable[Solid], gravity: Number) -> Top:
        """The top made of homogeneous solids of revolution on its axis.

        Parameters
        ----------
        parts : iterable of Solid
            Disks, rods, rings, cones and spheres of `heavytop.scene.solids`, at their places.
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
        return cls.of({"solids": parts, "gravity": gravity})


# --- the sets of keys that determine a top ---------------------------------------------------


def _of_parts(values: Numbers) -> dict[str, Exact]:
    """A, C and gMR of mass, distance and moments, by the parallel-axis theorem."""
    M, R = values["mass"], values["distance"]
    return {
        "A": values["A"] if "A" in values else values["A_cm"] + M * R**2,
        "C": values["C"] if "C" in values else values["C_cm"],
        "gMR": M * values["gravity"] * R,
        "mass": M,
        "distance": R,
    }


def _of_solids(values: Mapping[str, Any]) -> dict[str, Exact]:
    """A, C, gMR, mass and distance of a body made of solids."""
    body = combine(values["solids"])
    parts = {"gravity": values["gravity"], "mass": body.mass, "distance": body.centre}
    return _of_parts({**parts, "A": body.A, "C": body.C})


MOMENT_WAYS: Final = (("A",), ("C",), ("gMR",))
TOP_PARTS: Final = (("mass",), ("distance",), ("gravity",), ("A_cm", "A"), ("C_cm", "C"))
WAYS: Final = (
    Way("a top of A, C, gMR", MOMENT_WAYS, dict),
    Way("a top of mass and distance", TOP_PARTS, _of_parts),
    Way("a top of A, C, gMR, mass, distance", (*MOMENT_WAYS, ("mass",), ("distance",)), dict),
    Way("a top of solids", (("solids",), ("gravity",)), _of_solids),
)
TOP: Final[Mapping[str, Reader]] = {
    **{name: QUANTITY_READERS[name] for name in ("A_cm", "gMR", "distance", "gravity")},
    **{name: arguments.positive(QUANTITY_READERS[name]) for name in ("A", "mass")},
    **{name: arguments.not_negative(QUANTITY_READERS[name]) for name in ("C", "C_cm")},
    "solids": read_solids,
}
"""The reader of each value of a top."""


def _moment_warning(values: Numbers) -> str:
    """A warning of an inequality of rigid bodies that the moments break; empty if they keep all."""
    A, C = values["A"], values["C"]
    about_pivot = values["mass"] * values["distance"] ** 2 if "mass" in values else ZERO
    A_cm, about = A - about_pivot, "_cm" if "mass" in values else ""
    if A_cm.sign() == -1:
        broken = f"A = {short_text(A)} < M R² = {short_text(about_pivot)}"
    elif (2 * A_cm - C).sign() == -1:
        doubled = f"2{about and ' '}A{about} = {short_text(2 * A_cm)}"
        broken = f"C{about} = {short_text(C)} > {doubled}"
    else:
        return ""
    return f"{broken}: no rigid body has these moments of inertia"
