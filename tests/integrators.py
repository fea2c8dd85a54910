"""Integrators as users write them."""

import math

import numpy as np

import heavytop as ht


def rk4(f, y, h):
    a = f(y)
    b = f(y + h / 2 * a)
    c = f(y + h / 2 * b)
    d = f(y + h * c)
    return y + h / 6 * (a + 2 * b + 2 * c + d)


def dop853(fun, t_span, y0, **options):
    from scipy.integrate import solve_ivp

    return solve_ivp(fun, t_span, y0, method="DOP853", **options)


def raises(f, y, h):
    raise ValueError("no step")


def hangs(f, y, h):
    while True:
        pass


def midpoint_on_rotations(f, y, h):
    """Of order 2, and a rotation stays one: what papers on Lie groups begin with."""

    def turned(w):
        angle = np.linalg.norm(w)
        hat = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        half = np.sinc(angle / 2 / math.pi)
        return np.eye(3) + np.sinc(angle / math.pi) * hat + half * half / 2 * hat @ hat

    R, w = y[:9].reshape(3, 3), y[9:]
    half = w + h / 2 * f(y)[9:]
    middle = np.concatenate([(R @ turned(h / 2 * w)).ravel(), half])
    return np.concatenate([(R @ turned(h * half)).ravel(), w + h * f(middle)[9:]])


on_the_group = ht.Method(midpoint_on_rotations, formulation="rotation", order=2)


def product(p, q):
    """Of two quaternions, scalar first."""
    v, w = p[1:], q[1:]
    return np.array([p[0] * q[0] - v @ w, *(p[0] * w + q[0] * v + np.cross(v, w))])


def semi_implicit_euler(f, y, h):
    """Of order 1, on quaternions: the new velocity turns the body."""
    w = y[4:] + h * f(y)[4:]
    angle = h * np.linalg.norm(w) / 2
    turn = np.array([math.cos(angle), *(np.sinc(angle / math.pi) * h / 2 * w)])
    return np.concatenate([product(y[:4], turn), w])


def exponential(v):
    """The rotation about a vector, by its length."""
    angle = np.linalg.norm(v)
    hat = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    half = np.sinc(angle / 2 / math.pi)
    return np.eye(3) + np.sinc(angle / math.pi) * hat + half * half / 2 * hat @ hat


def munthe_kaas(f, y, h):
    """Runge and Kutta's method of order 4 in the algebra of rotations."""
    R = y[:9].reshape(3, 3)

    def slope(turn, w):
        here = np.concatenate([(R @ exponential(turn)).ravel(), w])
        across = np.cross(turn, w)
        return w + across / 2 + np.cross(turn, across) / 12, f(here)[9:]

    w = y[9:]
    a, da = slope(np.zeros(3), w)
    b, db = slope(h / 2 * a, w + h / 2 * da)
    c, dc = slope(h / 2 * b, w + h / 2 * db)
    d, dd = slope(h * c, w + h * dc)
    turn, gain = h / 6 * (a + 2 * b + 2 * c + d), h / 6 * (da + 2 * db + 2 * dc + dd)
    return np.concatenate([(R @ exponential(turn)).ravel(), w + gain])


def variational(f, y, h):
    """Of order 2: the discrete variational step on rotations of Lee, Leok and McClamroch."""
    inertia = np.array([1.0, 1.0, f.top.C / f.top.A])
    R, w = y[:9].reshape(3, 3), y[9:]

    def torque(R):
        return f.top.gMR / f.top.A * np.cross(R[2], [0.0, 0.0, 1.0])

    half = inertia * w + h / 2 * torque(R)
    turn = h * half / inertia
    for _ in range(50):  # exp(turn) leads from one discrete momentum to the next
        angle = np.linalg.norm(turn)
        s, c = np.sinc(angle / math.pi), np.sinc(angle / 2 / math.pi) ** 2 / 2
        off = s * inertia * turn + c * np.cross(turn, inertia * turn) - h * half
        if np.abs(off).max() < 1e-15 * max(1.0, np.abs(h * half).max()):
            break
        turn = turn - off / inertia
    F = exponential(turn)
    after = R @ F
    momentum = F.T @ half + h / 2 * torque(after)
    return np.concatenate([after.ravel(), momentum / inertia])
