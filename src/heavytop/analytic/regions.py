"""What kind of motion a place of the energy–momentum diagram holds, told from where it lies."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from heavytop.classification import Kind

Array: TypeAlias = npt.NDArray[np.float64]
Mask: TypeAlias = npt.NDArray[np.bool_]
Texts: TypeAlias = npt.NDArray[np.str_]

NOWHERE = ""


def regions(E_prime: Array, p_phi: Array, least: Array, p_psi: float, gMR: float) -> Texts:
    """The kinds at given places, in the order in which the first that fits is taken.

    Parameters
    ----------
    E_prime, p_phi : ndarray of one shape
        Places [J, kg m² s⁻¹].
    least : ndarray
        The least E' at these p_φ [J].
    p_psi, gMR : float
        Those of the diagram [kg m² s⁻¹, kg m² s⁻²].

    Returns
    -------
    ndarray of str
        Values of `Kind`; "" where no motion has these constants.
    """
    on_edge, vertical = E_prime == least, abs(p_phi) == abs(p_psi)
    lift = np.sign(p_psi) * (E_prime * p_psi - gMR * p_phi)  # criteria.looping
    between = abs(p_phi) < abs(p_psi)
    standing = (p_phi == np.sign(gMR) * p_psi) & (E_prime == abs(gMR))
    told: list[tuple[Mask, str]] = [
        (~(E_prime >= least), NOWHERE),
        (np.full(p_phi.shape, gMR == 0), Kind.FORCE_FREE),
        (standing & on_edge, Kind.SLEEPING),
        (vertical & on_edge & (E_prime == -abs(gMR)), Kind.HANGING),
        (on_edge, Kind.UNIFORM_PRECESSION),
        (vertical & (p_psi == 0), Kind.PLANAR_PENDULUM),
        (standing, Kind.SEPARATRIX),
        ((p_phi == p_psi) & (E_prime > gMR), Kind.THROUGH_TOP),
        ((p_phi == -p_psi) & (E_prime > -gMR), Kind.THROUGH_BOTTOM),
        (between & (lift > 0), Kind.LOOPS),
        (between & (lift == 0), Kind.CUSPS),
    ]
    words = [np.full(p_phi.shape, str(kind)) for _, kind in told]
    return np.select([where for where, _ in told], words, default=str(Kind.WAVES))
