"""Arrays of tops and starts, drawn at random, and the kinds of starts by definition."""

import math

import mpmath
import numpy as np

import heavytop as ht

CTX = mpmath.mp.clone()
CTX.dps = 300
ZERO = CTX.mpf(10) ** -250  # beside its terms: a sum that is 0


def sign(*terms):
    total = CTX.fsum(terms)
    return 0 if abs(total) <= ZERO * CTX.fsum(map(abs, terms)) else int(CTX.sign(total))


def kind_of(*row, held):
    """The kind and the detail, as the definitions of the kinds say them."""
    A, C, g, theta, thetadot, phidot, spin = map(CTX.mpf, row)
    u, s2 = CTX.cos(theta), CTX.sin(theta) ** 2
    on_pole = s2 < ZERO**2
    s2 *= not on_pole
    omega3 = spin if held == "omega3" else spin + phidot * u
    p_psi, drift, K2 = C * omega3, A * phidot * s2, A * (thetadot**2 + phidot**2 * s2)
    if thetadot == 0 and drift == 0 and omega3 == 0 and (g == 0 or on_pole):
        return "at-rest", ""
    if g == 0:
        return "force-free", ""
    if on_pole and thetadot == 0:
        side = sign(p_psi**2, -4 * A * abs(g))
        asleep = "sleeping", ("marginal", "stable", "unstable")[side]
        return ("hanging", "") if g * u < 0 else asleep
    over = sign(K2, 2 * g * u, -2 * abs(g))
    if omega3 == 0 and drift == 0:
        return "planar-pendulum", ("asymptotic", "rotating", "swinging")[over]
    top, bottom = (sign(drift, p_psi * u, pole * p_psi) for pole in (-1, 1))
    if (top if g > 0 else bottom) == 0 and over == 0:
        return "separatrix", ""
    if top == 0 and sign(K2, 2 * g * u, -2 * g) > 0:
        return "through-top", ""
    if bottom == 0 and sign(K2, 2 * g * u, 2 * g) > 0:
        return "through-bottom", ""
    if thetadot == 0 and sign(A * u * phidot**2, -p_psi * phidot, g) == 0:
        side = 0 if abs(u) < ZERO else sign(A * phidot**2 * abs(u), -abs(g))
        return "uniform-precession", ("single", "fast", "slow")[side]
    if top * bottom < 0:  # E' − gMR p_φ/p_ψ, with E' = K2/2 + gMR cosθ
        side = sign(p_psi * K2 / 2, p_psi * g * u, -g * drift, -g * p_psi * u) * CTX.sign(p_psi)
        return (("cusps", "loops", "waves")[int(side)]), ""
    return "waves", ""


def off(random, n):
    """1 + ε: with ε = 0 or of either sign and of a size from 1e-3 to 1e-16."""
    size = 10.0 ** random.uniform(-16, -3, n) * random.choice((-1, 0, 1), n)
    return 1 + size


def nasty(random, n, held):
    """Starts all over, on the special values, and beside each boundary between two kinds."""
    A = np.exp(random.uniform(-4, 4, n))
    C = A * random.choice((1e-3, 0.1, 0.5, 1, 1.5, 2, 1.9), n)
    g = np.exp(random.uniform(-4, 4, n)) * random.choice((1, -1, 1, -1, 0), n)
    theta = random.uniform(0, math.pi, n)
    beside = random.choice((0, 1e-8, 1e-20, 1e-12, 1e-3), n)
    theta = np.where(random.random(n) < 0.2, beside, theta)
    theta = np.where(random.random(n) < 0.1, math.pi - np.minimum(beside, 0.1), theta)
    level = random.random(n) < 0.1
    theta = np.where(level, math.pi / 2 + random.choice((0, 1e-16, 1e-9), n), theta)
    rate = np.sqrt(np.where(g == 0, 1, abs(g)) / A)
    omega3 = random.normal(size=n) * 3 * rate * A / C * random.choice((1, 0.1, 0, 10), n)
    thetadot = random.normal(size=n) * rate * random.choice((0, 0, 1, 1e-9), n)
    phidot = random.normal(size=n) * rate * random.choice((0, 1, 1, 1e-10), n)
    with np.errstate(all="ignore"):
        p, u = C * omega3, np.cos(theta)
        below, above = 2 * np.sin(theta / 2) ** 2, 2 * np.cos(theta / 2) ** 2
        root = np.sqrt(p * p - 4 * A * g * u)
        marks = [
            phidot,
            2 * g / p,  # a cusp at the other end
            p / (A * above),  # p_φ = p_ψ
            -p / (A * below),  # p_φ = −p_ψ
            (p + root) / (2 * A * u),  # steady
            (p - root) / (2 * A * u),
            -g / (p * np.ones(n)),
        ]
        which = random.integers(len(marks), size=n)
        aimed = np.choose(which, marks) * off(random, n)
        phidot = np.where(np.abs(aimed) < 1e6, aimed, phidot)
        rise = 2 * np.abs(g) / A * np.where(g > 0, below, above) - phidot**2 * below * above
        onto = (random.random(n) < 0.2) & (rise > 0)  # E' = |gMR|
        thetadot = np.where(onto, np.sqrt(rise) * off(random, n), thetadot)
        marginal = np.where(g > 0, 2 * np.sqrt(A * g) / C, omega3) * off(random, n)
        omega3 = np.where((theta == 0) & (random.random(n) < 0.5), marginal, omega3)
        spin = omega3 if held == "omega3" else omega3 - phidot * u
        spin = np.where(random.random(n) < 0.1, 0.0, spin)
    start = {"theta": theta, "thetadot": thetadot, "phidot": phidot, held: spin}
    return {"A": A, "C": C, "gMR": g} | start


def regular(random, n):
    """Tops and starts well away from every boundary, nearly always."""
    A, g = np.exp(random.uniform(-2, 2, n)), np.exp(random.uniform(-2, 2, n))
    return {
        "A": A, "C": A * random.uniform(0.05, 1.95, n), "gMR": g * random.choice((-1, 1), n),
        "theta": random.uniform(0.05, 3.09, n), "thetadot": random.normal(size=n),
        "phidot": random.normal(size=n), "omega3": 4 * random.normal(size=n),
    }  # fmt: skip


def top_and_state(row):
    """The top and the start that numbers by name say."""
    start = {name: x for name, x in row.items() if name not in ("A", "C", "gMR")}
    return ht.Top(row["A"], row["C"], row["gMR"]), ht.State(**start)
