"""The motion as a fold tells it: angles in whole turns and what is beyond them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np


@dataclass(frozen=True, slots=True)
class FoldedSample:
    """The motion at a time, or at times of shape (k,); angles are in radians.

    Attributes
    ----------
    t, theta, phi, psi : real, or ndarray of shape (k,)
        Time [s], tilt, precession and spin [rad], phi and psi continuous from the start: large
        ones have lost their last digits.
    phi_turns, psi_turns : int, or ndarray of shape (k,)
        Whole turns of phi and psi, rounded down.
    phi_mod, psi_mod : real, or ndarray of shape (k,)
        What is beyond them [rad], from 0 to 2 pi.
    thetadot, phidot, psidot : real, or ndarray of shape (k,)
        Rates [rad/s].
    axis, omega : tuple of 3, or ndarray of shape (3,) or (k, 3)
        The symmetry axis and the angular velocity [rad/s], both in space.
    quaternion : tuple of 4, or ndarray of shape (4,) or (k, 4)
        The attitude, body to space, scalar first.
    """

    t: Any
    theta: Any
    phi: Any
    psi: Any
    phi_turns: Any
    psi_turns: Any
    phi_mod: Any
    psi_mod: Any
    thetadot: Any
    phidot: Any
    psidot: Any
    axis: Any
    omega: Any
    quaternion: Any

    def stacked(self) -> FoldedSample:
        """Return the same with vectors as arrays, their components along the last dimension."""
        vectors = ("axis", "omega", "quaternion")
        return replace(self, **{v: np.stack(getattr(self, v), axis=-1) for v in vectors})


def joined(samples: Sequence[FoldedSample]) -> FoldedSample:
    """Return samples of many times, one after the other."""
    parts = {n: [getattr(sample, n) for sample in samples] for n in FoldedSample.__slots__}
    return replace(samples[0], **{name: np.concatenate(each) for name, each in parts.items()})
