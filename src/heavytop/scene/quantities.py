"""What can be wanted of a motion: how much of it must be followed, and the columns that hold it.

Whatever knows a quantity by its name asks here: a scene what there is, a formulation what it can
give, a plan what it must follow, a comparison what is held to the digits, a file what its columns
are. A new quantity is a line in `QUANTITIES`, and one in `COLUMNS` for each column that is new.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Final, NamedTuple, TypeAlias

from heavytop.exact import parse
from heavytop.names import nearest
from heavytop.scene.arguments import Refused

ANGLES: Final = ("theta", "phi", "psi")
RATES: Final = ("thetadot", "phidot", "psidot")


class Need(IntEnum):
    """How much of a motion must be followed; each includes all those before it."""

    NOTHING = 0  # it is known from the start alone
    TILT = 1  # theta; by the constants of the motion the rates follow from it
    AXIS = 2  # the direction of the axis, phi modulo 2 pi
    PHI = 3  # phi, with all its turns
    PSI = 4  # psi, with all its turns


class QuantityColumn(NamedTuple):
    """What stands in a column, its unit, and of a vector the letters of its components."""

    words: str
    unit: str
    parts: str = ""


COLUMNS: Final[Mapping[str, QuantityColumn]] = {
    "theta": QuantityColumn("tilt of the axis from the upward vertical", "rad"),
    "phi": QuantityColumn("precession angle, continuous from the start", "rad"),
    "psi": QuantityColumn("spin angle, continuous from the start", "rad"),
    "thetadot": QuantityColumn("rate of the tilt", "rad s-1"),
    "phidot": QuantityColumn("rate of precession", "rad s-1"),
    "psidot": QuantityColumn("rate of the spin angle", "rad s-1"),
    "axis": QuantityColumn("unit vector along the symmetry axis, in space", "1", "xyz"),
    "omega": QuantityColumn("angular velocity, in space", "rad s-1", "xyz"),
    "reaction": QuantityColumn("force of the pivot on the top, in space", "N", "xyz"),
    "quaternion": QuantityColumn("attitude, body to space, scalar first", "1", "wxyz"),
}


@dataclass(frozen=True, slots=True)
class Quantity:
    """What can be wanted by one name.

    Attributes
    ----------
    need : Need
        How much of the motion must be followed to know it.
    columns : tuple of str
        The columns of a motion that hold it, as a run and the closed form both have them.
    judged_by : tuple of str
        The quantities whose errors must meet the digits where this one is wanted.
    """

    need: Need
    columns: tuple[str, ...] = ()
    judged_by: tuple[str, ...] = ()


QUANTITIES: Final[Mapping[str, Quantity]] = {
    "class": Quantity(Need.NOTHING),
    "period": Quantity(Need.NOTHING),
    "theta": Quantity(Need.TILT, ("theta",), ("theta",)),
    "axis": Quantity(Need.AXIS, ("axis",), ("axis",)),
    "phi": Quantity(Need.PHI, ("phi",), ("phi",)),
    "psi": Quantity(Need.PSI, ("psi",), ("psi",)),
    "rates": Quantity(Need.TILT, RATES, ("rates",)),
    "reaction": Quantity(Need.AXIS, judged_by=("axis", "rates")),
    "attitude": Quantity(Need.PSI, ("quaternion",), ("phi", "psi", "axis")),
}


Units: TypeAlias = Mapping[str, tuple[str, float]]
"""By a unit of SI another one, and how many of it one of SI is."""

SI: Final[Units] = {}
UNITS_OF: Final = {
    "rad": parse.ANGLES, "rad/s": parse.RATES, "s": parse.TIMES, "kg": parse.MASSES,
    "m": parse.LENGTHS, "kg m²": parse.MOMENTS,
}  # fmt: skip


def read_units(names: str) -> Units:
    """Read a list such as deg,rpm,ms; `Refused` where one of them is no unit.

    >>> read_units("deg,ms")["s"]
    ('ms', 1000.0)
    """
    found = {}
    for name in (each.strip() for each in names.split(",")):
        si = next((si for si, units in UNITS_OF.items() if name in units), "")
        if not si:
            known = [each for units in UNITS_OF.values() for each in units]
            raise Refused(f"units out of {', '.join(known)}", nearest(name, known))
        found[si] = name, float(1 / parse.UNITS[name])
    return found


def scaled(unit: str, units: Units) -> tuple[str, float]:
    """The unit to show in place of one of SI, and how many of it one of SI is."""
    return units.get(unit, (unit, 1.0))


def spelled(columns: tuple[str, ...]) -> tuple[str, ...]:
    """The names of columns of numbers, one for each component of a vector.

    >>> spelled(("t", "axis"))
    ('t', 'axis_x', 'axis_y', 'axis_z')
    """
    parts = {name: [f"{name}_{x}" for x in column.parts] for name, column in COLUMNS.items()}
    return tuple(each for name in columns for each in parts.get(name) or [name])


def need_of(quantities: tuple[str, ...]) -> Need:
    """How much of a motion must be followed for all of some quantities.

    >>> need_of(("theta", "axis"))
    <Need.AXIS: 2>
    """
    return max(QUANTITIES[name].need for name in quantities)


def judged(quantities: tuple[str, ...]) -> set[str]:
    """The quantities whose errors must meet the digits, by those that are wanted.

    >>> sorted(judged(("theta", "attitude")))
    ['axis', 'phi', 'psi', 'theta']
    """
    return {each for name in quantities for each in QUANTITIES[name].judged_by}
