"""The ways to say how a top starts, and the Euler angles and rates that each of them means.

A way takes one name out of each of its slots. All of it is exact: an angle that follows from a
rotation or from constants is the arccosine of an exact number.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, Final

from heavytop.errors import ImpossibleStart, Refused
from heavytop.exact import ONE, PI, Exact, acos, cos, sin, sqrt
from heavytop.exact.number import ZERO
from heavytop.scene import arguments
from heavytop.scene.arguments import Numbers, Reader, Way, exact_numbers, one_of, only, short
from heavytop.scene.quantities import ANGLES, PLAIN_NUMBER, QUANTITY_READERS, RATES
from heavytop.scene.top import Top

Values = Mapping[str, Any]

BRANCHES: Final = ("falling", "rising", "forward", "backward")
OPPOSITE: Final = {"falling": "rising", "rising": "falling"}
ATTITUDE: Final = ("theta", "quaternion", "rotation")
_FIELDS: Final = ("theta", "thetadot", "phi", "phidot", "psi")
_ENERGIES: Final = ("E", "E_prime")
_MOMENTA: Final = ("p_phi", "p_psi")
_SPINS: Final = ("psidot", "omega3")
_PLACED: Final = ("quaternion", "rotation")
_PHI_PSI: Final = ((*_PLACED, "phi"), (*_PLACED, "psi"))
_DEGREES: Final = range(4, 361)  # a θ that is one of these was hardly meant in radians
_NEARLY: Final = 1e-6  # so far a rotation may be from a rotation


def read_start(given: Mapping[str, object], top: Top | None) -> dict[str, Any]:
    """Return the fields of the `State` that a start says, in any of its ways.

    Raises
    ------
    ImpossibleStart
        No motion has what is given, or it is not that of a way.
    """
    way = _way_of(given)
    given = exact_numbers(ImpossibleStart, way, _complete(way, given), START_READERS)
    if way not in (ANGLE_RATES, OMEGA) and not isinstance(top, Top):
        raise ImpossibleStart([(WITHOUT_TOP, "a Top, from which this start follows")])
    values, notice = _fold(given)
    if {*_PLACED} & given.keys():
        values = {**values, **_attitude(values)}
    found = {**dict.fromkeys(_FIELDS, ZERO), **values, **way.make(values, top)}
    fields = {name: found[name] for name in (*_FIELDS, "held", "spin")}
    return fields | {"given": tuple(given.items()), "notices": (notice,) * bool(notice)}


def _way_of(given: Values) -> Way:
    """The way that the names of a start begin."""
    if "steady" in given:
        return SPIN_OF_STEADY if given["steady"] is True else STEADY_START
    if {*_ENERGIES, *_MOMENTA} & given.keys():
        return CONSTANTS_START
    return OMEGA if {"omega_body", "omega_space"} & given.keys() else ANGLE_RATES


def _complete(way: Way, given: Values) -> Values:
    """A start with what is left out and is 0: rates, and θ̇ where no energy gives it."""
    if way is ANGLE_RATES:
        names = ("thetadot", "phidot") if {*_PLACED} & given.keys() else _FIELDS
        spin = {} if {*_SPINS} & given.keys() else {"psidot": ZERO}
        return {**dict.fromkeys(names, ZERO), **given, **spin}
    still = way is CONSTANTS_START and not {*_ENERGIES} & given.keys()
    return {"thetadot": ZERO, **given} if still else given


def _fold(given: Values) -> tuple[Values, str]:
    """The same start with θ in [0, π], and what is said of that."""
    theta = given.get("theta", ZERO)
    q = theta.fraction
    if q is not None and 0 <= q.numerator <= 3 * q.denominator:  # as nearly all are
        return given, ""
    around = theta
    while turns := round(float(around) / (2 * math.pi)):  # of many turns the number is rounded
        around -= 2 * PI * turns
    if around.sign() == -1:
        around += 2 * PI
    beyond = (PI - around).sign() == -1
    tilt = 2 * PI - around if beyond else around
    if (theta - tilt).sign() == 0:
        return given, ""
    values, turned = {**given, "theta": tilt}, ""
    if beyond:
        turned = ", with phi + pi, psi + pi and -thetadot"
        values |= {name: values.get(name, ZERO) + PI for name in ("phi", "psi")}
        if "thetadot" in values:
            values["thetadot"] = -values["thetadot"]
        if "branch" in values:
            values["branch"] = OPPOSITE.get(values["branch"], values["branch"])
    degrees = f'; {theta} degrees are "{theta} deg"' if theta in _DEGREES else ""
    same = f"theta = {theta} is outside [0, pi]: taken as {float(tilt):.6g}{turned}"
    return values, f"{same}, the same motion{degrees}"


# --- attitude and rates ----------------------------------------------------------------------


def _from_rates(values: Values, _: object) -> dict[str, Any]:
    held = "omega3" if "omega3" in values else "psidot"
    return {"held": held, "spin": values.get(held, ZERO)}


def _from_omega(values: Values, _: object) -> dict[str, Any]:
    """Rates by the angular velocity: θ̇ along the line of nodes, φ̇ sinθ across it, ω₃."""
    theta, phi, psi = (values.get(name, ZERO) for name in ("theta", "phi", "psi"))
    u, s = cos(theta), sin(theta)
    if "omega_body" in values:
        x, y, omega3 = values["omega_body"]
        along, across = x * cos(psi) - y * sin(psi), x * sin(psi) + y * cos(psi)
    else:
        x, y, z = values["omega_space"]
        along, level = x * cos(phi) + y * sin(phi), y * cos(phi) - x * sin(phi)
        across, omega3 = u * level + s * z, u * z - s * level
    rates = {"thetadot": along, "held": "omega3", "spin": omega3}
    if s.sign() != 0:
        return rates | {"phidot": across / s}
    if across.sign() == 0:
        return rates
    # on a pole the line of nodes is turned to where the axis goes
    speed = _length(along, across)
    turn = _angle(u * along / speed, u * across / speed)
    return rates | {"thetadot": u * speed, "phi": phi + u * turn, "psi": psi - turn}


def _attitude(values: Values) -> dict[str, Exact]:
    """Euler's angles, z-x-z; on the vertical a rotation is all φ."""
    w, x, y, z = values["quaternion"] if "quaternion" in values else _quaternion(values["rotation"])
    up, down = w**2 + z**2, x**2 + y**2
    if down.sign() == 0:
        return {"theta": ZERO, "phi": _angle((w**2 - z**2) / up, 2 * w * z / up), "psi": ZERO}
    if up.sign() == 0:
        return {"theta": PI, "phi": _angle((x**2 - y**2) / down, 2 * x * y / down), "psi": ZERO}
    root = _length(w, z) * _length(x, y)
    return {
        "theta": acos((up - down) / (up + down)),
        "phi": _angle((w * x - y * z) / root, (x * z + w * y) / root),
        "psi": _angle((w * x + y * z) / root, (x * z - w * y) / root),
    }


def _length(a: Exact, b: Exact) -> Exact:
    """√(a² + b²), without a root where one of them is 0."""
    if a.sign() != 0 and b.sign() != 0:
        return sqrt(a**2 + b**2)
    return -(a + b) if (a + b).sign() == -1 else a + b


def _angle(cosine: Exact, sine: Exact) -> Exact:
    return -acos(cosine) if sine.sign() == -1 else acos(cosine)


def _quaternion(R: Sequence[Sequence[Exact]]) -> list[Exact]:
    """A quaternion of a rotation: exactly its own, or of a rounded one that of a near rotation."""
    (a, b, c), (d, e, f), (g, h, i) = R
    rows = (
        (ONE + a + e + i, h - f, c - g, d - b),
        (h - f, ONE + a - e - i, b + d, c + g),
        (c - g, b + d, ONE - a + e - i, f + h),
        (d - b, c + g, f + h, ONE - a - e + i),
    )
    return list(max(enumerate(rows), key=lambda row: float(row[1][row[0]]))[1])


# --- constants of the motion -----------------------------------------------------------------


def _from_constants(values: Values, top: Top) -> dict[str, Any]:
    """The start with four of E (or E′), p_φ, p_ψ (or ω₃), θ and θ̇."""
    x = {"p_psi": top.C * values["omega3"]} if "omega3" in values else {}
    x |= {name: values[name] for name in (*_MOMENTA, "theta", "thetadot") if name in values}
    if top.C.sign() == 0 and x.get("p_psi", ONE).sign() != 0:
        raise ImpossibleStart([("p_psi", "0 of a point mass (C = 0), which has no spin")])
    if {*_ENERGIES} & values.keys():
        (unknown,) = {*_MOMENTA, "theta", "thetadot"} - x.keys()
        x[unknown] = _theta(top, values, x) if unknown == "theta" else _root(top, values, x)
    spin = values.get("omega3", ZERO if top.C.sign() == 0 else x["p_psi"] / top.C)
    return x | {"phidot": _precession_rate(top, x), "held": "omega3", "spin": spin}


def _precession_rate(top: Top, x: Numbers) -> Exact:
    """φ̇ = (p_φ − p_ψ cosθ) / (A sin²θ), and at a pole its limit along the motion."""
    u, sin2 = cos(x["theta"]), sin(x["theta"]) ** 2
    across = x["p_phi"] - x["p_psi"] * u
    if sin2.sign() != 0:
        return across / (top.A * sin2)
    if across.sign() != 0:
        pole = "p_psi" if u == 1 else "-p_psi"
        where = f"equal to {pole} = {short(x['p_psi'] * u)} at this theta"
        raise ImpossibleStart([("p_phi", f"{where}: nothing else reaches the vertical")])
    return x["p_psi"] * u / (2 * top.A)


def _rest(top: Top, values: Values, x: Numbers) -> Exact:
    """The energy of θ̇, and of the spin where it counts, of those that are known."""
    turning = "E" in values and "p_psi" in x and top.C.sign() != 0
    spinning = x["p_psi"] ** 2 / (2 * top.C) if turning else ZERO
    return spinning + top.A * x.get("thetadot", ZERO) ** 2 / 2


def _too_low(values: Values, x: Numbers, least: Exact, more: str = "") -> ImpossibleStart:
    """What refuses an energy, with the least that there is and what these momenta are at rest."""
    where = f"at theta = {values['theta']}" if "theta" in values else "with these momenta"
    rest = ""
    if x.keys() >= {*_MOMENTA} and abs(float(x["p_phi"])) <= abs(float(x["p_psi"])) > 0:
        tilt = float(acos(x["p_phi"] / x["p_psi"]) * 180 / PI)
        rest = f"; these momenta at rest have theta = {tilt:.4g} deg"
    return ImpossibleStart([(_energy_of(values), f"at least {short(least)} {where}{more}{rest}")])


def _energy_of(values: Values) -> str:
    """Which of the two energies is given."""
    return "E" if "E" in values else "E_prime"


def _branch(values: Values, first: str, second: str) -> int:
    """1 or −1 by the branch, of two motions that fit."""
    branch = values.get("branch", first)
    if branch not in (first, second):
        raise ImpossibleStart([("branch", f'"{first}" or "{second}" here')])
    return 1 if branch == first else -1


def _root(top: Top, values: Values, x: Numbers) -> Exact:
    """Of p_φ, p_ψ and θ̇ the unknown one: the energy is least + (unknown − middle)² / square."""
    u, sin2 = cos(x["theta"]), sin(x["theta"]) ** 2
    least, middle = top.gMR * u + _rest(top, values, x), ZERO
    branches = "forward", "backward"
    if "thetadot" not in x:
        branches, square = ("falling", "rising"), 2 / top.A
        least += top.A * _precession_rate(top, x) ** 2 * sin2 / 2
    elif "p_phi" not in x:
        middle, square = x["p_psi"] * u, 2 * top.A * sin2
    else:
        across, along = top.A * sin2, ZERO if "E_prime" in values else 1 / top.C
        body = u**2 + across * along  # in that of θ̇ … of p_ψ
        if top.C.sign() == 0 or sin2.sign() == 0 or body.sign() == 0:
            raise ImpossibleStart([("p_psi", "missing: it does not follow here")])
        middle, square = x["p_phi"] * u / body, 2 * across / body
        least += x["p_phi"] ** 2 * along / (2 * body)
    excess = values[_energy_of(values)] - least
    if excess.sign() == -1 or (square.sign() == 0 and excess.sign() != 0):
        raise _too_low(values, x, least)
    return middle + _branch(values, *branches) * sqrt(excess * square)


def _theta(top: Top, values: Values, x: Numbers) -> Exact:
    """The root of a cubic equation in cosθ between which and another the axis nods."""
    rest = _rest(top, values, x)
    free, p_phi, p_psi = values[_energy_of(values)] - rest, x["p_phi"], x["p_psi"]
    roots = _real_roots(
        2 * top.A * top.gMR,
        -2 * top.A * free - p_psi**2,
        2 * p_phi * p_psi - 2 * top.A * top.gMR,
        2 * top.A * free - p_phi**2,
    )
    between = [u for u in roots if (ONE - u**2).sign() == 1]  # p_φ = ±p_ψ has a pole as a root
    if not between:
        least, at = _lowest(top, float(p_phi), float(p_psi))
        raise _too_low(values, x, Exact.of(least) + rest, f", which have it at theta = {at:.6g}")
    return acos(between[0 if _branch(values, "falling", "rising") == 1 else -1])


def _real_roots(a: Exact, b: Exact, c: Exact, d: Exact) -> list[Exact]:
    """The real roots of a cubic or quadratic equation that has as many, decreasing; else none."""
    if a.sign() == 0:
        inside = c**2 - 4 * b * d
        if b.sign() == 0 or inside.sign() == -1:
            return []
        root = sqrt(inside) * (b.sign() or 1)
        return [(root - c) / (2 * b), (-root - c) / (2 * b)]
    b, c, d = b / a, c / a, d / a
    p, q = c - b**2 / 3, 2 * b**3 / 27 - b * c / 3 + d
    if (4 * p**3 + 27 * q**2).sign() == 1:
        return []
    if p.sign() == 0:
        return [-b / 3]
    size = 2 * sqrt(-p / 3)
    third = acos(3 * q / (p * size)) / 3
    return [size * cos(third - 2 * PI * k / 3) - b / 3 for k in range(3)]


def _lowest(top: Top, p_phi: float, p_psi: float) -> tuple[float, float]:
    """The least energy, without that of the spin and of θ̇, and its θ, by trisection."""
    A, gMR = float(top.A), float(top.gMR)

    def height(theta: float) -> float:
        u = math.cos(theta)
        return gMR * u + ((p_phi - p_psi * u) / math.sin(theta)) ** 2 / (2 * A)

    low, high = 1e-9, math.pi - 1e-9
    for _ in range(120):
        left, right = (2 * low + high) / 3, (low + 2 * high) / 3
        low, high = (low, right) if height(left) < height(right) else (left, high)
    return height(low), low


# --- steady precession -----------------------------------------------------------------------


def _steady(values: Values, top: Top) -> dict[str, Any]:
    """A cosθ Ω² − p_ψ Ω + gMR = 0; with ψ̇ given in place of ω₃ it has A − C in place of A.

    The slow rate is taken from its partner, which neither cancels nor divides by cosθ.
    """
    held = "omega3" if "omega3" in values else "psidot"
    p_psi = top.C * values[held]
    square = (top.A if held == "omega3" else top.A - top.C) * cos(values["theta"])
    discriminant = p_psi**2 - 4 * square * top.gMR
    if discriminant.sign() == -1:
        if top.C.sign() == 0:
            raise ImpossibleStart([("theta", "beyond pi/2: no spin holds up a point mass (C = 0)")])
        least = 2 * sqrt(square * top.gMR) / top.C
        raise ImpossibleStart([(held, f"at least {short(least)} in magnitude at this theta")])
    root = sqrt(discriminant)
    larger = p_psi - root if p_psi.sign() == -1 else p_psi + root  # no cancellation
    fast = values["steady"] == "fast"
    if fast and square.sign() == 0:
        why = "at theta = pi/2" if held == "omega3" else "here"
        raise ImpossibleStart([("steady", f'"slow" {why}: there is no fast rate')])
    light = top.gMR.sign() == 0
    if not (fast or light) and larger.sign() == 0:
        raise ImpossibleStart([(held, "not 0 at this theta")])
    slow = ZERO if fast or light else 2 * top.gMR / larger
    return {"phidot": larger / (2 * square) if fast else slow, "held": held, "spin": values[held]}


def _spin_of_steady(values: Values, top: Top) -> dict[str, Any]:
    """ω₃ = (A cosθ φ̇² + gMR) / C φ̇."""
    rate = values["phidot"]
    if (top.C * rate).sign() == 0:
        raise ImpossibleStart([("phidot", "not 0, of a top that has C > 0: no spin holds it")])
    spin = (top.A * cos(values["theta"]) * rate**2 + top.gMR) / (top.C * rate)
    return {"held": "omega3", "spin": spin}


# --- the ways, and what reads their values ---------------------------------------------------

ANGLE_RATES: Final = Way(
    "angles and rates",
    (),
    _from_rates,
    (ATTITUDE, ("thetadot",), ("phidot",), _SPINS, *_PHI_PSI),
)
OMEGA: Final = Way(
    "an angular velocity", (ATTITUDE, ("omega_body", "omega_space")), _from_omega, _PHI_PSI
)
CONSTANTS_START: Final = Way(
    "constants of the motion",
    (_ENERGIES, ("p_phi",), ("p_psi", "omega3"), ("theta",), ("thetadot",)),
    _from_constants, (("branch",), ("phi",), ("psi",)), needed=4,
)  # fmt: skip
STEADY_START: Final = Way(
    "a steady start", (("steady",), ("theta",), _SPINS[::-1]), _steady, (("phi",), ("psi",))
)
SPIN_OF_STEADY: Final = STEADY_START._replace(
    slots=(("steady",), ("theta",), ("phidot",)), make=_spin_of_steady
)
WITHOUT_TOP: Final = "top"
"""What is named where a start follows from what spins, and that is not known."""


def _steadiness(value: object) -> object:
    return value is True or one_of({"slow": "slow", "fast": "fast"})(value)


def _vector(read: Reader, count: int, value: Any, rule: str = "") -> tuple[Any, ...]:
    if len(given := arguments.items_of(value) or ()) != count:
        raise Refused(rule or f"{count} numbers in a list")
    return tuple(map(read, given))


def _rotation_given(value: object) -> tuple[tuple[Exact, ...], ...]:
    import numpy as np  # as few scenes need

    R = _vector(partial(_vector, PLAIN_NUMBER, 3), 3, value, "three rows of three numbers")
    rows = np.array(R, dtype=float)
    if (off := np.abs(rows @ rows.T - np.eye(3)).max()) > _NEARLY:
        within = f"to {_NEARLY:g}, and these are {off:.1g} off"
        raise Refused(f"a rotation: rows of length 1, at right angles, {within}")
    if np.linalg.det(rows) < 0:
        raise Refused("a rotation, and no reflection")
    return R


START_READERS: Final[dict[str, Reader]] = {
    **{name: QUANTITY_READERS[name] for name in (*ANGLES, *RATES, "omega3", *_ENERGIES, *_MOMENTA)},
    "quaternion": only(
        partial(_vector, PLAIN_NUMBER, 4), lambda q: any(x.sign() != 0 for x in q), "not all zero"
    ),
    "rotation": _rotation_given,
    **dict.fromkeys(("omega_body", "omega_space"), partial(_vector, QUANTITY_READERS["omega3"], 3)),
    "branch": one_of({name: name for name in BRANCHES}),
    "steady": _steadiness,
}
"""What reads each value of a start."""
