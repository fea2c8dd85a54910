"""Integrators as users write them."""


def rk4(f, y, h):
    a = f(y)
    b = f(y + h / 2 * a)
    c = f(y + h / 2 * b)
    d = f(y + h * c)
    return y + h / 6 * (a + 2 * b + 2 * c + d)


def dop853(fun, t_span, y0, **options):
    from scipy.integrate import solve_ivp

    return solve_ivp(fun, t_span, y0, method="DOP853", **options)


def hangs(f, y, h):
    while True:
        pass
