"""State: how a top starts.

Angles are Euler's, z-x-z: θ tilt, φ precession, ψ spin; ω3 = ψ̇ + φ̇ cosθ is the spin about the
body's own axis and p_ψ = C ω3.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, Final, Literal, TypeAlias, get_args

from heavytop.display import Shown
from heavytop.errors import ImpossibleStart
from heavytop.exact import PI, Exact, Number, cos, sin, sqrt
from heavytop.scene import arguments
from heavytop.scene.arguments import Wrong, as_call, exact_numbers, one_of, set_fields, short
from heavytop.scene.top import Top

_DEGREES = range(4, 181)  # a θ that is one of these was hardly meant in radians

Branch: TypeAlias = Literal["falling", "rising"]
Rate: TypeAlias = Literal["slow", "fast"]

START: Final[dict[str, arguments.Reader]] = {  # what a start may be made from
    **arguments.STATE,
    **dict.fromkeys(("E", "p_phi", "p_psi"), arguments.PLAIN),
    "branch": one_of({name: name for name in get_args(Branch)}),
    "steady": one_of({name: name for name in get_args(Rate)}),
}


@dataclass(frozen=True, slots=True, init=False, repr=False)
class State(Shown):
    """A start: Euler angles [rad] and their rates [rad/s], exact.

    Parameters
    ----------
    theta : number
        Tilt θ of the axis from the upward vertical, in [0, π].
    thetadot, phi, phidot, psi : number
        The other angles [rad] and rates [rad/s], by name.
    psidot, omega3 : number, optional
        The spin, as ψ̇ or as ω3 = ψ̇ + φ̇ cosθ [rad/s]; at most one of them. It says what a kick
        holds.

    Attributes
    ----------
    held : {"psidot", "omega3"}
        Which of the two was given.
    spin : Exact
        What was given of it.
    given : tuple of (str, Exact or str)
        The start as it was given: what a scene file says.

    Raises
    ------
    ImpossibleStart
        Some value is no number, θ is outside [0, π], or both psidot and omega3 are given.

    Examples
    --------
    >>> start = State(theta="pi/3", phidot=2, omega3=10)
    >>> print(start.psidot, start.held)
    9 omega3
    >>> start
    State(theta='pi/3', phidot='2', omega3='10')

    References
    ----------
    Sussman & Wisdom, *Structure and Interpretation of Classical Mechanics*, section 2.10.
    """

    theta: Exact
    thetadot: Exact
    phi: Exact
    phidot: Exact
    psi: Exact
    spin: Exact
    held: Literal["psidot", "omega3"]
    given: tuple[tuple[str, Exact | str], ...] = field(compare=False, repr=False)

    def __init__(
        self,
        theta: Number,
        *,
        thetadot: Number = 0,
        phi: Number = 0,
        phidot: Number = 0,
        psi: Number = 0,
        psidot: Number | None = None,
        omega3: Number | None = None,
    ) -> None:
        spins = {"psidot": psidot, "omega3": omega3}
        spin = {name: rate for name, rate in spins.items() if rate is not None} or {"psidot": 0}
        given = {"theta": theta, "thetadot": thetadot, "phi": phi, "phidot": phidot, "psi": psi}
        values = exact_numbers(ImpossibleStart, given | spin, broken_start, START)
        held, told = next(iter(spin)), tuple(values.items())
        set_fields(self, values | {"spin": values.pop(held), "held": held, "given": told})

    @property
    def psidot(self) -> Exact:
        """ψ̇ [rad/s]."""
        return self.spin if self.held == "psidot" else self.spin - self.phidot * cos(self.theta)

    @property
    def omega3(self) -> Exact:
        """ω3 = ψ̇ + φ̇ cosθ [rad/s]."""
        return self.spin if self.held == "omega3" else self.spin + self.phidot * cos(self.theta)

    def __repr__(self) -> str:
        """What makes it, less what is 0; ω3 says what a kick holds, and stays."""
        names = ("thetadot", "phi", "phidot", "psi", self.held)
        others = {
            name: getattr(self, name)
            for name in names
            if name == "omega3" or getattr(self, name) != 0
        }
        return as_call("State", theta=self.theta, **others)

    @classmethod
    def kicked(
        cls,
        *,
        theta: Number,
        omega3: Number,
        phidot: Number,
        thetadot: Number = 0,
        phi: Number = 0,
        psi: Number = 0,
    ) -> State:
        """The start after a kick across the axis, which holds ω3 and not ψ̇.

        Parameters
        ----------
        theta, phi, psi : number
            Angles [rad].
        omega3 : number
            ω3 [rad/s].
        phidot, thetadot : number
            Rates after the kick [rad/s].

        Raises
        ------
        ImpossibleStart
            As for `State`.

        Examples
        --------
        >>> print(State.kicked(theta="pi/3", omega3=140, phidot=-15).psidot)
        147.5
        """
        if omega3 is None:  # which `State` takes for a spin that is not given
            raise ImpossibleStart([("omega3", "a number is not nothing")])
        return cls(theta, thetadot=thetadot, phi=phi, phidot=phidot, psi=psi, omega3=omega3)

    @classmethod
    def from_constants(
        cls,
        top: Top,
        E: Number,
        p_phi: Number,
        p_psi: Number,
        theta: Number,
        branch: Branch = "falling",
        phi: Number = 0,
        psi: Number = 0,
    ) -> State:
        """The start at θ with the given constants of the motion.

        Parameters
        ----------
        top : Top
            What spins.
        E : number
            Energy, the spin energy p_ψ²/2C included [J].
        p_phi, p_psi : number
            Momenta about the vertical and about the axis [kg m² s⁻¹].
        theta : number
            Tilt θ [rad].
        branch : {"falling", "rising"}
            Whether θ grows or shrinks at the start.
        phi, psi : number
            The other angles [rad].

        Raises
        ------
        ImpossibleStart
            `top` is no Top, some value is no number, or no motion with these constants reaches θ;
            the least possible E is named.

        Examples
        --------
        >>> start = State.from_constants(Top(1, 1, 1), E=3, p_phi=1, p_psi=1, theta="pi/2")
        >>> print(start.thetadot, start.phidot)
        2 1
        """
        given = {"E": E, "p_phi": p_phi, "p_psi": p_psi, "theta": theta, "phi": phi, "psi": psi}
        values = _read(top, given | {"branch": branch})
        if top.C == 0:
            rule = "of a point mass (C = 0) it does not give the spin: give rates"
            raise ImpossibleStart([("p_psi", rule)])
        phidot = _precession_rate(top, values)
        speed = sqrt(_speed_squared(top, values, phidot))
        thetadot, omega3 = speed if branch == "falling" else -speed, values["p_psi"] / top.C
        angles = {name: values[name] for name in ("theta", "phi", "psi")}
        start = cls(**angles, thetadot=thetadot, phidot=phidot, omega3=omega3)
        set_fields(start, {"given": tuple(values.items())})
        return start

    @classmethod
    def steady(
        cls,
        top: Top,
        theta: Number,
        omega3: Number,
        which: Rate = "slow",
        phi: Number = 0,
        psi: Number = 0,
    ) -> State:
        """The start of a steady precession at constant θ.

        The two rates solve A cosθ Ω² − p_ψ Ω + gMR = 0. The slow one is taken from its partner,
        gMR / (A cosθ Ω), which neither cancels nor divides by cosθ.

        Parameters
        ----------
        top : Top
            What spins.
        theta : number
            Tilt θ [rad].
        omega3 : number
            ω3 [rad/s].
        which : {"slow", "fast"}
            The rate of smaller, or of larger, magnitude.
        phi, psi : number
            The other angles [rad].

        Raises
        ------
        ImpossibleStart
            `top` is no Top, some value is no number, the spin is below the least possible (which
            is named), or the fast rate is asked for at θ = π/2, where there is none.

        Examples
        --------
        >>> top = Top("6.375e-3", "7.5e-4", "0.73575")
        >>> print(State.steady(top, "pi/3", "140.6", "slow").phidot)
        10
        """
        values = {"theta": theta, "omega3": omega3, "phi": phi, "psi": psi}
        given = _read(top, {"steady": which} | values)
        rate = _steady_rate(top, given["theta"], given["omega3"], which)
        start = cls(**{name: given[name] for name in values}, phidot=rate)
        set_fields(start, {"given": tuple(given.items())})
        return start


def broken_start(values: Mapping[str, Exact]) -> list[Wrong]:
    """The rules that θ and the spin, if they are there, break."""
    theta = values.get("theta")
    if theta is None or _tilt(theta):
        return broken_spin(values)
    degrees = f'; {theta} degrees are "{theta} deg"' if theta in _DEGREES else ""
    return [Wrong("theta", f"must lie within [0, π] radians{degrees}"), *broken_spin(values)]


def _tilt(theta: Exact) -> bool:
    """Whether θ is not known to be outside [0, π]."""
    q = theta.fraction
    if q is not None and 0 <= q.numerator <= 3 * q.denominator:  # as nearly all are
        return True
    return -1 not in (theta.sign(), (PI - theta).sign())


def broken_spin(spin: Collection[str]) -> list[Wrong]:
    """The rule that the names of the spin break."""
    if not {"psidot", "omega3"} <= set(spin):
        return []
    return [Wrong("omega3", "give psidot or omega3, not both: a kick keeps the given one")]


def _read(top: object, given: dict[str, Any]) -> dict[str, Any]:
    """What a start on a top is made from, exact; everything wrong with it is raised."""
    readers = START | {"top": arguments.a(Top)}
    values = exact_numbers(ImpossibleStart, {"top": top} | given, broken_start, readers)
    del values["top"]
    return values


def _precession_rate(top: Top, values: Mapping[str, Exact]) -> Exact:
    """φ̇ = (p_φ − p_ψ cosθ) / (A sin²θ), and at a pole its limit along the motion."""
    p_phi, p_psi, u = values["p_phi"], values["p_psi"], cos(values["theta"])
    if sin(values["theta"]).sign() != 0:
        return (p_phi - p_psi * u) / (top.A * sin(values["theta"]) ** 2)
    if (p_phi - p_psi * u).sign() != 0:
        pole = "p_psi" if u == 1 else "-p_psi"
        where = f"equal to {pole} = {short(p_psi * u)} at this theta"
        raise ImpossibleStart([("p_phi", f"{where}: nothing else reaches the vertical")])
    return p_psi * u / (2 * top.A)


def _speed_squared(top: Top, values: Mapping[str, Exact], phidot: Exact) -> Exact:
    """θ̇² = 2(E − least)/A, where `least` is the energy of a motion that turns back at θ."""
    theta = values["theta"]
    turning = top.A * (phidot * sin(theta)) ** 2 / 2
    least = values["p_psi"] ** 2 / (2 * top.C) + top.gMR * cos(theta) + turning
    excess = values["E"] - least
    if excess.sign() == -1:
        raise ImpossibleStart([("E", f"at least {short(least)} at this theta")])
    return 2 * excess / top.A


def _steady_rate(top: Top, theta: Exact, omega3: Exact, which: Rate) -> Exact:
    p_psi, u = top.C * omega3, cos(theta)
    discriminant = p_psi**2 - 4 * top.A * top.gMR * u
    if discriminant.sign() == -1:
        if top.C == 0:
            raise ImpossibleStart([("theta", "beyond pi/2: no spin holds up a point mass (C = 0)")])
        least = 2 * sqrt(top.A * top.gMR * u) / top.C
        raise ImpossibleStart([("omega3", f"at least {short(least)} in magnitude at this theta")])
    root = sqrt(discriminant)
    larger = p_psi - root if p_psi.sign() == -1 else p_psi + root  # no cancellation
    if which == "fast":
        if u.sign() == 0:
            raise ImpossibleStart([("steady", '"slow" at theta = pi/2: there is no fast rate')])
        return larger / (2 * top.A * u)
    if top.gMR.sign() == 0:
        return top.gMR
    if larger.sign() == 0:
        raise ImpossibleStart([("omega3", "not 0 at this theta")])
    return 2 * top.gMR / larger
