"""The headers of columns: quantity, component and unit of a name such as ``tilt_deg``.

Also the number of digits that numbers are written with.
"""

from __future__ import annotations

import re
import unicodedata
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from heavytop.exact.pairs import UNIT, Array

_ANGLE_NAMES: Final = {
    "theta": "theta tilt nutation nut beta inclination inclinaison inklination neigung polar "
    "colatitude tiltangle kippwinkel",
    "phi": "phi precession prec praezession prazession azimuth azimut azimutal acimut alpha "
    "precesion precessione heading",
    "psi": "psi spin chi rotation eigenrotation eigendrehung rotationpropre rotacion rotazione "
    "gamma",
    "elevation": "elevation elev altitude elevacion elevazione hohenwinkel hoehenwinkel",
}
_TIMES: Final = "t time zeit temps tiempo tempo tid timestamp times clock"
_SPEEDS: Final = "{0}dot d{0} d{0}dt {0}d {0}rate {0}velocity {0}speed {0}punkt {0}geschwindigkeit"
# For each vector its names, and the sets of names of its components: one has to be complete.
_VECTORS: Final[Mapping[str, tuple[str, tuple[str, ...]]]] = {
    "quaternion": ("quaternion quat q attitude orientation rot e ep",
                   ("w x y z", "0 1 2 3", "1 2 3 4", "r i j k")),
    "matrix": ("matrix rotation rot r m dcm rotationmatrix rmat",
               ("11 12 13 21 22 23 31 32 33", "00 01 02 10 11 12 20 21 22")),
    "axis": ("axis e n d u com cm cog pos position tip apex director symmetryaxis bodyaxis achse "
             "axe schwerpunkt center centre centreofmass centerofmass", ("x y z", "1 2 3")),
    "omega": ("omega w om angvel angularvelocity angularrate winkelgeschwindigkeit gyro",
              ("x y z", "1 2 3")),
    "momentum": ("l angmom angularmomentum momentum drehimpuls h", ("x y z", "1 2 3")),
    "vertical": ("gamma vertical poisson gam", ("x y z", "1 2 3")),
}  # fmt: skip
_BARE_HEADER: Final = {"quaternion": "wxyz", "axis": "xyz"}  # components that may stand alone
_BODY: Final = {"body", "b", "local", "corps", "koerper", "korper", "bf", "rotor", "fixed"}
_SPACE: Final = {"space", "world", "inertial", "global", "lab", "spatial", "s"}
_NOISE: Final = {"t", "angle", "winkel", "angulo", "angolo", "euler", "sim", "of", "the", "in"}
_LETTERS: Final = {
    "θ": "theta", "ϑ": "theta", "φ": "phi", "ϕ": "phi", "ψ": "psi", "ω": "omega", "Ω": "omega",
    "χ": "chi", "γ": "gamma", "α": "alpha", "β": "beta", "Δ": "delta ", "δ": "delta ",
    "∂": "delta ", "\u0307": "dot", "′": " prime ", "'": " prime ", "ß": "ss",
}  # fmt: skip
# A name, and its unit in brackets, or behind a comma, a blank, "in" or a stroke.
_IN_BRACKETS: Final = re.compile(r"(.+?)\s*[\[(]([^\])]*)[\])]?\s*")
_BEHIND: Final = re.compile(r"(.+?)(?:\s*,\s*|\s+in\s+|\s+|\s*/\s*(?!dt))(\S+)")


class Unit(NamedTuple):
    """A unit: what it measures (angle, rate, time, length), its size in SI units, its text.

    In rows of `HEADER_UNITS` the text lists its spellings. Data in the unit follow a convention, if
    that has a name; its sentence says so.
    """

    kind: str
    factor: float
    text: str
    convention: str = ""
    sentence: str = "{}"


HEADER_UNITS: Final = (
    Unit("angle", 1.0, "rad radian radians 1"),
    Unit("angle", np.pi / 180, "deg degree degrees grad grados gradi degre", "degrees",
         "{} are in degrees"),
    Unit("angle", 1e-3, "mrad"),
    Unit("angle", np.pi / 200, "gon"),
    Unit("angle", 2 * np.pi, "rev revs turn turns tr u cycles"),
    Unit("rate", 1.0, "s-1 sec-1"),
    Unit("rate", np.pi / 30, "rpm upm 1/min min-1", "rpm", "{} in turns a minute"),
    Unit("rate", 2 * np.pi, "hz rps"),
    Unit("rate", np.pi / 180, "dps"),
    Unit("time", 1.0, "s sec secs second seconds sek sekunden"),
    Unit("time", 1e-3, "ms msec millisecond milliseconds millis", "milliseconds"),
    Unit("time", 60.0, "min minute minutes", "minutes"),
    Unit("time", 3600.0, "h hour hours", "hours"),
    Unit("time", 1e-6, "us usec microsecond microseconds"),
    Unit("time", 1e-9, "ns nanosecond nanoseconds"),
    Unit("length", 1.0, "m mm cm km um in ft 1 -"),  # lengths are divided by their first one
)  # fmt: skip
_SIZES: Final = {(x.kind, word): x.factor for x in HEADER_UNITS for word in x.text.split()}
# The convention of a unit of angles is also that of angles a second.
_DECLARED: Final = {(x.kind == "time", x.factor): x.convention for x in reversed(HEADER_UNITS)}


class Meaning(NamedTuple):
    """The meaning of a header: a quantity, one of its components, and the unit if it has one."""

    quantity: str
    component: str
    unit: Unit | None


def parse_unit(text: str, quantity: str = "") -> Unit | None:
    """The unit of a spelling; None where it is none, or none that the quantity may have."""
    plain = unicodedata.normalize("NFKD", re.sub("[°º]", "deg", text.lower()).replace("⁻¹", "-1"))
    plain = re.sub(r"\s|\^|[(){}]|[\u0300-\u036f]", "", plain).replace("μ", "u").replace("per", "/")
    plain = re.sub(r"(?<=.)[*·._]?(s|sec|min|ms)(-1|1)$", r"/\1", plain)
    over, _, below = plain.replace("_", "/").partition("/")
    for kind in _kinds(quantity):
        factor = _SIZES.get((kind, plain))
        if not factor and kind == "rate" and {("angle", over), ("time", below)} <= _SIZES.keys():
            factor = _SIZES["angle", over] / _SIZES["time", below]
        if factor:
            return Unit(kind, factor, text, _DECLARED.get((kind == "time", factor), ""))
    return None


def _kinds(quantity: str) -> tuple[str, ...]:
    """The kinds of units of a quantity; an angle with a unit of a rate is read as its rate."""
    if quantity == "t":
        return ("time",)
    if quantity in _ANGLE_NAMES or quantity.startswith("omega") or quantity.endswith("dot"):
        return ("rate", "angle")
    return ("length",) if quantity in _VECTORS else ("rate", "angle", "time", "length")


def meanings(header: str, unit: str = "") -> list[Meaning]:
    """The meanings that a header may have, the likeliest first; empty where it has none."""
    name = header
    if not unit and (found := _IN_BRACKETS.fullmatch(header)):
        name, unit = found[1], "" if found[2].strip() in ("t", "τ") else found[2]
    elif not unit and (found := _BEHIND.fullmatch(header)) and parse_unit(found[2]):
        name, unit = found[1], found[2]
    words = _words(name)
    tries = [(words, unit)]
    if not unit:  # theta_deg, omega_x_rad_s, phidot_deg_per_s
        splits = (len(words) - many for many in (1, 2, 3) if len(words) > many)
        tries += [(words[:k], "/".join(x for x in words[k:] if x != "per")) for k in splits]
    return next((each for some, spelled in tries if (each := [*_word_meanings(some, spelled)])), [])


def _words(name: str) -> list[str]:
    """The words of a name, in lower case and plain letters: thetadot and max of ``θ̇_max``."""
    text = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name.strip())
    text = re.sub("(?<=[\u0370-\u03ff])\u0308", " ddot", unicodedata.normalize("NFKD", text))
    text = "".join(_LETTERS.get(letter, letter) for letter in text).lower()
    text = re.sub(r"[\u0300-\u036f]", "", text)
    return re.findall(r"[a-z0-9]+", re.sub(r"\b(w|omega|om)b(?![a-z])", r"\1 body ", text))


def _word_meanings(words: list[str], unit: str) -> Iterator[Meaning]:
    """Yield the meanings of words; a unit has to be one that the meaning may have."""
    frame = next((word for word in words if word in _BODY | _SPACE), "")
    short = [word for word in words if word not in _NOISE]
    framed = [word for word in short if word != frame]
    for key in dict.fromkeys("".join(x) for x in (words, short, framed) if x):
        for quantity, component in _USUAL.get(key, ()):
            parsed = parse_unit(unit, quantity) if unit else None
            if unit and not parsed:
                continue
            if parsed and parsed.kind == "rate" and quantity in _ANGLE_NAMES:
                quantity += "dot"  # as of ``spin [rpm]``
            body = frame in _BODY or (not frame and component.isdigit())
            if quantity in ("omega", "momentum") and body:
                quantity += "_body"
            yield Meaning(quantity, component, parsed)


def complete_set(quantity: str, components: Collection[str]) -> tuple[str, ...]:
    """The names of a complete set of components, in order; empty where no set is complete."""
    if "" in components:
        return ("",)
    _, spelled = _VECTORS.get(quantity.removesuffix("_body"), ("", ()))
    sets = [tuple(each.split()) for each in spelled]
    order = sets[::-1] if "00" in components else sets
    return next((each for each in order if {*components} >= {*each}), ())


def _usual_names() -> Iterator[tuple[str, str, str]]:
    """Yield every usual name, with a quantity and a component that it may stand for."""
    for name in _TIMES.split():
        yield name, "t", ""
    for quantity, names in _ANGLE_NAMES.items():
        for name in names.split():
            yield name, quantity, ""
            yield from ((rate, f"{quantity}dot", "") for rate in _SPEEDS.format(name).split())
    for quantity, (names, sets) in _VECTORS.items():
        components = dict.fromkeys(" ".join(sets).split())
        for name in names.split():
            if len(name) > 1 or name == "q":
                yield name, quantity, ""
            for component in components:
                if (name, component) != ("e", "4"):
                    yield name + component, quantity, component
                    yield component + name, quantity, component
        yield from ((x, quantity, x) for x in _BARE_HEADER.get(quantity, ""))


_USUAL: Final = defaultdict[str, list[tuple[str, str]]](list)
for _name, _quantity, _component in _usual_names():
    _USUAL[_name].append((_quantity, _component))


# --- the number of digits that numbers are written with ------------------------------------------


MOST_WRITTEN: Final = 12  # digits: rounding to more digits is not looked for
FINE: Final = 2000.0  # roundings between times: with so many digits nobody chooses times


def grain_of(x: Array) -> Array:
    """Half a unit in the last digit of numbers; 0 where all digits of doubles are written."""
    x = np.where(np.isfinite(x), x, 0.0)
    digits, size, grain = np.arange(MOST_WRITTEN), abs(x), np.zeros_like(x)
    decades = np.floor(np.log10(np.where(size > 0, size, 1.0)))
    with np.errstate(over="ignore", invalid="ignore"):  # too large or small numbers fit nothing
        for short in (size.astype(np.float16), size.astype(np.float32)):
            if (short == size).all() and not grain.any():
                grain = np.spacing(short).astype(np.float64) / 2
        for units in (-digits, np.add.outer(-digits, decades)):  # as %.3f and as %.3e write
            fitting = (10.0**unit for unit in units if _fits(x, size, unit))
            grain = np.maximum(grain, next(fitting, 0.0) / 2)
    return np.asarray(grain * (np.ptp(x, axis=0) > 0))  # a constant column is not rounded


def _fits(x: Array, size: Array, unit: Any) -> bool:
    """Whether numbers are whole multiples of 10^unit."""
    off = abs(np.rint(x * 10.0**-unit) * 10.0**unit - x)
    return bool((off <= 8 * UNIT * size).all())


def is_rounded(t: Array, grain: Array) -> bool:
    """Whether times are rounded numbers, and not exact ones that somebody chose.

    Steps of rounded times are not multiples of the least step, as they are where rows of an even
    grid are missing; and the times are evenly spaced but for rounding, or have many digits.
    """
    steps, least = abs(np.diff(t)), 16 * UNIT * abs(t).max()
    unit = min(steps[steps > least], default=np.nan)
    if not (abs(steps - np.rint(steps / unit) * unit) > least).any():
        return False
    fine = grain.max() < 0.5 and np.median(steps) > FINE * grain.max()
    even = np.linspace(t[0], t[-1], t.size)
    return bool(fine or (abs(t - even) <= 2 * grain + least).all())
