"""The reduced motion in balls: what the constants of the motion and a start leave over.

In units A = 1, with g = gMR/A, a = p_φ/A, b = p_ψ/A, h = E'/A and u = cos θ,

    u̇² = f(u) = 2 (h − g u)(1 − u²) − (a − b u)²,   f(u₀ + d) = f₀ + f₁ d + f₂ d² + f₃ d³.
"""

from __future__ import annotations

from dataclasses import dataclass

from flint import arb


@dataclass(frozen=True, slots=True)
class Reduced:
    """One motion, every number a ball.

    Parameters
    ----------
    g, b : arb
        gMR/A [s⁻²] and p_ψ/A [s⁻¹].
    u0, one_minus_u0, one_plus_u0 : arb
        cos θ₀ and 1 ∓ cos θ₀; exact where the start is on a pole.
    udot0 : arb
        u̇₀ [s⁻¹]; exactly 0 where the start is known to be a turning point.
    drift0 : arb
        a − b u₀ = φ̇₀ sin²θ₀ [s⁻¹].
    kinetic0 : arb
        h − g u₀ = ½ (θ̇₀² + φ̇₀² sin²θ₀) [s⁻²].
    kappa : arb
        p_ψ (1/C − 1/A) [s⁻¹].
    """

    g: arb
    b: arb
    u0: arb
    one_minus_u0: arb
    one_plus_u0: arb
    udot0: arb
    drift0: arb
    kinetic0: arb
    kappa: arb

    @property
    def P_minus(self) -> arb:
        """P₋ = a − b [s⁻¹]: 0 where the axis can pass the top."""
        return self.drift0 - self.b * self.one_minus_u0

    @property
    def P_plus(self) -> arb:
        """P₊ = a + b [s⁻¹]: 0 where the axis can pass the bottom."""
        return self.drift0 + self.b * self.one_plus_u0

    @property
    def over_top(self) -> arb:
        """The energy to spare at the top, h − g [s⁻²]."""
        return self.kinetic0 - self.g * self.one_minus_u0

    @property
    def over_bottom(self) -> arb:
        """The energy to spare at the bottom, h + g [s⁻²]."""
        return self.kinetic0 + self.g * self.one_plus_u0

    @property
    def pull(self) -> arb:
        """f₁ = f'(u₀) = 2 ü₀ [s⁻²]."""
        across = self.g * self.one_minus_u0 * self.one_plus_u0
        return 2 * (self.drift0 * self.b - across - 2 * self.kinetic0 * self.u0)

    @property
    def cubic(self) -> tuple[arb, arb, arb, arb]:
        """f₃, f₂, f₁, f₀."""
        bend = 4 * self.g * self.u0 - 2 * self.kinetic0 - self.b * self.b
        return 2 * self.g, bend, self.pull, self.udot0 * self.udot0

    def mirrored(self) -> Reduced:
        """The motion seen from below: θ → π − θ, ψ → −ψ and so g → −g."""
        return Reduced(
            -self.g, -self.b, -self.u0, self.one_plus_u0, self.one_minus_u0, -self.udot0,
            self.drift0, self.kinetic0, -self.kappa,
        )  # fmt: skip
