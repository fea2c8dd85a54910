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
