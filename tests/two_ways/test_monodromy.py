"""Integrated motions around the thread: what φ and ψ gain in a nutation comes back a turn more."""

import numpy as np

import heavytop as ht
from heavytop.analytic.energy_momentum import energy_momentum

PLACES = 12


def test_integrated_around_the_thread():
    """heyoka integrates a nutation at each place, and knows no roots and no elliptic integrals."""
    diagram = energy_momentum(ht.Top("3.28e-4", "6.60e-5", "0.0456"), "0.004")
    loop = diagram.around(diagram.maximal_loop / 2)
    gained, off = [], []
    for k in range(PLACES):
        p_phi, E_prime = loop((k + 0.5) / PLACES)
        folded = ht.fold(ht.Scene(diagram.top, diagram.start(E_prime, p_phi), time=1))
        found = folded.period, folded.precession, folded.spin
        form = diagram.advance(p_phi, E_prime)
        told = form.period, form.precession, form.spin
        off += [abs(float(a) / float(b) - 1) for a, b in zip(found, told, strict=True)]
        kappa = 0.004 * (1 / 6.6e-5 - 1 / 3.28e-4)
        gained.append((float(found[1]), float(found[2]) - kappa * float(found[0])))
    assert max(off) < 1e-13
    followed = np.unwrap([*gained, gained[0]], axis=0)
    assert np.all(abs(np.diff(followed, axis=0)) < np.pi / 2)
    np.testing.assert_allclose(followed[-1] - followed[0], [2 * np.pi, -2 * np.pi], atol=1e-12)
