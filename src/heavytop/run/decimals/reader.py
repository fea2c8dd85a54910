"""Physical quantities at any number of digits, from states in decimal text."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from heavytop.equations.euler_poisson import e_x, e_y, e_z, l_x, l_y, l_z
from heavytop.equations.formulation import Formulation, spin, time, turned_phi
from heavytop.equations.lambdify import lambdified
from heavytop.equations.quaternion import q_0, q_1, q_2, q_3
from heavytop.integration.following import Told
from heavytop.integration.half_nutation import Pair, arm_rates
from heavytop.integration.precise import Found
from heavytop.numbers.decimals import Context, Number

Values = dict[Any, Any]
Named = dict[str, Number | None]
_AXIS, _MOMENTUM, _QUATERNION = (e_x, e_y, e_z), (l_x, l_y, l_z), (q_0, q_1, q_2, q_3)


@dataclass(frozen=True, slots=True)
class DecimalSample:
    """The motion at one time, in mpmath numbers; None for what the formulation does not give.

    Attributes
    ----------
    t : mpf
        Time [s].
    theta, phi, psi : mpf or None
        Tilt, precession and spin [rad], phi and psi continuous from the start.
    thetadot, phidot, psidot : mpf or None
        Their rates [rad/s].
    axis, omega : tuple of 3 mpf, or None
        The symmetry axis and the angular velocity [rad/s], both in space.
    quaternion : tuple of 4 mpf, or None
        The attitude, body to space, scalar first.
    states : tuple of mpf
        The states of the formulation.
    turned : tuple of float
        Phi and psi as they were followed, see `Found`.
    """

    t: Number
    theta: Number
    phi: Number | None
    psi: Number | None
    thetadot: Number | None
    phidot: Number | None
    psidot: Number | None
    axis: tuple[Number, ...] | None
    omega: tuple[Number, ...] | None
    quaternion: tuple[Number, ...] | None
    states: tuple[Number, ...]
    turned: Told


@dataclass(frozen=True)
class Reader:
    """Physical quantities of a formulation, and the numbers they are formed from.

    Attributes
    ----------
    form : Formulation
    ctx : Context
        Of more digits than the states.
    parameters : mapping from str to mpf
    grain : mpf
        How well a state is known, once it may have drifted. Closer to a pole phi is that before or
        after the pass.
    """

    form: Formulation
    ctx: Context
    parameters: Mapping[str, Number]
    grain: Number

    def __reduce__(self) -> tuple[Any, ...]:
        return Reader, (self.form, self.ctx, self.parameters, self.grain)

    def sample(self, found: Found) -> DecimalSample:
        """Return the motion at a state; phi and psi as they were followed tell their turns."""
        values = self.values(found)
        full: Named = {n: f(values) for n, f in self._outputs.items()}
        full |= self._limits_at_pole(full)
        if "phi" not in full:
            full["phi"] = values[turned_phi]
        if full["phi"] is None:
            full["psi"] = None
        return DecimalSample(
            t=values[time],
            theta=full["theta"],
            phi=full["phi"],
            psi=full.get("psi"),
            thetadot=full["thetadot"],
            phidot=full["phidot"],
            psidot=full["psidot"],
            axis=_components(full, "axis_", "xyz"),
            omega=_components(full, "omega_", "xyz"),
            quaternion=self._attitude(full),
            states=tuple(values[s] for s in self.form.states),
            turned=found.turned,
        )

    def values(self, found: Found) -> Values:
        """Return the numbers that quantities are functions of, by their symbols."""
        ctx, form, t = self.ctx, self.form, self.ctx.mpf(found.t)
        own = form.integrated or form
        values: Values = dict(zip(own.states, map(ctx.mpf, found.state), strict=True))
        values |= {p: self.parameters[p.name] for p in (*form.parameters, *form.given)}
        spun = self.parameters.get("kappa", ctx.zero) * t
        if form.integrated is not None:
            values |= zip(form.states[-2:], self._turned(values, *found.turned), strict=True)
        values |= {time: t, spin[0]: ctx.cos(spun / 2), spin[1]: ctx.sin(spun / 2)}
        values[turned_phi] = (
            self._phi(values, found.turned[0]) if "phi_mod" in form.outputs else None
        )
        return values

    def invariants(self, sample: DecimalSample) -> dict[str, Number]:
        """Return the invariants of the formulation at a sample, by name."""
        values = dict(zip(self.form.states, sample.states, strict=True))
        values |= {p: self.parameters[p.name] for p in (*self.form.parameters, *self.form.given)}
        return {name: self.function(x)(values) for name, x in self.form.invariants.items()}

    def function(self, expression: Any) -> Callable[[Values], Number | None]:
        """Return a function of the values; None where they do not give it."""
        used = tuple(expression.free_symbols)
        names = ("sin", "cos", "sqrt", "atan2")
        functions = {name: getattr(self.ctx, name) for name in names}
        evaluated = lambdified([expression], used, self.ctx.mpf, functions)

        def value(values: Values) -> Number | None:
            arguments = [values[x] for x in used]
            if None in arguments:
                return None
            try:
                return evaluated(*arguments)[0]
            except ZeroDivisionError:
                return None

        return value

    @cached_property
    def _outputs(self) -> dict[str, Callable[[Values], Number | None]]:
        wanted = {n: x for n, x in self.form.outputs.items() if n != "phi_mod"}
        return {name: self.function(expression) for name, expression in wanted.items()}

    def _phi(self, values: Values, phi: float) -> Number | None:
        """Return phi of the axis; where it stays on a pole, that of the start."""
        if phi != phi:  # not followed
            return None
        (x, y, z), (p, q, r) = ((values[s] for s in row) for row in (_AXIS, _MOMENTUM))
        own = self.parameters["P_minus" if z > 0 else "P_plus"]
        rate = q * z - r * y, r * x - p * z
        argument = self._argument((-y, x), (-rate[1], rate[0]), own, values)
        return self.parameters["phi_0"] if argument is None else self._nearest(argument, phi)

    def _turned(self, values: Values, phi: float, psi: float) -> tuple[Number, Number]:
        """Return phi and psi, less its uniform part, of a quaternion, as `turns` has them."""
        state = [values[s] for s in (*_QUATERNION, *_MOMENTUM[:2])]
        arms = ((state[0], state[3]), (state[1], state[2]))
        rates = arm_rates(state, values[l_z])
        momenta = (self.parameters[name] / 4 for name in ("P_plus", "P_minus"))
        each = zip(arms, rates, momenta, strict=True)
        plus, minus = (self._argument(*arm, values) for arm in each)
        if plus is None:  # on the vertical phi stays
            plus = self.parameters["phi_0"] - minus
        elif minus is None:
            minus = self.parameters["phi_0"] - plus
        return self._nearest(plus + minus, phi), self._nearest(plus - minus, psi)

    def _argument(self, z: Pair, rate: Pair, momentum: Number, values: Values) -> Number | None:
        """Return the argument of z; None where it vanishes and stays.

        In a pass that the state does not tell, having another angular momentum than it should, it
        is what it was before or will be after.
        """
        ctx, (x, y), (p, q) = self.ctx, z, rate
        size, speed = ctx.hypot(x, y), ctx.hypot(p, q)
        if not size and not speed:
            return None
        fastest = ctx.sqrt(sum(values[s] ** 2 for s in _MOMENTUM) + 8 * abs(self.parameters["g"]))
        near = size < self.grain and size * fastest <= speed
        drifted = abs(x * q - y * p - momentum) >= abs(momentum) / 2
        if near and drifted and 2 * abs(momentum) < self.grain * speed:
            return ctx.atan2(-q, -p) if x * p + y * q < 0 else ctx.atan2(q, p)
        return ctx.atan2(y, x)

    def _nearest(self, principal: Number, near: float) -> Number:
        turn = 2 * self.ctx.pi
        return principal + turn * self.ctx.nint((near - principal) / turn)

    def _limits_at_pole(self, full: Named) -> Named:
        """Return the rates where the axis is exactly vertical, as `quantities` has them."""
        if full["phidot"] is not None:
            return {}
        height: Number = full["axis_z"]
        p, up = self.parameters, height > 0
        if "k_0" in p:  # the cubic form
            tilting, regular = self.ctx.sqrt(max(p["k_0"], 0)), p["n"] / 2 if up else -p["n"] / 2
        else:
            across = (full[f"omega_{x}"] - p["kappa"] * full[f"axis_{x}"] for x in "xy")
            tilting, regular = self.ctx.hypot(*across), p["P_plus" if up else "P_minus"] / 4
        phidot = regular if tilting else self.ctx.zero
        return {
            "phidot": phidot,
            "thetadot": tilting if up else -tilting,
            "psidot": p["omega3"] - phidot * height,
        }

    def _attitude(self, full: Named) -> tuple[Number, ...] | None:
        own = _components(full, "quaternion_", "0123")
        theta, phi, psi = (full.get(name) for name in ("theta", "phi", "psi"))
        if own is not None or theta is None or phi is None or psi is None:
            return own
        c, s = self.ctx.cos(theta / 2), self.ctx.sin(theta / 2)
        plus, minus = (phi + psi) / 2, (phi - psi) / 2
        cos, sin = self.ctx.cos, self.ctx.sin
        return c * cos(plus), s * cos(minus), s * sin(minus), c * sin(plus)


def _components(full: Named, name: str, indices: str) -> tuple[Number, ...] | None:
    parts = [full.get(f"{name}{i}") for i in indices]
    return None if None in parts else tuple(parts)
