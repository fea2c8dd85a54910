"""What a run cost."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Statistics:
    """What a run cost.

    Attributes
    ----------
    steps : int
        Natural steps of the integrator.
    order : int
        Order of its Taylor polynomials.
    derive_s, compile_s, integrate_s : float
        Wall-clock time of the parts [s].
    whole : bool
        Whether the times are of the whole run: a file does not keep those of its part.
    """

    steps: int
    order: int
    derive_s: float
    compile_s: float
    integrate_s: float
    whole: bool = True
