"""The reduced motion: what the constants of the motion and a start leave over.

In units A = 1, with g = gMR/A, a = p_φ/A, b = p_ψ/A, h = E'/A and u = cos θ,

    u̇² = f(u) = 2 (h − g u)(1 − u²) − (a − b u)²,
    φ̇ = ½ [P₊/(1 + u) + P₋/(1 − u)],   P± = a ± b,
    ψ̇ = κ + ½ [P₊/(1 + u) − P₋/(1 − u)],   κ = p_ψ (1/C − 1/A).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

from heavytop.analytic.theory.zeros import threshold
from heavytop.numbers.decimals import Context, Number, number

if TYPE_CHECKING:
    from heavytop.scene.state import State
    from heavytop.scene.top import Top


@dataclass(frozen=True, slots=True)
class Reduced:
    """One motion in units A = 1: the parameters g, a, b, h and the start u₀, u̇₀, φ₀, ψ₀.

    Build one with `from_scene`, `from_angles` or `from_axis`; `refined` computes it again, from
    the same exact numbers, at another precision.

    Parameters
    ----------
    ctx : Context
        The precision of every field.
    g, b : Number
        gMR/A [s⁻²] and p_ψ/A [s⁻¹].
    u0, one_minus_u0, one_plus_u0, udot0 : Number
        cos θ₀, and 1 ∓ cos θ₀ without cancellation; u̇₀ [s⁻¹].
    drift0 : Number
        a − b u₀ = φ̇₀ sin²θ₀ [s⁻¹].
    kinetic0 : Number
        h − g u₀ = ½ (θ̇₀² + φ̇₀² sin²θ₀) [s⁻²].
    phi0, psi0, kappa : Number
        φ₀, ψ₀ [rad] and κ = p_ψ (1/C − 1/A) [s⁻¹].
    """

    ctx: Context = field(repr=False)
    g: Number
    b: Number
    u0: Number
    one_minus_u0: Number
    one_plus_u0: Number
    udot0: Number
    drift0: Number
    kinetic0: Number
    phi0: Number
    psi0: Number
    kappa: Number
    rebuild: Callable[[Context], Reduced] = field(repr=False, compare=False)

    @property
    def a(self) -> Number:
        """Momentum about the vertical, a = p_φ/A [s⁻¹]."""
        return self.drift0 + self.b * self.u0

    @property
    def h(self) -> Number:
        """Energy without that of the spin, h = E'/A [s⁻²]."""
        return self.kinetic0 + self.g * self.u0

    @property
    def P_plus(self) -> Number:
        """P₊ = a + b [s⁻¹]; added up from the start, where nothing cancels at the bottom."""
        return self.drift0 + self.b * self.one_plus_u0

    @property
    def P_minus(self) -> Number:
        """P₋ = a − b [s⁻¹]; added up from the start, where nothing cancels at the top."""
        return self.drift0 - self.b * self.one_minus_u0

    @property
    def sin2(self) -> Number:
        """sin²θ₀."""
        return self.one_minus_u0 * self.one_plus_u0

    @property
    def taylor(self) -> tuple[Number, Number, Number, Number]:
        """Coefficients of f(u₀ + d) in powers of d, constant first.

        Expanded about the start they lose nothing where f has a double root near it.
        """
        k, s, j = self.kinetic0, self.sin2, self.drift0
        return (
            self.udot0**2,
            -2 * self.g * s - 4 * k * self.u0 + 2 * j * self.b,
            -2 * k + 4 * self.g * self.u0 - self.b**2,
            2 * self.g,
        )

    def refined(self, ctx: Context) -> Reduced:
        """The same motion, computed again from the same exact numbers in `ctx`."""
        return self if ctx is self.ctx else self.rebuild(ctx)

    def mirrored(self) -> Reduced:
        """The motion seen from below: θ → π − θ, ψ → −ψ, φ as it is, and so g → −g."""
        return Reduced(
            self.ctx, -self.g, -self.b, -self.u0, self.one_plus_u0, self.one_minus_u0,
            -self.udot0, self.drift0, self.kinetic0, self.phi0, -self.psi0, -self.kappa,
            lambda ctx: self.rebuild(ctx).mirrored(),
        )  # fmt: skip

    @classmethod
    def from_scene(cls, ctx: Context, top: Top, start: State) -> Reduced:
        """The reduced motion of `top` from `start`, both exact.

        Parameters
        ----------
        ctx : Context
            The precision.
        top : Top
            What spins.
        start : State
            How it starts.
        """
        return cls.from_angles(
            ctx, top.A, top.C, top.gMR, start.theta, start.phi, start.psi,
            start.thetadot, start.phidot, omega3=start.omega3,
        )  # fmt: skip

    @classmethod
    def from_angles(
        cls, ctx: Context, A: Any, C: Any, gMR: Any, theta: Any, phi: Any, psi: Any,
        thetadot: Any, phidot: Any, psidot: Any = 0, *, omega3: Any = None,
    ) -> Reduced:  # fmt: skip
        """The reduced motion that starts from Euler angles and their rates.

        A start on a pole with θ̇ ≠ 0 has its φ₀ on the side towards which the axis moves; when
        θ̇₀ points through the pole (θ < 0 or > π next) that is φ₀ + π, and ψ₀ ∓ π.

        Parameters
        ----------
        ctx : Context
            The precision.
        A, C, gMR : object
            Moments about the pivot [kg m²] and weight times distance [kg m² s⁻²].
        theta, phi, psi, thetadot, phidot, psidot : object
            The start [rad, rad/s]: each a number of any kind `number` takes.
        omega3 : object, optional
            ψ̇ + φ̇ cos θ [rad/s] in place of `psidot`.

        Examples
        --------
        >>> from heavytop.numbers.decimals import context
        >>> r = Reduced.from_angles(context(30), 2, 1, 3, 0, 0, 0, 0, 0, 4)
        >>> float(r.b), float(r.P_minus)
        (2.0, 0.0)
        """
        A_, C_, gMR_, th, ph, ps, thd, phd = (
            number(ctx, value) for value in (A, C, gMR, theta, phi, psi, thetadot, phidot)
        )
        s, c = _snapped(ctx, ctx.sin(th / 2)), _snapped(ctx, ctx.cos(th / 2))
        u0 = _snapped(ctx, ctx.cos(th)) if s and c else c * c - s * s
        spin = number(ctx, psidot) + phd * u0 if omega3 is None else number(ctx, omega3)
        b, sine = C_ * spin / A_, 2 * s * c
        turn = _turn_through(ctx, s, c, thd)
        rebuild = partial(
            cls.from_angles, A=A, C=C, gMR=gMR, theta=theta, phi=phi, psi=psi,
            thetadot=thetadot, phidot=phidot, psidot=psidot, omega3=omega3,
        )  # fmt: skip
        return cls(
            ctx, gMR_ / A_, b, u0, 2 * s * s, 2 * c * c, -sine * thd, phd * sine**2,
            (thd**2 + (phd * sine) ** 2) / 2, ph + abs(turn), ps + turn, spin - b, rebuild,
        )  # fmt: skip

    @classmethod
    def from_axis(
        cls, ctx: Context, e: Sequence[Any], l: Sequence[Any], g: Any,  # noqa: E741
        phi0: Any = None, psi0: Any = 0, kappa: Any = 0,
    ) -> Reduced:  # fmt: skip
        """The reduced motion of the axis form, ė = l × e, l̇ = g (−e_y, e_x, 0).

        |e| = ρ need not be 1: e/ρ is the axis of a top whose g is ρ times larger.

        Parameters
        ----------
        ctx : Context
            The precision.
        e, l : sequence of 3
            The axis, and the angular momentum divided by A [s⁻¹].
        g : object
            gMR/A [s⁻²].
        phi0 : object, optional
            φ₀ [rad]; by default from the axis, in (−π, π]; on a pole, from where it moves to.
        psi0, kappa : object
            ψ₀ [rad], κ = p_ψ (1/C − 1/A) [s⁻¹].
        """
        x, y, z = (number(ctx, value) for value in e)
        lx, ly, lz = (number(ctx, value) for value in l)
        rho, size = ctx.sqrt(x * x + y * y + z * z), ctx.sqrt(lx * lx + ly * ly + lz * lz)
        x, y, z = x / rho, y / rho, z / rho
        b, sin2 = lx * x + ly * y + lz * z, x * x + y * y
        across = tuple(
            _snapped(ctx, along - b * part, size) for along, part in ((lx, x), (ly, y), (lz, z))
        )
        drift = lz * sin2 - z * (lx * x + ly * y)
        far = 1 + abs(z)
        minus, plus = (sin2 / far, far) if z > 0 else (far, sin2 / far)
        phi, turn = _azimuth(ctx, (x, y, z), (lx, ly), phi0)
        rebuild = partial(cls.from_axis, e=e, l=l, g=g, phi0=phi0, psi0=psi0, kappa=kappa)
        return cls(
            ctx, number(ctx, g) * rho, b, z, minus, plus, lx * y - ly * x,
            _snapped(ctx, drift, size * ctx.sqrt(sin2)), sum(part**2 for part in across) / 2,
            phi, number(ctx, psi0) + turn, number(ctx, kappa), rebuild,
        )  # fmt: skip


def _snapped(ctx: Context, value: Number, size: Number = 1) -> Number:
    """A sine, cosine or projection; that of "pi" is zero only to rounding, and means zero."""
    return ctx.zero if abs(value) <= threshold(ctx) * size else value


def _turn_through(ctx: Context, s: Number, c: Number, thetadot: Number) -> Number:
    """What a start on a pole, heading through it, adds to ψ₀: −π at the top, π at the bottom."""
    if not s and thetadot < 0:
        return -ctx.pi
    return +ctx.pi if not c and thetadot > 0 else ctx.zero


def _azimuth(
    ctx: Context, e: tuple[Number, ...], l: tuple[Number, Number], phi0: Any  # noqa: E741
) -> tuple[Number, Number]:  # fmt: skip
    """φ₀ of an axis, and what is added to ψ₀ when the axis starts on a pole heading through it."""
    x, y, z = e
    if x or y or not (l[0] or l[1]):
        return (ctx.atan2(x, -y) if phi0 is None else number(ctx, phi0)), ctx.zero
    sign = 1 if z > 0 else -1
    outward = ctx.atan2(sign * l[1], sign * l[0])  # from ė = l × e on the pole
    phi = outward if phi0 is None else number(ctx, phi0)
    if ctx.cos(outward - phi) >= 0:
        return phi, ctx.zero
    return phi + ctx.pi, -sign * ctx.pi
