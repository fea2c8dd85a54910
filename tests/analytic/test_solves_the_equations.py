"""The closed form solves the Lagrange equations: proved by algebra.

`symbols` runs the code of `analytic/constants`, `form` and `roots` on expressions, one family of
motions after another, beside a turning point of u₁ and beside one of u₂. θ, φ and ψ are put into
what `equations/lagrangian` derives, and what is left is the polynomial 0, whatever the constants of
the motion and the time are. No residual is small.
"""

import inspect
import random
import sys
from types import ModuleType

import pytest
import sympy as sp
from flint import acb, arb

from heavytop.analytic import balls, constants, form, roots, theta
from heavytop.equations import lagrangian as lag
from heavytop.exact.balls import working

from .symbols import (
    PHI,
    PSI,
    TIME,
    Algebra,
    Angle,
    Cosine,
    First,
    Nutating,
    Separatrix,
    Steady,
    Sweep,
    Symbol,
    k,
    size,
    span,
)

TOP = {"low": 2 - size**2}  # u₂ = 1
UNDER = {"m": k**2, "size": k * span, "low": 2 - span**2}  # u₃ = 1
BOTTOM = {"low": 0}  # u₁ = −1
SWING = {"m": k**2, "size": sp.sqrt(2) * k, "low": 0}
OVER = {"size": sp.sqrt(2), "low": 0}
BELOW = {"mirrored": True}
FLAT = {"m": 0}
FAMILIES = {
    "beside both poles": (Nutating, {}),
    "beside both poles, P+, P- < 0": (Nutating, {"signs": (-1, -1), "falls": True}),
    "from u1": (Nutating, {"begin": (0, 1, 1), "signs": (1, -1)}),
    "from u2, hanging": (Nutating, {"begin": (1, 0, 1), "signs": (-1, 1)} | BELOW),
    "through the top": (Nutating, TOP),
    "through the bottom": (Nutating, BOTTOM | {"falls": True}),
    "P- = 0 below the top": (Nutating, UNDER),
    "hanging, through the top": (Nutating, BOTTOM | BELOW | {"before": True}),
    "hanging, through the bottom": (Nutating, TOP | BELOW | {"falls": True}),
    "planar swing": (Nutating, SWING),
    "planar rotation": (Nutating, OVER | {"before": True}),
    "weightless": (Nutating, FLAT),
    "weightless, P+, P- < 0": (Nutating, FLAT | {"signs": (-1, -1), "falls": True}),
    "weightless, through the top": (Nutating, FLAT | TOP),
    "weightless, through the bottom": (Nutating, FLAT | BOTTOM | {"before": True}),
    "weightless, through both": (Nutating, FLAT | OVER),
    "separatrix": (Separatrix, {}),
    "separatrix, P+ < 0": (Separatrix, {"signs": (-1, -1)}),
    "separatrix, hanging": (Separatrix, BELOW),
    "separatrix, planar": (Separatrix, {"planar": True}),
    "separatrix, planar, before the bottom": (Separatrix, {"planar": True, "before": True}),
    "steady": (Steady, {}),
    "steady, hanging": (Steady, BELOW),
    "steady, weightless": (Steady, {"weightless": True}),
    "on the vertical, up": (Steady, {"u0": 1}),
    "on the vertical, down": (Steady, {"u0": -1}),
}


def claims(family, at, n):
    """What has to vanish of a point, by name."""
    start = at.form.c.start

    def rate(x):
        return sp.diff(x, TIME)

    u, udot, uddot, phi, psi, *rates = (
        getattr(at, name).value
        for name in ("u", "udot", "uddot", "phi", "psi", "thetadot", "phidot", "psidot")
    )
    y, x = (at.theta.value / 2).args  # of the half angle: sine and cosine times √2
    yield "theta is twice an angle of sine y/√2", x**2 + y**2 - 2
    yield "u is the cosine of theta", u - (x**2 - y**2) / 2
    yield "1 - u", at.one_minus_u.value - y**2
    yield "1 + u", at.one_plus_u.value - x**2
    yield "udot", rate(u) - udot
    yield "uddot", rate(udot) - uddot
    yield "thetadot", x * rate(y) - y * rate(x) - rates[0]
    yield "phidot", rate(phi) - rates[1]
    yield "psidot", rate(psi) - rates[2]
    here = {sp.cos(lag.theta): x**2 - 1, sp.sin(lag.theta): x * y, lag.gMR: lag.A * start.g.value}
    here |= dict(zip(lag.VELOCITIES, rates, strict=True))
    here |= dict(zip(lag.ACCELERATIONS, map(rate, rates), strict=True))
    for name, equation in zip(lag.COORDINATES, lag.lagrange_equations(), strict=True):
        yield f"the Lagrange equation of {name}", equation.xreplace(here)
    kept = {"p_phi": (lag.momenta()[1], start.a), "p_psi": (lag.momenta()[2], start.b)}
    for name, (known, given) in (kept | {"E": (lag.energy(), start.energy)}).items():
        yield name, known.xreplace(here) - lag.A * given.value
    here |= {sp.cos(lag.phi): sp.cos(phi), sp.sin(lag.phi): sp.sin(phi)}
    for i in range(3):
        yield f"axis {i}", lag.axis()[i].xreplace(here) - at.axis[i].value
    yield "omega3", at.omega3.value - rates[2] - rates[1] * u
    if n == 0:
        begin = {"u": u - start.u0.value, "udot": udot - start.udot0.value, "phi": phi - PHI}
        for name, difference in (begin | {"psi": psi - PSI}).items():
            yield f"{name} at the start", family.at_start(difference)


def family_of(name):
    kind, given = FAMILIES[name]
    return kind(**given)


def check(monkeypatch, family, n=0, **code):
    for claim, difference in claims(family, family.record(monkeypatch, n, **code), n):
        assert family.vanishes(difference), claim


@pytest.mark.parametrize("n", [0, 1])
@pytest.mark.parametrize("name", FAMILIES)
def test_it_solves_the_lagrange_equations(name, n, monkeypatch):
    """Angles have the rates that are given, these solve the equations, and the start is the start.

    `1 ∓ u`, the roots of the cubic and the phase are found from two sides in the code: they are
    one. Beside the turning point n the same holds as beside that of the start, 0.
    """
    if n == 0 or FAMILIES[name][0] is Nutating:
        check(monkeypatch, family_of(name), n)


@pytest.mark.parametrize("name", ["beside both poles", "weightless"])
def test_every_nutation_is_of_the_family(name, monkeypatch):
    """The cubic of `equations` has the roots of the code: Vieta, with P± of either sign.

    So whatever nutates has the u₁, u₂ − u₁, m, w and signs of P± of a member, and is that member.
    """
    family = family_of(name)
    over, found = family.over, family.constants(monkeypatch)
    constants = {lag.p_phi: over.a, lag.p_psi: over.b, lag.E_prime: over.h, lag.gMR: over.g}
    f = lag.cubic().xreplace({x: lag.A * value.value for x, value in constants.items()})
    low, up = lag.u + 1 - found.lower[1].value, 1 - found.upper[0].value - lag.u
    last = 4 * found.w.value**2
    if found.u3 is not None:
        last = 2 * over.g.value * (found.u3.value - lag.u)
    assert family.vanishes(f - low * up * last)


@pytest.mark.parametrize("name", ["beside both poles", "from u2, hanging", "weightless"])
def test_a_period_brings_what_is_told(name, monkeypatch):
    """φ and ψ at t + T, beside the turning point n + 2, are Δφ and Δψ ahead."""
    now, later = (family_of(name) for _ in range(2))
    at, found = now.record(monkeypatch), now.found
    before = at.phi.value, at.psi.value
    gains = found.precession.value, found.spin.value
    at = later.record(monkeypatch, 2)
    for one, other, gain in zip(before, (at.phi.value, at.psi.value), gains, strict=True):
        ahead = other.xreplace({TIME: TIME + found.period.value}) - one - gain
        sweeps = {f: f.func(sp.expand(f.args[0]), *f.args[1:]) for f in ahead.atoms(Sweep)}
        assert sp.expand(ahead.xreplace(sweeps)) == 0


def test_phi_reverses_where_it_is_told(monkeypatch):
    """That long after the lower turning point φ̇ is 0: a = b u."""
    family = Nutating(signs=(1, -1))
    found = family.constants(monkeypatch)
    [F] = found.reversal.value.atoms(First)
    s2, c2, mc = F.args
    assert sp.simplify(found.reversal.value - F / found.theta.two_K * found.period.value) == 0
    assert family.vanishes(mc - found.cubic.mc.value)
    there = found.lower[1].value - 1 + found.delta.value * s2 / (s2 + c2)
    assert family.vanishes(family.over.a.value - family.over.b.value * there)


def test_the_attitude_is_that_of_the_angles(monkeypatch):
    """The quaternion is the rotation of `equations`, and ω in space its angular velocity."""
    sine, cosine, of_sum, of_difference = sp.symbols("sine cosine sigma delta", positive=True)
    family = Algebra({cosine: 1 - sine**2}, {sine: 0.6, cosine: 0.8})
    monkeypatch.setattr(Symbol, "family", family)
    for name, symbolic in (("sin_cos", Symbol.sin_cos), ("modulo_circle", Symbol)):
        monkeypatch.setattr(balls, name, symbolic)
    phi, psi = of_sum + of_difference, of_sum - of_difference
    at = object.__new__(form.Point)
    given = {
        "one_minus_u": 2 * sine**2, "one_plus_u": 2 * cosine**2, "u": 1 - 2 * sine**2,
        "sine": 2 * sine * cosine, "phi_mod": phi, "phi_sum": phi, "psi_sum": psi,
        "thetadot": lag.thetadot, "phidot": lag.phidot,
        "omega3": lag.psidot + lag.phidot * (1 - 2 * sine**2),
    }  # fmt: skip
    vars(at).update({name: Symbol(value) for name, value in given.items()} | {"N": balls})
    a, b, c, d = (x.value for x in at.quaternion)
    rotation = sp.Matrix([
        [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
        [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
        [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
    ])  # fmt: skip
    tilt = {sp.cos(lag.theta): 1 - 2 * sine**2, sp.sin(lag.theta): 2 * sine * cosine}
    turned = {
        f(x): f(value) for f in (sp.cos, sp.sin) for x, value in ((lag.phi, phi), (lag.psi, psi))
    }
    omega = sp.Matrix([x.value for x in at.omega])
    for ours, theirs in (
        (rotation, lag.rotation()), (omega, lag.rotation() * lag.angular_velocity()),
    ):  # fmt: skip
        for difference in ours - theirs.xreplace(tilt | turned):
            assert family.vanishes(lag.normal_form(sp.expand_trig(difference)))


# --- what the functions are ----------------------------------------------------------------------


class Polynomial:
    """What `cubic` has of a polynomial."""

    def __init__(self, *coefficients):
        self._coefficients = coefficients

    def degree(self):
        return len(self._coefficients) - 1

    def coeffs(self):
        return tuple(map(Symbol, self._coefficients))

    def __getitem__(self, i):
        return Symbol(self._coefficients[i])


@pytest.mark.parametrize("sign", [1, -1])
def test_the_roots_are_roots(sign, monkeypatch):
    """Of degree 1 and 2, and by Viète's cosine: 4 cos³ − 3 cos is the cosine of the triple angle.

    A polynomial and the sum of all its roots vanish with them, so none is there twice.
    """
    c, r, f0, f1, f2, f3 = sp.symbols("c r f0 f1 f2 f3", positive=True)
    middle = f1 if sign > 0 else -f1
    family = Algebra({}, {c: 0.5, r: 1.0, f0: 0.1, f1: 1.0, f2: 0.3, f3: 0.7})
    monkeypatch.setattr(Symbol, "family", family)
    monkeypatch.setattr(roots, "arb", Symbol)
    for given in ((f0, middle), (f0, middle, f2)):
        found = [x.value for x in roots._real_roots(Polynomial(*given))]
        assert len(found) == len(given) - 1
        assert family.vanishes(sum(found) + given[-2] / given[-1])
        for x in found:
            assert family.vanishes(sum(f * x**i for i, f in enumerate(given)))
    middle, last = (f2**2 - 9 * f3**2 * r**2) / (3 * f3), f0  # so that p = −3r²
    found = [x.value for x in roots._real_roots(Polynomial(last, middle, sign * f2, f3))]
    [angle] = sum(found).atoms(Angle)
    opposite, adjacent = angle.args
    triple = adjacent / (6 * sp.sqrt(3) * r**3)
    assert family.vanishes(opposite**2 + adjacent**2 - 108 * r**6)
    three = sum(found).xreplace({angle: 3 * lag.u}).replace(Cosine, sp.cos)
    assert sp.expand(sp.expand_trig(three) + sign * f2 / f3) == 0
    for i, x in enumerate(found):
        [cosine] = x.atoms(Cosine)
        assert sp.expand(3 * cosine.args[0] - angle + 2 * sp.pi * i) == 0
        x = x.xreplace({cosine: c})
        f = f3 * x**3 + sign * f2 * x**2 + middle * x + last
        assert family.vanishes(f - 2 * f3 * r**3 * (4 * c**3 - 3 * c - triple))


def test_the_first_kind_is_carlsons(monkeypatch):
    """F(φ) by R_F: with s + s2 + c2 = s2/sin²α the integrand is that of ∫ dα/√(1 − m sin²α).

    R_F(x, y, z) is half the integral of ds/√((s + x)(s + y)(s + z)) over s > 0. At s = 0 sin²α is
    sin²φ = s2/(s2 + c2), and s → ∞ is α → 0.
    """
    s2, c2, m, sine, cosine = sp.symbols("s2 c2 m sine cosine", positive=True)
    family = Algebra({cosine: 1 - sine**2}, {s2: 0.3})
    monkeypatch.setattr(Symbol, "family", family)
    monkeypatch.setattr(roots, "acb", Carlson)
    found = roots.first_kind(*map(Symbol, (s2, c2, 1 - m))).value
    [RF] = found.atoms(sp.Function)
    s = s2 / sine**2 - s2 - c2
    half = -sp.diff(s, sine) * cosine / 2 * found / RF
    product = sp.prod(s + x for x in RF.args)
    assert family.vanishes(half**2 / product - 1 / (1 - m * sine**2))


class Carlson(Symbol):
    """What the code takes for a complex ball."""

    real = property(lambda self: self)

    @staticmethod
    def elliptic_rf(x, y, z):
        return Carlson(sp.Function("RF")(x.value, y.value, z.value))


def bulirsch(mean, other, a, b, p):
    """A step of Bulirsch's sequences: of `mean` and `other`, twice the means."""
    product = mean * other
    return (
        mean + other, 2 * sp.sqrt(product), a + b / p, 2 * (b + a * product / p), p + product / p,
    )  # fmt: skip


@pytest.mark.parametrize("steps", [0, 1, 2])
def test_the_code_of_the_third_kind_takes_bulirschs_steps(steps, monkeypatch):
    """It begins with 1, k', 1, 1/√p, √p, and ends with π/2 (b + a mean)/mean (mean + p)."""
    fourth, root = sp.symbols("fourth root", positive=True)  # of m' and p
    other = fourth**2
    family = Algebra({}, {fourth: 0.1, root: 0.9})
    monkeypatch.setattr(Symbol, "family", family)
    monkeypatch.setattr(roots, "arb", Symbol)
    monkeypatch.setattr(roots, "_MOST_STEPS", steps)
    found = roots.third_kind(Symbol(other**2), Symbol(root**2)).value
    state = 1, other, 1, 1 / root, root
    for _ in range(steps):
        state = bulirsch(*state)
    mean, _, a, b, p = state
    assert family.vanishes(found - sp.pi / 2 * (b + a * mean) / (mean * (mean + p)))


def test_bulirschs_steps_keep_the_integral():
    """J = ∫ (a s² + b p)/(s² + p²) ds/√((s² + mean²)(s² + other²)) over s > 0 is kept by a step.

    With r = s − mean other/s, which runs through all numbers, ds/√… becomes half of that of the
    step; s and mean other/s, at r and −r, add up to its integrand. In the beginning s = cot α makes
    J Legendre's Π(1 − p²|1 − other²). Where the means agree, J is what the code ends with.
    """
    s, mean, other, a, b, p, sine, cosine = sp.symbols(
        "s mean other a b p sine cosine", positive=True
    )
    product = mean * other
    family = Algebra({cosine: 1 - sine**2}, {})

    def weight(s, mean, other, *_):
        return 1 / ((s**2 + mean**2) * (s**2 + other**2))  # squared

    def part(s, a, b, p):
        return (a * s**2 + b * p) / (s**2 + p**2)

    r, after = s - product / s, bulirsch(mean, other, a, b, p)
    assert family.vanishes(weight(s, mean, other) - weight(r, *after) * sp.diff(r, s) ** 2)
    assert family.vanishes(part(s, a, b, p) + part(product / s, a, b, p) - part(r, *after[2:]))
    cot = cosine / sine
    rate = 1 / sine**2  # −ds/dα
    squared = weight(cot, 1, other) * part(cot, 1, 1 / p, p) ** 2 * rate**2
    legendre = (1 - (1 - p**2) * sine**2) ** 2 * (1 - (1 - other**2) * sine**2)
    assert family.vanishes(squared - 1 / legendre)
    # partial fractions, each of which brings π/2 over its root
    one, two = a * mean**2 - b * p, b * p - a * p**2
    assert family.vanishes(
        part(s, a, b, p) / (s**2 + mean**2)
        - (one / (s**2 + mean**2) + two / (s**2 + p**2)) / (mean**2 - p**2)
    )
    integral = sp.pi / 2 * (one / mean + two / p) / (mean**2 - p**2)
    assert family.vanishes(integral - sp.pi / 2 * (b + a * mean) / (mean * (mean + p)))


def test_the_rate_of_the_argument():
    """The rate of arg iθ₁(x − iβ) is π + c (E − Ē), E = 1/(1 − N sn² 2Kx), with Ē its mean.

    θ₁ has simple zeros, at the lattice alone, and θ₁'/θ₁ is periodic in 1 and changes by −2πi with
    iτ. So the rate, (θ₁'/θ₁ (x − iβ) − θ₁'/θ₁ (x + iβ))/2i, has both periods; its poles are ±iβ,
    simple, with residues ±1/2i. E has poles there too, where sn² = 1/N, and no others, for sn²
    takes a value twice; they are simple, as sn cn dn is not 0. If c E has the same residues, then
    the difference has no pole, and is a constant by Liouville's theorem. The mean of the rate is π:
    θ₁(x + 1) = −θ₁(x), and the argument grows as that of sin πx, which θ₁ becomes for q → 0. With
    the means the constant is known. For m = 0 all of it holds by continuity.

    At 2Kx = iv, v = 2Kβ, Jacobi's imaginary transformation says sn = i S/C, cn = 1/C and dn = D/C,
    with S, C and D those of v and 1 − m; and S²/C² = s2/c2 of the code's v = F.
    """
    S, C, D, K, m, s2, c2 = sp.symbols("S C D K m s2 c2", positive=True)
    family = Algebra({D: 1 - (1 - m) * S**2, C: 1 - S**2}, {})
    sn, cn, dn = sp.I * S / C, 1 / C, D / C
    for identity in (sn**2 + cn**2 - 1, m * sn**2 + dn**2 - 1):
        assert family.vanishes(sp.expand(identity))
    N, c = -(C**2) / S**2, 2 * K * D / (S * C)
    assert sp.cancel(N * sn**2) == 1
    slope = -2 * N * sn * cn * dn * 2 * K  # of 1/E
    assert sp.cancel(c / slope - 1 / (2 * sp.I)) == 0
    of_code = (c2 + m * s2) * (s2 + c2) / (s2 * c2)
    assert family.vanishes((2 * K) ** 2 * of_code.subs({s2: S**2, c2: C**2}) - c**2)


def test_the_rate_of_the_argument_in_balls():
    """The same of the code's own functions, and sn' = cn dn, at 40 random points, within 1e-380."""
    source = random.Random(1)
    with working(1400):
        for _ in range(40):
            m, s2, x = (arb(source.randint(1, 10**6)) / (10**6 + 1) for _ in range(3))
            mc, c2, x = 1 - m, 1 - s2, (x - 0.5) / 2
            K = arb.pi() / (2 * arb(1).agm(mc.sqrt()))
            tau = arb(1).agm(mc.sqrt()) / arb(1).agm(m.sqrt())
            beta = roots.first_kind(s2, c2, m) / (2 * K)
            z = acb(x, -beta)
            first, slope = (acb.modular_theta(z, acb(0, tau), n)[0] for n in (0, 1))
            series = theta.Theta(m, mc, 1400)
            at = balls.argument(series.scale * 2 * K * x, series.hyperbolic)
            under, *over = (series.function(balls, False, which)(*at) for which in range(4))
            sn, cn, dn = (each / under for each in over)
            (one, four), (rise, fall) = (
                (found[0].real, found[3].real)
                for found in (acb.modular_theta(acb(x), acb(0, tau), n) for n in (0, 1))
            )
            relative = rise / one - fall / four  # sn is θ₁/θ₄, but for a constant
            N = -c2 / s2
            c = 2 * K * ((c2 + m * s2) * (s2 + c2) / (s2 * c2)).sqrt()
            mean = roots.third_kind(mc, 1 - N) / K
            off = (slope / first).imag - arb.pi() - c * (1 / (1 - N * sn * sn) - mean)
            of_sn = relative * sn - 2 * K * cn * dn
            for each in (off, of_sn, sn * sn + cn * cn - 1, m * sn * sn + dn * dn - 1):
                assert each.contains(0)
                assert each.rad() < arb(10) ** -380


def test_the_polynomials_are_the_terms_of_the_theta_functions():
    """sin (2k+1)y/S, cos (2k+1)y/C, cos 2ky and sin 2ky/SC in S² = sin² y."""
    last = 30
    x = sp.Symbol("x")  # exp 2iy, by powers of which polynomials are compared
    v = sp.Poly(2 * x - 1 - x**2, x)  # 4 x sin² y

    def sums(factors, n, power):
        """The polynomial times x to a power."""
        row = map(int, theta.multiples(factors, last + 1).tolist()[n])
        terms = (
            c * v**i * sp.Poly(x ** (power - i), x) * sp.Rational(1, 4**i)
            for i, c in enumerate(row)
            if c
        )
        return sum(terms, sp.Poly(0, x, domain=sp.QQ)).set_domain(sp.QQ)

    def whole(*coefficients):
        return sp.Poly(coefficients, x, domain=sp.QQ)

    for n in range(last + 1):
        assert sums("S", n, n) == whole(*[1] * (2 * n + 1))
        assert sums("C", n, n) == whole(*[(-1) ** i for i in range(2 * n + 1)])
        assert 2 * sums("", n, n) == (whole(1, *[0] * (2 * n - 1), 1) if n else whole(2))
        if n:  # (x²ⁿ − 1)/(x² − 1) of sin 2ny/sin 2y, and sin 2y is 2 SC
            assert sums("SC", n, n - 1) == 2 * whole(*[(i + 1) % 2 for i in range(2 * n - 1)])


# --- planted errors ------------------------------------------------------------------------------

PLANTED = {
    "theta falls where it rises": ("planar rotation", "-2 * r.side", "2 * r.side"),
    "thetadot without dn": ("planar rotation", "r.form.w * r.dn * r.top", "r.form.w * r.top"),
    "m in uddot": ("planar rotation", "- form.m * (s * s", "+ form.m * (s * s"),
    "another K": ("planar rotation", "arb(1).agm(roots.mc.sqrt())", "arb(1).agm(roots.m.sqrt())"),
    "half the period": ("weightless", "2 * self.K / roots.w", "self.K / roots.w"),
    "the phase from the wrong end": (
        "planar rotation",
        "_since_lower(roots.down, roots.up)",
        "_since_lower(roots.up, roots.down)",
    ),
    "psi turns with phi": ("weightless", "r.side * (r.swept[0] - r", "r.side * (r.swept[0] + r"),
    "psi without its spin": ("weightless", "(c.angles[1], c.start.kappa", "(c.angles[1], arb(0)"),
    "the other pole's distance": (
        "weightless",
        "self.c.halves[::-1], (self.c.upper[0], self.c.lower[1])",
        "self.c.halves[::-1], (self.c.lower[0], self.c.lower[1])",
    ),
    "its mean counted twice": ("weightless", "turn - 2 * step", "turn - step"),
    "sine for cosine of the pole": ("weightless", "(low1, self.delta)", "(self.delta, low1)"),
    "the third kind upside down": ("weightless", "at_u2 / at_u1", "at_u1 / at_u2"),
    "m' for m at the pole": (
        "P- = 0 below the top",
        "first_kind(*pole, self.m)",
        "first_kind(*pole, self.cubic.mc)",
    ),
    "x0 twice as steep": ("separatrix", "udot0 / (2 * self.w", "udot0 / (self.w"),
    "the wrong growth": ("separatrix", "self.delta / 2).sqrt()", "self.delta).sqrt()"),
    "the arctangent of 1/r": ("separatrix", "(low1 / high1).sqrt()", "(high1 / low1).sqrt()"),
    "half a spin too much": ("on the vertical, up", "(b / 2, -b / 2)", "(b, -b / 2)"),
    "a steady cone at another rate": ("steady", "plus / (2 * low1)", "plus / low1"),
    "a modulus of the wrong roots": ("planar swing", "f3 * delta / reach", "f3 * delta / lead"),
    "twice w": ("planar swing", "reach.sqrt() / 2", "reach.sqrt()"),
    "Vieta with P+ for P-": (
        "weightless",
        "over.P_minus * over.P_minus / minus1",
        "over.P_plus**2 / minus1",
    ),
    "Vieta, 1 + u2 for 1 - u2": ("weightless", "over.one_plus_u0 + up", "over.one_plus_u0 - up"),
}


@pytest.mark.parametrize("error", PLANTED)
def test_a_planted_error_is_found(error, monkeypatch):
    """One place of the code is changed, as it would be by a slip, and nothing vanishes any more."""
    name, right, wrong = PLANTED[error]
    codes = {"constants": constants, "form": form, "roots": roots}
    [of] = [of for of, code in codes.items() if right in inspect.getsource(code)]
    source = inspect.getsource(codes[of])
    assert source.count(right) == 1
    changed = ModuleType(codes[of].__name__)
    monkeypatch.setitem(sys.modules, changed.__name__, changed)  # where dataclasses look
    exec(compile(source.replace(right, wrong), error, "exec"), vars(changed))
    with pytest.raises(AssertionError):
        check(monkeypatch, family_of(name), **{of: changed})


@pytest.mark.parametrize("order", [(1, 0, 2), (0, 2, 1)])
def test_roots_in_another_order_are_found_too(order, monkeypatch):
    family = Nutating()
    family.distances = tuple(family.distances[i] for i in order)
    with pytest.raises((AssertionError, ValueError)):  # some root is no number of the family
        check(monkeypatch, family)
