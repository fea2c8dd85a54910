"""What is common to the compiled steps of the methods of fixed step.

A kernel takes whole steps in place and returns the evaluations it counted, or a negative number
where it could not go on. Everything is compiled without reassociation, so that a number of steps
leads to the same bits whatever runs it is cut into; nothing compiled is kept on a disk.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

Kernel = Callable[..., int]


def compiled(advance: Callable[..., int]) -> Kernel:
    """Return a kernel, compiled: of state, work, g, l_z, the method's table, a number of steps."""
    from numba import njit

    signature = "int64(float64[::1], float64[::1], float64, float64, float64[:, ::1], int64)"
    kernel: Kernel = njit(signature, nogil=True)(advance)
    return kernel


def added_up(*, compensated: bool) -> Any:
    """Return what adds a term to a sum: from (sum, lost, term) to (sum, lost)."""
    from numba import njit

    def plain(total: float, lost: float, term: float) -> tuple[float, float]:
        return total + term, lost

    def carried(total: float, lost: float, term: float) -> tuple[float, float]:
        term = term + lost
        result = total + term  # and its error: Knuth's, since e_x may be less than the term
        part = result - total
        return result, (total - (result - part)) + (term - part)

    return njit(inline="always")(carried if compensated else plain)
