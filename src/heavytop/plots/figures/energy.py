"""The tilt by itself: its effective potential, and the plane of tilt and tilt rate."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from heavytop.analytic.potential import Curve, Potential
from heavytop.classification import Kind
from heavytop.plots.figures.given import expect_run
from heavytop.plots.figures.style import FAINT, MARKS, OTHER, PATH, Array

if TYPE_CHECKING:
    from heavytop.run.trajectory import Trajectory

BEYOND = 1.5**2  # how far above the least energy the potential is drawn, in units of its spread


def effective_potential(ax: Axes, trajectory: Trajectory) -> None:
    """Draw V_eff(theta) - p_psi^2/2C [J] with E', the tilts it allows, and the turning points.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    trajectory : Trajectory
    """
    expect_run(trajectory)
    V = Potential(trajectory.motion.rising.source)
    A, E_prime = float(trajectory.scene.top.A), _energy(trajectory)
    low, high = tilts_shown(V)
    theta = np.linspace(low, high, 801)
    ax.plot(theta, A * V(theta), color=PATH, linewidth=1.4, label="V$_{eff}$ − p$_ψ$²/2C")
    ax.axhline(E_prime, color=OTHER, linewidth=1.0, linestyle="--", label="energy E′")
    _allowed(ax, V, A, E_prime, trajectory)
    margin = 0.06 * BEYOND * V.spread * A
    floor, ceiling = A * float(V.least), A * (float(V.least) + BEYOND * V.spread)
    if margin:
        ax.set_ylim(floor - margin, max(ceiling, E_prime) + margin)
    ax.set_xlabel("tilt θ [rad]")
    ax.set_ylabel("energy without that of the spin [J]")


def _allowed(ax: Axes, V: Potential, A: float, E_prime: float, trajectory: Trajectory) -> None:
    """Fill between potential and energy, and mark where they meet."""
    motion = trajectory.motion
    ends = (motion.theta_min, motion.theta_max)
    theta = np.linspace(*ends, 401)
    if ends[1] > ends[0]:
        below = np.minimum(A * V(theta), E_prime)
        ax.fill_between(theta, below, E_prime, color=PATH, alpha=0.15, linewidth=0)
    if not motion.nutates:
        ax.plot(
            trajectory.theta[0],
            E_prime,
            "o",
            color="black",
            markersize=4,
            linestyle="none",
            label="start",
        )
        return
    for name, tilt in zip(("theta_min", "theta_max"), ends, strict=True):
        mark = MARKS[name]
        ax.plot(
            tilt, E_prime, mark.marker, color=mark.colour, markerfacecolor="white", markersize=6,
            linestyle="none", label=mark.label,
        )  # fmt: skip


def phase_plane(ax: Axes, trajectory: Trajectory) -> None:
    """Draw curves of constant energy in the plane of theta [rad] and thetadot [rad/s].

    All of them have the momenta p_phi and p_psi of the scene; its own curve is the heavy one. The
    separatrix, where there is one, is dashed. The dot is the start.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    trajectory : Trajectory
    """
    expect_run(trajectory)
    motion = trajectory.motion
    V = Potential(motion.rising.source)
    for k, curve in enumerate(V.family()):
        _loop(ax, curve, FAINT, 0.8, "-", "other energies" if k == 0 else None)
    if motion.nutates and (own := V.curve(V.excess)) is not None:
        _loop(ax, own, PATH, 1.8, "-", "the motion")
    if (separatrix := V.separatrix()) is not None:
        label = "separatrix, and the motion" if motion.kind is Kind.SEPARATRIX else "separatrix"
        _loop(ax, separatrix, OTHER, 1.2, "--", label)
    start = trajectory.samples.at(slice(0, 1))
    ax.plot(
        start.theta, start.thetadot, "ko", markersize=4, linestyle="none", label="start", zorder=4
    )
    ax.axhline(0.0, color=FAINT, linewidth=0.5, zorder=0)
    ax.set_xlabel("tilt θ [rad]")
    ax.set_ylabel("tilt rate θ̇ [rad/s]")


def _loop(ax: Axes, curve: Curve, colour: str, width: float, style: str, label: str | None) -> None:
    """Draw both branches; where the curve runs into a pole they are left apart."""
    theta: Array = np.concatenate((curve.theta, [np.nan], curve.theta))
    speed: Array = np.concatenate((curve.speed, [np.nan], -curve.speed))
    ax.plot(theta, speed, style, color=colour, linewidth=width, label=label)


def tilts_shown(V: Potential) -> tuple[float, float]:
    """The tilts that the picture spans."""
    widest = V.curve(BEYOND * V.spread, 2)
    return (0.0, float(np.pi)) if widest is None else (widest.theta[0], widest.theta[-1])


def _energy(trajectory: Trajectory) -> float:
    return float(trajectory.motion.constants.E_prime)
