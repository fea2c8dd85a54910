"""Coefficients of splittings and of Gauss' collocation: their sums, their orders, their digits."""

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from heavytop.comparison import METHODS, fixed_steps, make_stepper

from .kicked import problem, set_up, started

SCHEMES = {
    "blanes-moan": fixed_steps.blanes_moan(),
    "sofroniou-spaletta": fixed_steps.composition(fixed_steps.SOFRONIOU_SPALETTA_10),
}


@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)
def test_on_a_spring_a_scheme_is_exact_to_its_order(scheme):
    assert all((row == row[::-1]).all() and abs(math.fsum(row) - 1) < 1e-15 for row in scheme)
    kicks, drifts = ([Fraction(x) / sum(map(Fraction, row)) for x in row] for row in scheme)
    h, q, p = Fraction(1, 1000), Fraction(1), Fraction(0)
    for kick, drift in zip(kicks, [*drifts, Fraction(0)], strict=True):
        p -= h * kick * q
        q += h * drift * p
    terms = [(-1) ** (k // 2) * h**k / math.factorial(k) for k in range(16)]
    assert max(abs(q - sum(terms[::2])), abs(p + sum(terms[1::2]))) < 1e-24


@pytest.mark.parametrize("name", ["strang", "blanes-moan-rkn6", "sofroniou-spaletta10"])
@pytest.mark.parametrize("h", [0.01, 0.019, 0.02, -0.5])  # |l| h from 0.26 to 13 rad
def test_without_gravity_a_splitting_is_the_rotation_itself(name, h):
    pytest.importorskip("numba")
    ell, e = np.array([3.0, -4.0, 25.0]), np.array([0.6, 0.0, 0.8])
    sign = 1 if h > 0 else -1
    method, known = replace(METHODS[name], setting=1.0), {"g": 0.0, "l_z": ell[2]}
    taken = make_stepper(method, problem([*e, *ell[:2]], known, abs(h), sign), 3)
    n, angle = ell / math.hypot(*ell), 3 * h * math.hypot(*ell)
    exact = e * math.cos(angle) + np.cross(n, e) * math.sin(angle)
    exact += n * (n @ e) * (1 - math.cos(angle))
    assert np.abs(taken.block(taken.begin()).state[:3] - exact).max() < 3e-14


# --- Gauss' collocation --------------------------------------------------------------------------


def test_gauss_coefficients_beyond_doubles_leave_no_drift():
    taken = set_up("gauss8", steps=8 * 4000)
    place, first, g = taken.block(taken.begin()), *started()
    *_, e_z, l_x, l_y = place.state
    energy = (l_x**2 + l_y**2) / 2 + g["g"] * e_z
    energy -= (first[3] ** 2 + first[4] ** 2) / 2 + g["g"] * first[2]
    assert abs(energy / g["g"]) < 5e-15
    assert place.evaluations < 150 * place.steps  # each step foresees the next
