"""State: how a top starts.

Angles are Euler's, z-x-z: θ tilt, φ precession, ψ spin; ω3 = ψ̇ + φ̇ cosθ is the spin about the
body's own axis and p_ψ = C ω3.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, Self, TypeAlias, TypedDict, Unpack

from heavytop.errors import FoldedTiltWarning
from heavytop.exact import Exact, Number, cos
from heavytop.scene import starts
from heavytop.scene.arguments import call_text, drop_none, set_fields
from heavytop.scene.top import Top
from heavytop.text import Shown

Branch: TypeAlias = Literal["falling", "rising", "forward", "backward"]
Vector: TypeAlias = "Sequence[Number]"


class Rates(TypedDict, total=False):
    """How the body turns: an angular velocity, or Euler's rates."""

    omega_body: Vector
    omega_space: Vector
    thetadot: Number
    phidot: Number
    psidot: Number
    omega3: Number


@dataclass(frozen=True, slots=True, init=False, repr=False)
class State(Shown):
    """A start: Euler angles [rad] and their rates [rad/s], exact.

    Parameters
    ----------
    theta : number
        Tilt θ of the axis from the upward vertical; outside [0, π] it is folded, and a warning
        says so.
    thetadot, phi, phidot, psi : number, optional
        The other angles [rad] and rates [rad/s], by name; 0 where they are left out.
    psidot, omega3 : number, optional
        The spin, as ψ̇ or as ω3 = ψ̇ + φ̇ cosθ [rad/s]; at most one of them. The one that is given
        keeps its value where φ̇ or θ is changed.
    omega_body, omega_space : sequence of 3 number, optional
        The angular velocity [rad/s], along the axes of the body or of space, in place of rates.

    Attributes
    ----------
    held : {"psidot", "omega3"}
        Which of the two was given.
    spin : Exact
        The value of that one [rad/s].
    given : tuple of (str, object)
        The start as it was given, by the keys of a scene file.
    notices : tuple of str
        How θ was folded into [0, π], if it was.

    Raises
    ------
    ImpossibleStart
        Some value is no number, or more is given than determines a start.

    Warns
    -----
    FoldedTiltWarning
        θ is outside [0, π].

    Examples
    --------
    >>> start = State(theta="pi/3", phidot=2, omega3=10)
    >>> print(start.psidot, start.held)
    9 omega3
    >>> start
    State(theta='pi/3', phidot='2', omega3='10')

    References
    ----------
    Sussman & Wisdom, *Structure and Interpretation of Classical Mechanics* (2001), section 2.10.
    """

    theta: Exact
    thetadot: Exact
    phi: Exact
    phidot: Exact
    psi: Exact
    spin: Exact
    held: Literal["psidot", "omega3"]
    given: tuple[tuple[str, Any], ...] = field(compare=False, repr=False)
    notices: tuple[str, ...] = field(compare=False, repr=False)

    def __init__(
        self,
        theta: Number,
        *,
        thetadot: Number | None = None,
        phi: Number | None = None,
        phidot: Number | None = None,
        psi: Number | None = None,
        psidot: Number | None = None,
        omega3: Number | None = None,
        omega_body: Any = None,
        omega_space: Any = None,
    ) -> None:
        rates = drop_none(thetadot=thetadot, phidot=phidot, psidot=psidot, omega3=omega3)
        turning = drop_none(omega_body=omega_body, omega_space=omega_space)
        self._read({"theta": theta} | drop_none(phi=phi, psi=psi) | rates | turning, None)

    @classmethod
    def of(cls, given: Mapping[str, object], top: Top | None = None) -> Self:
        """The start that the keys of a scene's ``[start]`` determine.

        Parameters
        ----------
        given : mapping from str to object
            Keys of `heavytop.scene.starts.START_READERS`, and their values.
        top : Top, optional
            The top; constants of the motion and a steady precession need it.

        Raises
        ------
        ImpossibleStart
            A value breaks its rule, too many or too few are given, or no motion has them.

        Examples
        --------
        >>> print(State.of({"steady": True, "theta": "pi/3", "phidot": 2}, Top(1, 1, 6)).spin)
        4
        """
        start = cls.__new__(cls)
        start._read(given, top)
        return start

    def _read(self, given: Mapping[str, object], top: Top | None) -> None:
        """Set the fields of a start that is given by keys, and warn where θ is folded."""
        set_fields(self, starts.read_start(given, top))
        for notice in self.notices:
            warnings.warn(notice, FoldedTiltWarning, stacklevel=4)

    @property
    def psidot(self) -> Exact:
        """ψ̇ [rad/s]."""
        return self.spin if self.held == "psidot" else self.spin - self.phidot * cos(self.theta)

    @property
    def omega3(self) -> Exact:
        """ω3 = ψ̇ + φ̇ cosθ [rad/s]."""
        return self.spin if self.held == "omega3" else self.spin + self.phidot * cos(self.theta)

    def __repr__(self) -> str:
        """The call that makes it, without numbers that are 0; ω3 stays, for it sets `held`."""
        others = {
            name: getattr(self, name) for name in ("thetadot", "phi", "phidot", "psi", self.held)
        }
        others = {name: x for name, x in others.items() if name == "omega3" or x != 0}
        return call_text("State", theta=self.theta, **others)

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
        rates = {"thetadot": thetadot, "phidot": phidot, "omega3": omega3}
        return cls.of({"theta": theta, "phi": phi, "psi": psi} | rates)

    @classmethod
    def from_quaternion(cls, quaternion: Vector, **rates: Unpack[Rates]) -> Self:
        """The start in an attitude that a quaternion gives.

        Parameters
        ----------
        quaternion : sequence of 4 number
            Body to space, scalar first; of any length but 0.
        omega_body, omega_space : sequence of 3 number, optional
            The angular velocity [rad/s], along the axes of the body or of space; or
        thetadot, phidot, psidot, omega3 : number, optional
            rates [rad/s], the spin as one of the last two.

        Raises
        ------
        ImpossibleStart
            As for `State`.

        Examples
        --------
        >>> start = State.from_quaternion((3, 1, 0, 0), omega_body=(1, 2, 5))
        >>> print(start.theta, start.thetadot, start.phidot, start.omega3)
        acos(0.8) 1 10/3 5
        """
        return cls.of({"quaternion": quaternion, **rates})

    @classmethod
    def from_rotation(cls, rotation: Sequence[Vector], **rates: Unpack[Rates]) -> Self:
        """The start in an attitude that a rotation matrix gives.

        Parameters
        ----------
        rotation : sequence of 3 rows
            Body to space; its columns are the body's axes. It may be rounded: within 1e-6.
        omega_body, omega_space : sequence of 3 number, optional
            The angular velocity [rad/s], along the axes of the body or of space; or
        thetadot, phidot, psidot, omega3 : number, optional
            rates [rad/s], the spin as one of the last two.

        Raises
        ------
        ImpossibleStart
            As for `State`.

        Examples
        --------
        >>> rows = [[1, 0, 0], [0, "0.8", "-0.6"], [0, "0.6", "0.8"]]
        >>> print(State.from_rotation(rows, omega_space=(0, 3, 4)).phidot)
        8
        """
        return cls.of({"rotation": rotation, **rates})

    @classmethod
    def from_constants(
        cls,
        top: Top,
        E: Number | None = None,
        p_phi: Number | None = None,
        p_psi: Number | None = None,
        theta: Number | None = None,
        branch: Branch | None = None,
        phi: Number = 0,
        psi: Number = 0,
        *,
        E_prime: Number | None = None,
        omega3: Number | None = None,
        thetadot: Number | None = None,
    ) -> Self:
        """The start with four of: energy, p_φ, p_ψ (or ω3), θ and θ̇.

        Parameters
        ----------
        top : Top
            The top.
        E, E_prime : number, optional
            Energy [J], the spin energy p_ψ²/2C included, or without it.
        p_phi : number, optional
            Momentum about the vertical [kg m² s⁻¹].
        p_psi, omega3 : number, optional
            Momentum about the axis [kg m² s⁻¹], or ω3 [rad/s].
        theta, thetadot : number, optional
            Tilt θ [rad] and its rate [rad/s]; without an energy that rate is 0 if it is left out.
        branch : {"falling", "rising", "forward", "backward"}, optional
            Which of two solutions: with unknown θ̇ "falling" where θ grows, "rising" where it
            shrinks; with unknown θ the smaller and the larger tilt; with unknown p_φ or p_ψ
            "forward" the larger and "backward" the smaller. By default "falling" or "forward".
        phi, psi : number
            The other angles [rad].

        Raises
        ------
        ImpossibleStart
            `top` is no Top, some value is no number, there are not four, or no motion with these
            constants reaches θ; the least possible E is named.

        Examples
        --------
        >>> start = State.from_constants(Top(1, 1, 1), E=3, p_phi=1, p_psi=1, theta="pi/2")
        >>> print(start.thetadot, start.phidot)
        2 1
        """
        constants = drop_none(E=E, E_prime=E_prime, p_phi=p_phi, p_psi=p_psi, omega3=omega3)
        rest = drop_none(theta=theta, thetadot=thetadot, branch=branch, phi=phi, psi=psi)
        return cls.of(constants | rest, top)

    @classmethod
    def steady(
        cls,
        top: Top,
        theta: Number,
        omega3: Number | None = None,
        which: Literal["slow", "fast"] | bool = "slow",
        phi: Number = 0,
        psi: Number = 0,
        *,
        psidot: Number | None = None,
        phidot: Number | None = None,
    ) -> Self:
        """The start of a steady precession at constant θ.

        The two rates solve A cosθ Ω² − p_ψ Ω + gMR = 0. The slow one is taken from its partner,
        gMR / (A cosθ Ω), which neither cancels nor divides by cosθ.

        Parameters
        ----------
        top : Top
            The top.
        theta : number
            Tilt θ [rad].
        omega3, psidot : number, optional
            The spin, as ω3 or as ψ̇ [rad/s]; or
        phidot : number, optional
            Ω [rad/s], from which ω3 follows.
        which : {"slow", "fast"}
            The rate of smaller, or of larger, magnitude; ignored where Ω is given.
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
        >>> print(State.steady(top, "pi/3", phidot=10).omega3)
        140.6
        """
        spin = drop_none(omega3=omega3, psidot=psidot, phidot=phidot)
        steady = True if phidot is not None else which
        return cls.of({"steady": steady, "theta": theta, **spin, "phi": phi, "psi": psi}, top)
