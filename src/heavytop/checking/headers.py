"""Column headers: the quantity, component and unit that a name such as ``tilt_deg`` stands for."""

from __future__ import annotations

import re
import unicodedata
from collections import defaultdict
from collections.abc import Iterator, Mapping
from typing import Final, NamedTuple

import numpy as np

_ANGLES: Final = {
    "theta": "theta tilt nutation nut beta inclination inclinaison inklination neigung polar "
    "colatitude tiltangle kippwinkel",
    "phi": "phi precession prec praezession prazession azimuth azimut azimutal acimut alpha "
    "precesion precessione heading",
    "psi": "psi spin chi rotation eigenrotation eigendrehung rotationpropre rotacion rotazione "
    "roll gamma",
    "elevation": "elevation elev altitude elevacion elevazione hohenwinkel hoehenwinkel",
}
_TIMES: Final = "t time zeit temps tiempo tempo tid timestamp times clock"
_RATES: Final = "{0}dot d{0} d{0}dt {0}d {0}rate {0}velocity {0}speed {0}punkt {0}geschwindigkeit"
_NINE: Final = tuple(f"{i}{j}" for i in "123" for j in "123")
_ZERO: Final = tuple(f"{i}{j}" for i in "012" for j in "012")
_XYZ: Final = (tuple("xyz"), tuple("123"))
# Of vectors: the names, and those of the components, of which one set has to be complete.
_VECTORS: Final[Mapping[str, tuple[str, tuple[tuple[str, ...], ...]]]] = {
    "quaternion": ("quaternion quat q attitude orientation rot e ep",
                   (tuple("wxyz"), tuple("0123"), tuple("1234"), tuple("rijk"))),
    "matrix": ("matrix rotation rot r m dcm rotationmatrix rmat", (_NINE, _ZERO)),
    "axis": ("axis e n d u com cm cog pos position tip apex director symmetryaxis bodyaxis achse "
             "axe schwerpunkt center centre centreofmass centerofmass", _XYZ),
    "omega": ("omega w om angvel angularvelocity angularrate winkelgeschwindigkeit gyro", _XYZ),
    "momentum": ("l angmom angularmomentum momentum drehimpuls h", _XYZ),
    "vertical": ("gamma vertical poisson gam", _XYZ),
}  # fmt: skip
QUANTITY_SHAPES: Final = {"quaternion": (4,), "matrix": (3, 3)} | dict.fromkeys(
    ("axis", "omega", "omega_body", "momentum", "momentum_body", "vertical"), (3,)
)
_BODY: Final = {"body", "b", "local", "corps", "koerper", "korper", "bf", "rotor", "fixed"}
_SPACE: Final = {"space", "world", "inertial", "global", "lab", "spatial", "s"}
_NOISE: Final = {"t", "angle", "winkel", "angulo", "angolo", "euler", "sim", "of", "the", "in"}
_LETTERS: Final = {
    "θ": "theta", "ϑ": "theta", "φ": "phi", "ϕ": "phi", "ψ": "psi", "ω": "omega", "Ω": "omega",
    "χ": "chi", "γ": "gamma", "α": "alpha", "β": "beta", "Δ": "delta ", "δ": "delta ",
    "∂": "delta ", "\u0307": "dot", "′": " prime ", "'": " prime ", "ß": "ss",
}  # fmt: skip

_NUMERATORS: Final = {
    **dict.fromkeys(("rad", "radian", "radians", "1", ""), 1.0),
    **dict.fromkeys(("deg", "degree", "degrees", "grad", "grados", "gradi", "degre"), np.pi / 180),
    **dict.fromkeys(("rev", "revs", "turn", "turns", "tr", "u", "cycles", "upm"), 2 * np.pi),
    "mrad": 1e-3,
    "gon": np.pi / 200,
}
_TIME_UNITS: Final = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds", "sek", "sekunden"), 1.0),
    **dict.fromkeys(("ms", "msec", "millisecond", "milliseconds", "millis"), 1e-3),
    **dict.fromkeys(("us", "usec", "microsecond", "microseconds"), 1e-6),
    **dict.fromkeys(("ns", "nanosecond", "nanoseconds"), 1e-9),
    **dict.fromkeys(("min", "minute", "minutes"), 60.0),
    **dict.fromkeys(("h", "hour", "hours"), 3600.0),
}
_SINGLE: Final = {"rpm": "rev/min", "upm": "rev/min", "hz": "rev/s", "dps": "deg/s", "rps": "rev/s"}
_LENGTHS: Final = {"m", "mm", "cm", "km", "um", "in", "ft", "1", "-", ""}


class Unit(NamedTuple):
    """A unit: what it measures (angle, rate, time, length), its size in SI units, its text."""

    kind: str
    factor: float
    text: str


class Meaning(NamedTuple):
    """What a header stands for: a quantity, one of its components, and the unit if there is one."""

    quantity: str
    component: str
    unit: Unit | None


def parse_unit(text: str, quantity: str = "") -> Unit | None:
    """A unit as people spell it; None where it is none of those of an angle, rate, time, length."""
    plain = text.lower().replace("°", "deg").replace("º", "deg").replace("μ", "u")
    plain = unicodedata.normalize("NFKD", plain.replace("µ", "u").replace("⁻¹", "-1"))
    plain = re.sub(r"\s|\^|[()]|[\u0300-\u036f]", "", plain).replace("per", "/")
    plain = re.sub(r"[*·._]?(s|sec|min|ms)(-1|1)$", r"/\1", _SINGLE.get(plain, plain))
    over, slash, below = plain.replace("_", "/").partition("/")
    if quantity == "t" or (not slash and over in _TIME_UNITS and over not in _NUMERATORS):
        return Unit("time", _TIME_UNITS[over], text) if over in _TIME_UNITS else None
    if slash and over in _NUMERATORS and below in _TIME_UNITS:
        return Unit("rate", _NUMERATORS[over] / _TIME_UNITS[below], text)
    if quantity in ("axis", "vertical", "quaternion", "matrix") and plain in _LENGTHS:
        return Unit("length", 1.0, text)
    if not slash and over in _NUMERATORS and over:
        return Unit("angle", _NUMERATORS[over], text)
    return Unit("length", 1.0, text) if plain in _LENGTHS else None


def meanings(header: str) -> list[Meaning]:
    """What a header may stand for, the likeliest first; empty where it is not understood."""
    name, unit = header, ""
    if found := re.fullmatch(r"(.+?)\s*[\[(]([^\])]*)[\])]?\s*", header):
        name, unit = found[1], "" if found[2].strip() in ("t", "τ") else found[2]
    elif found := re.fullmatch(r"(.+?)(?:\s*,\s*|\s+in\s+|\s+|\s*/\s*(?!dt))(\S+)", header):
        name, unit = (found[1], found[2]) if parse_unit(found[2]) else (header, "")
    words = [*_words(name)]
    tries = [(words, unit)]
    if not unit:  # theta_deg, omega_x_rad_s, phidot_deg_per_s
        tries += [
            (words[:-many], "/".join(word for word in words[-many:] if word != "per"))
            for many in (1, 2, 3)
            if len(words) > many
        ]
    return next((each for some, spelled in tries if (each := [*_named(some, spelled)])), [])


def _words(name: str) -> Iterator[str]:
    """The words of a name, in lower case and plain letters: ``θ̇_max`` is thetadot, max."""
    text = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name.strip())
    text = re.sub("(?<=[\u0370-\u03ff])\u0308", " ddot", unicodedata.normalize("NFKD", text))
    text = "".join(_LETTERS.get(letter, letter) for letter in text).lower()
    text = re.sub(r"[\u0300-\u036f]", "", text)
    yield from re.findall(r"[a-z0-9]+", re.sub(r"\b(w|omega|om)b(?![a-z])", r"\1 body ", text))


def _named(words: list[str], unit: str) -> Iterator[Meaning]:
    """The meanings of words, with a unit that has to be one of theirs."""
    frame = next((word for word in words if word in _BODY | _SPACE), "")
    short = [word for word in words if word not in _NOISE]
    framed = [word for word in short if word != frame]
    for key in dict.fromkeys("".join(x) for x in (words, short, framed) if x):
        for quantity, component in _USUAL.get(key, ()):
            full = quantity
            if quantity in ("omega", "momentum") and (frame in _BODY or not frame):
                full += "_body" * (bool(frame) or component.isdigit())
            parsed = parse_unit(unit, quantity) if unit else None
            if parsed and parsed.kind == "rate" and f"{quantity}dot" in _USUAL:
                full = f"{quantity}dot"  # as of ``spin [rpm]``
            elif unit and not (parsed and _fits(parsed, full)):
                continue
            yield Meaning(full, component, parsed)


def _fits(unit: Unit, quantity: str) -> bool:
    """Whether a quantity can have the unit."""
    if quantity in ("t", *_ANGLES):
        return unit.kind == ("time" if quantity == "t" else "angle")
    if quantity.startswith("omega") or quantity.endswith("dot"):
        return unit.kind in ("rate", "angle")
    return unit.kind == "length" or quantity.startswith("momentum")


def _table() -> dict[str, list[tuple[str, str]]]:
    """Every usual name with the quantities and the components that it may stand for."""
    table = defaultdict[str, list[tuple[str, str]]](list)
    for quantity, (names, sets) in _VECTORS.items():
        for name in names.split():
            if len(name) > 1 or name == "q":
                table[name].append((quantity, ""))
            for component in dict.fromkeys(c for each in sets for c in each):
                if (name, component) == ("e", "4"):
                    continue
                for key in dict.fromkeys((name + component, component + name)):
                    table[key].append((quantity, component))
    for component in "wxyz":
        table[component].append(("quaternion", component))
    for component in "xyz":
        table[component].append(("axis", component))
    for quantity, names in ({"t": _TIMES} | _ANGLES).items():
        for name in names.split():
            table[name].insert(0, (quantity, ""))
            for rate in _RATES.format(name).split() if quantity != "t" else ():
                table[rate].insert(0, (f"{quantity}dot", ""))
    return dict(table)


_USUAL: Final = _table()


def complete_set(quantity: str, components: set[str]) -> tuple[str, ...]:
    """The names of the components in their order, where one set of them is complete; else empty."""
    sets = _VECTORS[quantity.removesuffix("_body")][1]
    if "00" in components:
        sets = sets[::-1]
    return next((each for each in sets if components >= {*each}), ())
