"""Starts: the Euler angles and rates that the keys of a start determine.

A start is given by angles and rates, by an angular velocity, by constants of the motion, or as
steady precession. All numbers are exact: an angle that follows from a rotation or from constants
is the arccosine of an exact number.
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
from heavytop.scene.arguments import Numbers, Reader, Way, exact_numbers, one_of, short_text
from heavytop.scene.quantities import ANGLES, PLAIN_NUMBER, QUANTITY_READERS, RATES
from heavytop.scene.top import Top
from heavytop.text import nearest

Values = Mapping[str, Any]

BRANCHES: Final = ("falling", "rising", "forward", "backward")
OPPOSITE: Final = {"falling": "rising", "rising": "falling"}
ATTITUDE: Final = ("theta", "quaternion", "rotation")
_FIELDS: Final = ("theta", "thetadot", "phi", "phidot", "psi")
_ENERGIES: Final = ("E", "E_prime")
_MOMENTA: Final = ("p_phi", "p_psi")
_SPINS: Final = ("psidot", "omega3")
_ROTATIONS: Final = ("quaternion", "rotation")
_PHI_PSI: Final = ((*_ROTATIONS, "phi"), (*_ROTATIONS, "psi"))
_DEGREES: Final = range(4, 361)  # a θ that is one of these was hardly meant in radians
_ROTATION_ERROR: Final = 1e-6  # by which R Rᵀ may differ from 1


def read_start(given: Mapping[str, object], top: Top | None) -> dict[str, Any]:
    """Return the fields of the `State` that the keys of a start determine.

    Raises
    ------
    ImpossibleStart
        No motion has these values, or the keys do not determine a start.
    """
    way = _way_of(given)
    given = exact_numbers(ImpossibleStart, way, _complete(way, given), START_READERS)
    if way not in (ANGLE_RATES, OMEGA) and not isinstance(top, Top):
        raise ImpossibleStart([(WITHOUT_TOP, "a Top, from which this start follows")])
    values, notice = _fold(given)
    if {*_ROTATIONS} & given.keys():
        values = {**values, **_euler_angles(values)}
    found = {**dict.fromkeys(_FIELDS, ZERO), **values, **way.make(values, top)}
    fields = {name: found[name] for name in (*_FIELDS, "held", "spin")}
    return fields | {"given": tuple(given.items()), "notices": (notice,) * bool(notice)}


def _way_of(given: Values) -> Way:
    """The kind of start that some names belong to."""
    if "steady" in given:
        return SPIN_OF_STEADY if given["steady"] is True else STEADY_START
    if {*_ENERGIES, *_MOMENTA} & given.keys():
        return CONSTANTS_START
    return OMEGA if {"omega_body", "omega_space"} & given.keys() else ANGLE_RATES


def _complete(way: Way, given: Values) -> Values:
    """A start with 0 for the angles and rates that are left out, for θ̇ only without an energy."""
    if way is ANGLE_RATES:
        names = ("thetadot", "phidot") if {*_ROTATIONS} & given.keys() else _FIELDS
        spin = {} if {*_SPINS} & given.keys() else {"psidot": ZERO}
        return {**dict.fromkeys(names, ZERO), **given, **spin}
    at_rest = way is CONSTANTS_START and not {*_ENERGIES} & given.keys()
    return {"thetadot": ZERO, **given} if at_rest else given


def _fold(given: Values) -> tuple[Values, str]:
    """The same start with θ in [0, π], and the notice that says so; empty where θ was there."""
    theta = given.get("theta", ZERO)
    q = theta.fraction
    if q is not None and 0 <= q.numerator <= 3 * q.denominator:  # nearly all: no π is needed
        return given, ""
    reduced = theta
    while turns := round(float(reduced) / (2 * math.pi)):  # the count of many turns is rounded
        reduced -= 2 * PI * turns
    if reduced.sign() == -1:
        reduced += 2 * PI
    beyond = (PI - reduced).sign() == -1
    tilt = 2 * PI - reduced if beyond else reduced
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
    """The spin of a start with angles and rates, as ψ̇ or as ω₃."""
    held = "omega3" if "omega3" in values else "psidot"
    return {"held": held, "spin": values.get(held, ZERO)}


def _from_omega(values: Values, _: object) -> dict[str, Any]:
    """The rates of an angular velocity: θ̇ along the line of nodes, φ̇ sinθ across it, ω₃."""
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
    # on the vertical φ is free: the line of nodes is chosen so that the axis moves across it
    speed = _length(along, across)
    turn = _angle(u * along / speed, u * across / speed)
    return rates | {"thetadot": u * speed, "phi": phi + u * turn, "psi": psi - turn}


def _euler_angles(values: Values) -> dict[str, Exact]:
    """Euler's angles, z-x-z, of a quaternion or a rotation; on the vertical ψ = 0."""
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
    """√(a² + b²), exactly |a| or |b| where the other is 0."""
    if a.sign() != 0 and b.sign() != 0:
        return sqrt(a**2 + b**2)
    return -(a + b) if (a + b).sign() == -1 else a + b


def _angle(cosine: Exact, sine: Exact) -> Exact:
    """The angle in (−π, π] of a cosine and the sign of a sine."""
    return -acos(cosine) if sine.sign() == -1 else acos(cosine)


def _quaternion(R: Sequence[Sequence[Exact]]) -> list[Exact]:
    """A quaternion of a rotation matrix; of a rounded matrix that of a rotation near it."""
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
    """θ, θ̇, φ̇ and spin, by four of E (or E′), p_φ, p_ψ (or ω₃), θ and θ̇."""
    x = {"p_psi": top.C * values["omega3"]} if "omega3" in values else {}
    x |= {name: values[name] for name in (*_MOMENTA, "theta", "thetadot") if name in values}
    if top.C.sign() == 0 and x.get("p_psi", ONE).sign() != 0:
        raise ImpossibleStart([("p_psi", "0 of a point mass (C = 0), which has no spin")])
    if {*_ENERGIES} & values.keys():
        (unknown,) = {*_MOMENTA, "theta", "thetadot"} - x.keys()
        x[unknown] = (_solve_tilt if unknown == "theta" else _solve_quadratic)(top, values, x)
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
        where = f"equal to {pole} = {short_text(x['p_psi'] * u)} at this theta"
        raise ImpossibleStart([("p_phi", f"{where}: nothing else reaches the vertical")])
    return x["p_psi"] * u / (2 * top.A)


def _solve_quadratic(top: Top, values: Values, x: Numbers) -> Exact:
    """The unknown one of p_φ, p_ψ and θ̇: the energy is least + (unknown − middle)² / square."""
    u, sin2 = cos(x["theta"]), sin(x["theta"]) ** 2
    least, middle = top.gMR * u + _rate_energy(top, values, x), ZERO
    branches = "forward", "backward"
    if "thetadot" not in x:
        branches, square = ("falling", "rising"), 2 / top.A
        least += top.A * _precession_rate(top, x) ** 2 * sin2 / 2
    elif "p_phi" not in x:
        middle, square = x["p_psi"] * u, 2 * top.A * sin2
    else:
        across, along = top.A * sin2, ZERO if "E_prime" in values else 1 / top.C
        body = u**2 + across * along
        if top.C.sign() == 0 or sin2.sign() == 0 or body.sign() == 0:
            raise ImpossibleStart([("p_psi", "missing: it does not follow here")])
        middle, square = x["p_phi"] * u / body, 2 * across / body
        least += x["p_phi"] ** 2 * along / (2 * body)
    excess = values[_energy_name(values)] - least
    if excess.sign() == -1 or (square.sign() == 0 and excess.sign() != 0):
        raise _energy_error(values, x, least)
    return middle + _branch_sign(values, *branches) * sqrt(excess * square)


def _solve_tilt(top: Top, values: Values, x: Numbers) -> Exact:
    """The unknown θ, where θ̇ is given: its cosine is a root of a cubic in (−1, 1)."""
    known = _rate_energy(top, values, x)
    free, p_phi, p_psi = values[_energy_name(values)] - known, x["p_phi"], x["p_psi"]
    roots = _real_roots(
        2 * top.A * top.gMR,
        -2 * top.A * free - p_psi**2,
        2 * p_phi * p_psi - 2 * top.A * top.gMR,
        2 * top.A * free - p_phi**2,
    )
    between = [u for u in roots if (ONE - u**2).sign() == 1]  # p_φ = ±p_ψ has a pole as a root
    if not between:
        least, at = _least_energy(top, float(p_phi), float(p_psi))
        where = f", which have it at theta = {at:.6g}"
        raise _energy_error(values, x, Exact.of(least) + known, where)
    return acos(between[0 if _branch_sign(values, "falling", "rising") == 1 else -1])


def _rate_energy(top: Top, values: Values, x: Numbers) -> Exact:
    """The energy of a known θ̇, and that of a known spin where the energy that is given is E."""
    spins = "E" in values and "p_psi" in x and top.C.sign() != 0
    spin_energy = x["p_psi"] ** 2 / (2 * top.C) if spins else ZERO
    return spin_energy + top.A * x.get("thetadot", ZERO) ** 2 / 2


def _energy_name(values: Values) -> str:
    """Which of the two energies is given."""
    return "E" if "E" in values else "E_prime"


def _branch_sign(values: Values, first: str, second: str) -> int:
    """1 for the first of two branches, which is the default, −1 for the second."""
    branch = values.get("branch", first)
    if branch not in (first, second):
        raise ImpossibleStart([("branch", f'"{first}" or "{second}" here')])
    return 1 if branch == first else -1


def _energy_error(values: Values, x: Numbers, least: Exact, more: str = "") -> ImpossibleStart:
    """The error for too low an energy, with the least one and the tilt of these momenta at rest."""
    where = f"at theta = {values['theta']}" if "theta" in values else "with these momenta"
    rest = ""
    if x.keys() >= {*_MOMENTA} and abs(float(x["p_phi"])) <= abs(float(x["p_psi"])) > 0:
        tilt = float(acos(x["p_phi"] / x["p_psi"]) * 180 / PI)
        rest = f"; these momenta at rest have theta = {tilt:.4g} deg"
    rule = f"at least {short_text(least)} J {where}{more}{rest}"
    return ImpossibleStart([(_energy_name(values), rule)])


def _real_roots(a: Exact, b: Exact, c: Exact, d: Exact) -> list[Exact]:
    """The real roots, decreasing, of a cubic or quadratic with real roots alone; else no roots."""
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


def _least_energy(top: Top, p_phi: float, p_psi: float) -> tuple[float, float]:
    """The minimum of the effective potential without p_ψ²/2C, and its θ, by trisection."""
    A, gMR = float(top.A), float(top.gMR)

    def potential(theta: float) -> float:
        u = math.cos(theta)
        return gMR * u + ((p_phi - p_psi * u) / math.sin(theta)) ** 2 / (2 * A)

    low, high = 1e-9, math.pi - 1e-9
    for _ in range(120):
        left, right = (2 * low + high) / 3, (low + 2 * high) / 3
        low, high = (low, right) if potential(left) < potential(right) else (left, high)
    return potential(low), low


# --- steady precession -----------------------------------------------------------------------


def _from_steady(values: Values, top: Top) -> dict[str, Any]:
    """The rate Ω of a steady precession: A cosθ Ω² − p_ψ Ω + gMR = 0; with ψ̇ for ω₃, A − C for A.

    The slow rate is 2 gMR over the larger of p_ψ ± √…, which neither cancels nor divides by cosθ.
    """
    held = "omega3" if "omega3" in values else "psidot"
    p_psi = top.C * values[held]
    square = (top.A if held == "omega3" else top.A - top.C) * cos(values["theta"])
    discriminant = p_psi**2 - 4 * square * top.gMR
    if discriminant.sign() == -1:
        if top.C.sign() == 0:
            raise ImpossibleStart([("theta", "beyond pi/2: no spin holds up a point mass (C = 0)")])
        least = 2 * sqrt(square * top.gMR) / top.C
        rule = f"at least {short_text(least)} rad/s in magnitude at this theta"
        raise ImpossibleStart([(held, rule)])
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
    """The spin of a steady precession, ω₃ = (A cosθ φ̇² + gMR) / C φ̇."""
    rate = values["phidot"]
    if (top.C * rate).sign() == 0:
        raise ImpossibleStart([("phidot", "not 0, of a top that has C > 0: no spin holds it")])
    spin = (top.A * cos(values["theta"]) * rate**2 + top.gMR) / (top.C * rate)
    return {"held": "omega3", "spin": spin}


# --- the kinds of starts, and the readers of their values ------------------------------------

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
    "a steady start", (("steady",), ("theta",), _SPINS[::-1]), _from_steady, (("phi",), ("psi",))
)
SPIN_OF_STEADY: Final = STEADY_START._replace(
    slots=(("steady",), ("theta",), ("phidot",)), make=_spin_of_steady
)
WITHOUT_TOP: Final = "top"
"""The key of the fault where a start needs a top, and there is none."""


def _read_steady(value: object) -> object:
    """True, "slow" or "fast"."""
    if value is True or (isinstance(value, str) and value in ("slow", "fast")):
        return value
    raise Refused("true, or one of slow, fast", nearest(value, ("slow", "fast")))


def _vector(read: Reader, count: int, value: Any, rule: str = "") -> tuple[Any, ...]:
    """The items of a sequence of the right length, each as its reader makes it."""
    if len(items := arguments.items_of(value) or ()) != count:
        raise Refused(rule or f"{count} numbers in a list")
    return tuple(map(read, items))


def _read_rotation(value: object) -> tuple[tuple[Exact, ...], ...]:
    """The rows of a rotation matrix, which may be rounded."""
    import numpy as np  # slow to import, and few scenes need it

    R = _vector(partial(_vector, PLAIN_NUMBER, 3), 3, value, "three rows of three numbers")
    rows = np.array(R, dtype=float)
    if (off := np.abs(rows @ rows.T - np.eye(3)).max()) > _ROTATION_ERROR:
        within = f"to {_ROTATION_ERROR:g}, and these are {off:.1g} off"
        raise Refused(f"a rotation: rows of length 1, at right angles, {within}")
    if np.linalg.det(rows) < 0:
        raise Refused("a rotation, and no reflection")
    return R


START_READERS: Final[dict[str, Reader]] = {
    **{name: QUANTITY_READERS[name] for name in (*ANGLES, *RATES, "omega3", *_ENERGIES, *_MOMENTA)},
    "quaternion": arguments.restrict(
        partial(_vector, PLAIN_NUMBER, 4), lambda q: any(map(Exact.sign, q)), "not all zero"
    ),
    "rotation": _read_rotation,
    **dict.fromkeys(("omega_body", "omega_space"), partial(_vector, QUANTITY_READERS["omega3"], 3)),
    "branch": one_of({name: name for name in BRANCHES}),
    "steady": _read_steady,
}
"""The reader of each value of a start."""
