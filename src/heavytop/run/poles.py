"""Turning points that lie exactly on the vertical, which only exact numbers can tell."""

from __future__ import annotations

from heavytop.analytic.motion import Motion
from heavytop.numbers import Exact


def rates_at_poles(motion: Motion) -> dict[str, Exact]:
    """The limits of φ̇ where the axis passes exactly through the vertical [rad/s].

    In passing φ jumps by π; φ̇ = (p_φ − p_ψ u)/(A (1 − u²)) tends to p_ψ/2A at the top, where
    p_φ = p_ψ, and to −p_ψ/2A at the bottom. A run, which is off by its rounding, passes beside the
    pole with any rate.

    Parameters
    ----------
    motion : Motion

    Returns
    -------
    dict from str to Exact
        By kind of turning point, ``theta_min`` or ``theta_max``; empty where none is on a pole.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> scene = load_scene("through-bottom")
    >>> limits = rates_at_poles(Motion(scene.top, scene.start))
    >>> [(kind, round(float(rate), 6)) for kind, rate in limits.items()]
    [('theta_max', -4.02439)]
    """
    if not motion.nutates:
        return {}
    tilts, limit = motion.exact.tilts, motion.top.C * motion.start.omega3 / (2 * motion.top.A)
    found = {"theta_min": limit} if not min(tilts) else {}
    return found | ({"theta_max": -limit} if max(tilts) == motion.exact.ctx.pi else {})
