"""Attitude, angular velocity and energy of the closed form, by identities of their own."""

import mpmath
import numpy as np
import pytest

import heavytop as ht
from heavytop.numbers.decimals import context

NAMES = ("sicm-kicked", "lie-group-benchmark", "through-top", "inverted-gravity", "spin-reversal")
CTX = context(50)
STEP = CTX.mpf(10) ** -12
TIMES = ("-0.9", "0", "0.37", "1.81")


def motion_of(name):
    scene = ht.load_scene(name)
    return ht.Motion(scene.top, scene.start)


def product(p, q):
    a, b = p[0], q[0]
    u, v = p[1:], q[1:]
    cross = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
    dot = sum(x * y for x, y in zip(u, v, strict=True))
    return (a * b - dot, *(a * y + b * x + z for x, y, z in zip(u, v, cross, strict=True)))


def turned(q, vector):
    back = (q[0], *(-x for x in q[1:]))
    return product(product(q, (0, *vector)), back)[1:]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("t", TIMES)
def test_quaternion_omega_and_energy_hold_together(name, t):
    motion, exact = motion_of(name), CTX.mpf(t)
    record = motion.at(exact, 50)
    q, omega = record.quaternion, record.omega
    size = max(map(abs, omega))
    assert abs(sum(x * x for x in q) - 1) < 1e-45
    for found, e in zip(turned(q, (0, 0, 1)), record.axis, strict=True):  # its axis is the axis
        assert abs(found - e) < 1e-45
    if name != "through-top" or exact:  # at the pole itself φ and ψ are of one side
        h = STEP / max(1, size)
        after, before = (motion.at(exact + s * h, 50).quaternion for s in (1, -1))
        rate = [(x - y) / (2 * h) for x, y in zip(after, before, strict=True)]
        spun = product((0, *omega), q)  # dq/dt = ω q / 2; differences are good to h²
        assert max(abs(2 * x - y) for x, y in zip(rate, spun, strict=True)) < 1e-20 * size
    top = motion.top
    A, C, gMR = (value.mpf(CTX) for value in (top.A, top.C, top.gMR))
    along = sum(x * y for x, y in zip(omega, record.axis, strict=True))
    whole = sum(x * x for x in omega)
    energy = A / 2 * (whole - along**2) + C / 2 * along**2 + gMR * record.axis[2]
    assert abs(energy - record.energy) < 1e-40 * abs(record.energy)
    assert abs(along - record.omega3) < 1e-44 * abs(along)


@pytest.mark.parametrize("name", NAMES)
def test_doubles_are_those_of_fifty_digits(name):
    motion = motion_of(name)
    found = motion.at(np.array([float(t) for t in TIMES]))
    assert found.quaternion.shape == (4, 4)
    assert found.omega.shape == (4, 3)
    for k, t in enumerate(TIMES):
        exact = motion.at(CTX.mpf(float(t)), 50)
        q = np.array([float(x) for x in exact.quaternion])
        assert np.abs(found.quaternion[k] - q).max() < 4e-15 * (1 + abs(float(exact.psi)) / 100)
        omega = np.array([float(x) for x in exact.omega])
        assert np.abs(found.omega[k] - omega).max() < 1e-13 * np.abs(omega).max()
        assert found.energy[k] == pytest.approx(float(exact.energy), rel=4e-16)


def test_a_million_periods_away_the_attitude_has_its_digits():
    motion = motion_of("sicm-kicked")
    t = 1e6 * motion.period
    exact = motion.at(t, 40).quaternion
    assert np.abs(motion.at(t).quaternion - [float(x) for x in exact]).max() < 1e-14


def test_the_start_is_the_rotation_of_its_angles():
    scene = ht.load_scene("sicm-kicked")
    start = ht.State("0.1", phi="0.7", psi="0.3", phidot=-15, psidot=140)
    q = ht.Motion(scene.top, start).at(0, 40).quaternion
    with mpmath.workdps(40):
        half = [mpmath.mpf(x) / 20 for x in (7, 1, 3)]
        parts = [(mpmath.cos(x), *(mpmath.sin(x) if i == k else 0 for i in range(3)))
                 for x, k in zip(half, (2, 0, 2), strict=True)]  # fmt: skip
        expected = product(product(parts[0], parts[1]), parts[2])
        half_turn = [mpmath.mpf(str(x)) for x in q]
        assert max(abs(x - y) for x, y in zip(half_turn, expected, strict=True)) < 1e-36
