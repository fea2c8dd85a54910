"""The rigid-body equations by their own Taylor series at 40 digits.

The equations are integrated in the form that has no pole: the axis e, the momentum ℓ = L/A and
one more body vector v,

    ė = ℓ × e,   ℓ̇ = −g e × ẑ,   v̇ = (ℓ + κ e) × v,   κ = p_ψ (1/C − 1/A).

Nothing here knows roots, elliptic functions or the package's closed form.
"""

from functools import cache

from heavytop.exact import Exact
from heavytop.exact.decimals import context

WORK = context(45)


def cross(one, other):
    return [one[i - 2] * other[i - 1] - one[i - 1] * other[i - 2] for i in range(3)]


def series(y, g, kappa, order):
    """Taylor coefficients of (e, ℓ, v) about a state."""
    e, l, v = ([list(part)] for part in y)  # noqa: E741
    for k in range(order):
        spin = [[l[j][i] + kappa * e[j][i] for i in range(3)] for j in range(k + 1)]
        turned = [(cross(l[j], e[k - j]), cross(spin[j], v[k - j])) for j in range(k + 1)]
        e.append([sum(pair[0][i] for pair in turned) / (k + 1) for i in range(3)])
        v.append([sum(pair[1][i] for pair in turned) / (k + 1) for i in range(3)])
        l.append([-g * e[k][1] / (k + 1), g * e[k][0] / (k + 1), WORK.zero])
    return e, l, v


def integrate(y, g, kappa, t, order=44):
    """The state at time t, by Taylor steps whose last terms are below 1e-38."""
    left = WORK.mpf(t)
    while left:
        parts = series(y, g, kappa, order)
        last = max(abs(x) for part in parts for x in part[-1])
        h = (WORK.mpf("1e-38") / last) ** (WORK.one / order) if last else abs(left)
        h = min(h, abs(left)) * (1 if left > 0 else -1)
        y = [[WORK.polyval([row[i] for row in part[::-1]], h) for i in range(3)] for part in parts]
        left -= h
    return y


def attitude(phi, theta, psi):
    """Columns z and x of Rz(φ) Rx(θ) Rz(ψ)."""
    c, s = WORK.cos, WORK.sin
    e = [s(theta) * s(phi), -s(theta) * c(phi), c(theta)]
    v = [
        c(phi) * c(psi) - s(phi) * c(theta) * s(psi),
        s(phi) * c(psi) + c(phi) * c(theta) * s(psi),
        s(theta) * s(psi),
    ]
    return e, v


def body(args):
    """(e, ℓ, v), g and κ of a start in angles, from L = A e × ė + p_ψ e."""
    A, C, gMR, th, ph, ps, thd, phd, psd = (Exact.of(x).mpf(WORK) for x in args)
    e, v = attitude(ph, th, ps)
    c, s = WORK.cos, WORK.sin
    edot = [
        c(th) * s(ph) * thd + s(th) * c(ph) * phd,
        -c(th) * c(ph) * thd + s(th) * s(ph) * phd,
        -s(th) * thd,
    ]
    omega3 = psd + phd * c(th)
    l = [a + C / A * omega3 * b for a, b in zip(cross(e, edot), e, strict=True)]  # noqa: E741
    return (e, l, v), gMR / A, omega3 * (1 - C / A)


@cache
def solved(args, t):
    """(e, ℓ, v) of a motion at a time, and κ."""
    begun, g, kappa = body(args)
    return *integrate(begun, g, kappa, WORK.mpf(t)), kappa


def here(x):
    """A number of another context among those of this one."""
    return WORK.make_mpf(x._mpf_)
