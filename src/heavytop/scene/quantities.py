"""The table of quantities: symbol, unit, name and format of each number, and what scenes may want.

Terminal, pages, figures, netCDF, JSON descriptions and the player read it. For runs and the closed
form it says which columns hold a quantity, and how those that follow from others are computed.
A new quantity is a row of `QUANTITIES`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from decimal import ROUND_CEILING, Context
from enum import IntEnum
from functools import partial
from typing import Any, Final, NamedTuple, TypeAlias

from heavytop.errors import Impossible, Refused
from heavytop.exact import Exact, parse
from heavytop.scene.arguments import Reader

ANGLES: Final = ("theta", "phi", "psi")
RATES: Final = ("thetadot", "phidot", "psidot")
MISSING: Final = "–"


class Need(IntEnum):
    """How much of a motion must be followed; each includes all those before it."""

    NOTHING = 0  # it is known from the start alone
    TILT = 1  # theta; by the constants of the motion the rates follow from it
    AXIS = 2  # the direction of the axis, phi modulo 2 pi
    PHI = 3  # phi, with all its turns
    PSI = 4  # psi, with all its turns
    NEVER = 5  # no scene may want it


Units: TypeAlias = Mapping[str, tuple[str, float]]
"""For a unit of SI the unit that is shown in its place, and the factor from SI to it."""

SI: Final[Units] = {}
UNITS_SHOWN: Final[ContextVar[Units]] = ContextVar("units", default=SI)
"""The units in which numbers are shown, where they are not those of SI."""


def read_units(names: str) -> Units:
    """Read a list such as deg,rpm,ms; raise `Impossible` where one of them is no unit.

    >>> read_units("deg,ms")["s"]
    ('ms', 1000.0)
    """
    listed = [each.strip() for each in names.split(",")]
    if unknown := [name for name in listed if name not in parse.UNITS]:
        hints = "; ".join(filter(None, (parse.unit_hint(name, parse.UNITS) for name in unknown)))
        rule = f"{', '.join(unknown)}: units are {', '.join(parse.UNITS)}"
        raise Impossible([("unit", str(Refused(rule, hints)))])
    si_unit = {name: si for si, units in parse.UNITS_OF.items() for name in units}
    return {si_unit[name]: (name, float(1 / parse.UNITS[name])) for name in listed}


@contextmanager
def show_units(units: Units) -> Iterator[None]:
    """Show these units in place of those of SI, within a ``with`` block."""
    token = UNITS_SHOWN.set(units)
    try:
        yield
    finally:
        UNITS_SHOWN.reset(token)


class Quantity(NamedTuple):
    """What a number is, and how it is shown.

    Attributes
    ----------
    symbol : str
        As a plain text, an index after ``_``.
    unit : str
        As a plain text; "1" of a number without a unit.
    name : str
    format : str
        A format of Python; after ``^`` that of a proved bound, which is rounded up.
    parts : str
        The letters of the components of a vector; empty for a number.
    need : Need
        How much of the motion must be followed where a scene wants it.
    columns : tuple of str
        The columns that hold it, if it is no column itself.
    judged_by : tuple of str
        The quantities whose errors must meet the digits where it is wanted, if not its own.
    of : callable or None
        A function that computes it, where it follows from others: of a record with ``t``, ``theta``
        and the other columns of a run or of the closed form, in doubles or in mpmath's numbers, and
        of the exact `Motion`. The top of that is exact; its period is a double, its `mpf` has more
        digits.
    given : tuple of str
        Numbers of a top that it needs, and that not every top has.
    """

    symbol: str
    unit: str = "1"
    name: str = ""
    format: str = ".12g"
    parts: str = ""
    need: Need = Need.NEVER
    columns: tuple[str, ...] = ()
    judged_by: tuple[str, ...] = ()
    of: Callable[[Any, Any], Any] | None = None
    given: tuple[str, ...] = ()

    @property
    def shown(self) -> tuple[str, float]:
        """The unit in which it is shown, and the factor from SI to that unit."""
        return UNITS_SHOWN.get().get(self.unit, (self.unit, 1.0))

    @property
    def heading(self) -> str:
        """The heading of a column, or the label of an axis of a chart."""
        unit, _ = self.shown
        return f"{self.symbol} [{unit}]" if unit not in ("1", "") else self.symbol

    @property
    def cf_unit(self) -> str:
        """The unit as the CF conventions of netCDF spell it.

        >>> QUANTITIES["p_phi"].cf_unit, QUANTITIES["axis"].cf_unit
        ('kg m2 s-1', '1')
        """
        return (self.unit or "1").replace("/s²", " s-2").replace("/s", " s-1").replace("²", "2")

    @property
    def attributes(self) -> dict[str, str]:
        """The attributes of its variable in a netCDF file."""
        return {"long_name": self.name or self.symbol, "units": self.cf_unit}

    def missing(self, top: Any) -> list[str]:
        """The numbers that it needs and that this top does not have."""
        return [name for name in self.given if getattr(top, name) is None]

    def text(self, value: Any, digits: int = 17) -> str:
        """Return a value as text, with at most so many digits; a text that is no number unchanged.

        >>> QUANTITIES["theta"].text(2 / 3, 3), QUANTITIES["bound"].text(1.41e-15)
        ('0.667', '1.5e-15')
        """
        if value is None or value != value:
            return MISSING
        if isinstance(value, list | tuple):
            return f"[{', '.join(self.text(x, digits) for x in value)}]"
        factor = self.shown[1]
        value = value if factor == 1.0 else read_decimal(value)
        if isinstance(value, str | bool) or not self.format:
            return str(value)
        value = value if factor == 1.0 else float(value) * factor
        form = PRECISION.sub(lambda precision: str(min(int(precision[0]), digits)), self.format)
        if form.startswith("^"):
            up = Context(prec=int(form[2]) + 1, rounding=ROUND_CEILING)
            return format(float(up.create_decimal_from_float(float(value))), form[1:])
        text = format(value, form)
        return f"{float(text):.0f}" if "e+0" in text and form.endswith("g") else text

    def with_unit(self, *values: Any, between: str = " to ", form: str = "") -> str:
        """Return values as text with their unit, or with the unit chosen in its place.

        >>> QUANTITIES["theta"].with_unit(0.5, 1), QUANTITIES["omega3"].with_unit("30 rpm")
        ('0.5 to 1 rad', '30 rpm')
        """
        quantity = self._replace(format=form or self.format)
        text, (unit, factor) = between.join(map(quantity.text, values)), self.shown
        if text.endswith(tuple(parse.UNITS)):  # of an expression that brings its own
            return text
        if factor != 1.0 and any(isinstance(read_decimal(x), str) for x in values):
            unit = self.unit  # an expression, which is in SI
        return f"{text} {unit}".removesuffix(" 1").rstrip()


def read_decimal(value: Any) -> Any:
    """Return the double of a text that is a number of more digits; anything else unchanged."""
    with suppress(ValueError):
        return float(value) if isinstance(value, str) else value
    return value


def number_like(column: Any) -> Callable[[Exact], Any]:
    """Return the function from an exact number to the type of a column: float, or mpmath's mpf."""
    first = column.item(0) if getattr(column, "size", 0) else column
    ctx = getattr(first, "context", None)
    return float if ctx is None else lambda exact: exact.mpf(ctx)


def _reaction(record: Any, motion: Any) -> Any:
    """The force of the pivot on the top [N], in space."""
    return motion.top.reaction(record.axis, record.omega, number_like(record.t))


PRECISION: Final = re.compile(r"\d+(?=g)")

_ERROR: Final = ".1e"
QUANTITIES: Final[Mapping[str, Quantity]] = {
    # what a scene may want
    "class": Quantity("class", "", "kind of motion", need=Need.NOTHING),
    "period": Quantity("period", "s", "nutation period", need=Need.NOTHING),
    "theta": Quantity("θ", "rad", "tilt of the axis from the upward vertical", need=Need.TILT),
    "axis": Quantity("axis", "1", "unit vector along the symmetry axis, in space", parts="xyz",
                     need=Need.AXIS),
    "phi": Quantity("φ", "rad", "precession angle, continuous from the start", need=Need.PHI),
    "psi": Quantity("ψ", "rad", "spin angle, continuous from the start", need=Need.PSI),
    "rates": Quantity("rates", "rad/s", "rates of the Euler angles", need=Need.TILT,
                      columns=RATES),
    "attitude": Quantity("attitude", "1", "attitude, body to space", need=Need.PSI,
                         columns=("quaternion",)),
    "reaction": Quantity("reaction", "N", "force of the pivot on the top, in space", parts="xyz",
                         need=Need.AXIS, judged_by=("axis", "rates"), of=_reaction,
                         given=("mass", "distance")),
    # the motion
    "t": Quantity("t", "s", "time since the start"),
    "thetadot": Quantity("θ̇", "rad/s", "rate of the tilt"),
    "phidot": Quantity("φ̇", "rad/s", "rate of precession"),
    "psidot": Quantity("ψ̇", "rad/s", "rate of the spin angle"),
    "omega": Quantity("ω", "rad/s", "angular velocity, in space", parts="xyz"),
    "omega3": Quantity("ω₃", "rad/s", "angular velocity about the symmetry axis"),
    "quaternion": Quantity("q", "1", "attitude, body to space, scalar first", parts="wxyz"),
    "residual": Quantity("residual", "rad/s", "value of the event function where it was found",
                         ".3g"),
    "event": Quantity("event", "", "what happens: a turning point, a reversal or a cusp"),
    # the top and its constants
    "A": Quantity("A", "kg m²", "moment of inertia about the tip, across the axis"),
    "C": Quantity("C", "kg m²", "moment of inertia along the axis"),
    "gMR": Quantity("gMR", "J", "weight times the distance from the tip to the centre of mass"),
    "mass": Quantity("M", "kg", "mass"),
    "distance": Quantity("R", "m", "from the tip to the centre of mass"),
    "E": Quantity("E", "J", "energy: kinetic, and the potential gMR cos θ"),
    "E_prime": Quantity("E′", "J", "E − p_ψ²/2C: what is left without the constant spin"),
    "p_phi": Quantity("p_φ", "kg m²/s", "angular momentum about the vertical"),
    "p_psi": Quantity("p_ψ", "kg m²/s", "angular momentum about the axis"),
    "theta_min": Quantity("least θ", "rad", "smallest tilt"),
    "theta_max": Quantity("greatest θ", "rad", "largest tilt"),
    "round": Quantity("once round", "s", "time in which the axis goes once round the vertical"),
    "amplitude": Quantity("amplitude", "rad", "how far the axis nods"),
    "precession": Quantity("Δφ per period", "rad", "advance of φ in a nutation period"),
    "spin": Quantity("Δψ per period", "rad", "advance of ψ in a nutation period"),
    "mean_precession_rate": Quantity("mean φ̇", "rad/s"),
    "mean_spin_rate": Quantity("mean ψ̇", "rad/s"),
    "phidot_reversal_theta": Quantity("φ̇ reverses at θ", "rad"),
    "psidot_reversal_theta": Quantity("ψ̇ reverses at θ", "rad"),
    "nutation_frequency": Quantity("nutation", "rad/s"),
    "nutation_amplitude": Quantity("range of cos θ"),
    "rotation_number": Quantity("turns of φ", "1", "per nutation"),
    "small_nutation_frequency": Quantity("small nutation", "rad/s", "about a constant tilt"),
    "other_precession_rate": Quantity("other steady φ̇", "rad/s"),
    "other_nutation_frequency": Quantity("its small nutation", "rad/s"),
    "growth_rate": Quantity("small tilt grows by", "1/s", "rate of e^(rate t)"),
    "slow_cone_rate": Quantity("φ̇ of slow cones", "rad/s", "of small tilts"),
    "fast_cone_rate": Quantity("φ̇ of fast cones", "rad/s", "of small tilts"),
    "sleeping_threshold": Quantity("sleeps from |ω₃|", "rad/s"),
    "fast_top_ratio": Quantity("p_ψ²/4A|gMR|"),
    "kind": Quantity("kind", "1", "kind of motion", ""),
    "detail": Quantity("detail", "1", "distinguishes motions of one kind", ""),
    "certified": Quantity("proved", "1", "1 where the kind is proved", ""),
    "tags": Quantity("tags", "1", "tags that hold, as bits", ""),
    "open_tags": Quantity("open tags", "1", "tags neither proved nor disproved, as bits", ""),
    # errors
    "energy": Quantity("energy", "1", "E', relative to max(|E'|, gMR)"),
    "p_phi_error": Quantity("p_φ", "1", "error of p_phi, relative", _ERROR),
    "p_psi_error": Quantity("p_ψ", "1", "error of p_psi, relative", _ERROR),
    "axis_error": Quantity("axis", "1", "distance of the axis, a unit vector, from the exact one",
                           _ERROR),
    "phase_s": Quantity("phase", "s", "phase error of the nutation", _ERROR),
    "input_rounding": Quantity("input rounding", "rad", "what binary numbers change at the end"),
    "event_time": Quantity("event time", "s", "largest error of a time of an event", ".3g"),
    "energy_growth": Quantity("as t^", "1", "power of time: 1.40(2) is 1.40 ± 0.02", ""),
    "phase_growth": Quantity("as t^", "1", "", ""),
    "order": Quantity("order", "1", "power of the step with which errors fall", ".1f"),
    "error": Quantity("error", "1", "of the axis; of θ [rad] where θ is measured", _ERROR),
    "bound": Quantity("proved bound", "", "at all times, of axis and of angles [rad]", "^.1e"),
    "rounding": Quantity("part from adding turns", "", "", "^.1e"),
    "observed": Quantity("largest error without it", "", "", _ERROR),
    # studies
    "periods": Quantity("periods", "1", "time in nutation periods"),
    "us_per_period": Quantity("time", "µs", "of a nutation period, in the steps", ".3g"),
    "setup_s": Quantity("setup", "s", "to compile", ".2g"),
    "ratio": Quantity("slower", "1", "times the cheapest", ".3g"),
    "setting": Quantity("setting", "", "tolerance, or steps a period", ".3g"),
    "digits_lost": Quantity("digits lost", "1", "beyond what conditioning allows", ".1f"),
    "scheme": Quantity("method", "1", "method that was followed", ""),
    "start": Quantity("start", "1", "number of the start", ""),
    "share": Quantity("share", "", "", ".3%"),
    "pixels": Quantity("pixels", "1", "", ""),
    "measured": Quantity("measured", "", "", ".2g"),
    "claim_bound": Quantity("bound", "", "", ".2g"),
}  # fmt: skip


def wanted() -> tuple[str, ...]:
    """The names of the quantities that a scene may want."""
    return tuple(name for name, quantity in QUANTITIES.items() if quantity.need < Need.NEVER)


_NUMBERS: Final = ("omega3", "A", "C", "gMR", "E", "E_prime", "p_phi", "p_psi")
UNIT_OF: Final[Mapping[str, str]] = {
    **{name: QUANTITIES[name].unit for name in (*ANGLES, *RATES, *_NUMBERS)},
    **dict.fromkeys(("A_cm", "C_cm"), "kg m²"),
    **dict.fromkeys(("distance", "radius", "thickness", "length", "outer", "inner"), "m"),
    **dict.fromkeys(("apex", "base", "centre"), "m"),
    **{"mass": "kg", "gravity": "m/s²", "density": "kg/m³", "time": "s", "periods": ""},
}
"""The unit of each number of a scene, by its key."""
PLAIN_NUMBER: Final[Reader] = partial(Exact.of, units=())
QUANTITY_READERS: Final[Mapping[str, Reader]] = {
    name: partial(Exact.of, units=parse.UNITS_OF[unit]) for name, unit in UNIT_OF.items()
}
"""The reader of each number of a scene, by its key."""


def quantity_of(name: str) -> Quantity:
    """Return the quantity of a name; of an error, or of a name without a row, one made from it.

    >>> quantity_of("theta_error").name, quantity_of("digits").heading
    ('error of tilt of the axis from the upward vertical', 'digits')
    """
    if name in QUANTITIES:
        return QUANTITIES[name]
    if name.endswith("_error"):
        of = quantity_of(name.removesuffix("_error"))
        return Quantity(of.symbol, of.unit, f"error of {of.name or of.symbol}", _ERROR)
    return Quantity(name.replace("_", " "), "", format="")


def values_of(record: Any, name: str, motion: Any) -> Any:
    """Return a quantity at the times of a record, which is of a run or of the closed form.

    For a run and the closed form it is computed with the same exact motion, that of the scene.
    """
    of = quantity_of(name).of
    return getattr(record, name) if of is None else of(record, motion)


def derived(top: Any) -> tuple[str, ...]:
    """The quantities that are computed from columns, and for which a top has the numbers."""
    return tuple(n for n, of in QUANTITIES.items() if of.of and not of.missing(top))


def columns_of(name: str) -> tuple[str, ...]:
    """The columns that hold a quantity of a moving top."""
    return QUANTITIES[name].columns or (name,)


def component_names(columns: tuple[str, ...]) -> tuple[str, ...]:
    """The names of columns of numbers, one for each component of a vector.

    >>> component_names(("t", "axis"))
    ('t', 'axis_x', 'axis_y', 'axis_z')
    """
    parts = {name: [f"{name}_{x}" for x in quantity_of(name).parts] for name in columns}
    return tuple(each for name in columns for each in parts[name] or [name])


def need_of(quantities: tuple[str, ...]) -> Need:
    """How much of a motion must be followed for all of some quantities.

    >>> need_of(("theta", "axis"))
    <Need.AXIS: 2>
    """
    return max(QUANTITIES[name].need for name in quantities)


def judged_quantities(quantities: tuple[str, ...]) -> tuple[str, ...]:
    """The quantities whose errors must meet the digits, by those that are wanted.

    >>> judged_quantities(("attitude", "reaction"))
    ('attitude', 'axis', 'rates')
    """
    moving = [name for name in quantities if QUANTITIES[name].need > Need.NOTHING]
    return tuple(dict.fromkeys(x for n in moving for x in QUANTITIES[n].judged_by or (n,)))
