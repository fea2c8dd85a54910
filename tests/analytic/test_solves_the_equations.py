"""The closed form solves the Lagrange equations: proved by algebra.

`symbols` runs the code of `analytic/solution` and `analytic/cubic` on expressions, one family of
motions after another. θ, φ and ψ are put into what `equations/lagrangian` derives, and what is left
is the polynomial 0, whatever the constants of the motion and the time are. No residual is small.
"""

import inspect
import random
from types import ModuleType

import pytest
import sympy as sp
from flint import acb, arb

from heavytop.analytic import cubic, elliptic, solution
from heavytop.equations import lagrangian as lag
from heavytop.exact.balls import working

from .symbols import (
    HALF,
    PHI,
    PSI,
    TIME,
    Algebra,
    Angle,
    Argument,
    Cn,
    Cosine,
    First,
    Nutating,
    Separatrix,
    Sn,
    Steady,
    Symbol,
    Whole,
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


def claims(family, found):
    """What has to vanish of a solution, by name."""
    at, start = found.at(Symbol(TIME)), found.start

    def rate(x):
        return sp.diff(x, TIME)

    u, udot, uddot, phi, psi, *rates = (
        getattr(at, name).value
        for name in ("u", "udot", "uddot", "phi", "psi", "thetadot", "phidot", "psidot")
    )
    y, x = (at.theta.value / 2).args  # of the half angle: sine and cosine times √2
    yield "theta alone", found.theta(Symbol(TIME)).value - at.theta.value
    yield "u alone", found.u(Symbol(TIME)).value - u
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
    begin = {"u": u - start.u0.value, "udot": udot - start.udot0.value, "phi": phi - PHI}
    for name, difference in (begin | {"psi": psi - PSI}).items():
        yield f"{name} at the start", family.at_start(difference)


def family_of(name):
    kind, given = FAMILIES[name]
    return kind(**given)


def check(monkeypatch, family, **code):
    for claim, difference in claims(family, family.solution(monkeypatch, **code)):
        assert family.vanishes(difference), claim


@pytest.mark.parametrize("name", FAMILIES)
def test_it_solves_the_lagrange_equations(name, monkeypatch):
    """Angles have the rates that are told, these solve the equations, and the start is the start.

    `1 ∓ u`, the roots of the cubic and the phase are met from two sides in the code: they are one.
    """
    check(monkeypatch, family_of(name))


@pytest.mark.parametrize("name", ["beside both poles", "weightless"])
def test_every_nutation_is_of_the_family(name, monkeypatch):
    """The cubic of `equations` has the roots of the code: Vieta, with P± of either sign.

    So whatever nutates has the u₁, u₂ − u₁, m, w and signs of P± of a member, and is that member.
    """
    family = family_of(name)
    over, path = family.over, family.solution(monkeypatch).path
    constants = {lag.p_phi: over.a, lag.p_psi: over.b, lag.E_prime: over.h, lag.gMR: over.g}
    f = lag.cubic().xreplace({x: lag.A * value.value for x, value in constants.items()})
    low, up = lag.u + 1 - path.roots.one_plus_u1.value, 1 - path.roots.one_minus_u2.value - lag.u
    last = 4 * path.w.value**2
    if path.third is not None:
        last = 2 * over.g.value * (path.third.value - lag.u)
    assert family.vanishes(f - low * up * last)


@pytest.mark.parametrize(
    ("name", "poles"),
    [
        ("through the top", 1),
        ("through the bottom", 1),
        ("planar rotation", 2),
        ("planar swing", 1),
    ],
)
def test_the_attitude_goes_on_through_a_pole(name, poles, monkeypatch):
    """√(1 − u) exp iΦ₋ and √(1 + u) exp iΦ₊ are −i size cn and i size sn of w t + x₀, all along.

    At the top Φ₋ is π (j + ½), where j = floor(x − ½) of x = (w t + x₀)/2K. So exp iΦ₋ is i (−1)ʲ,
    and √(1 − u) is size cn 2K(x − j − 1), which is not negative, or −(−1)ʲ size cn 2Kx. At the
    bottom j is floor x, and √(1 + u) is size |sn 2Kx|, or (−1)ʲ size sn 2Kx. By these products and
    κt the attitude is given (Cayley and Klein): it has no jump, and they have every derivative.
    """
    path = family_of(name).solution(monkeypatch).path
    x, found = path.periods(Symbol(TIME)), 0
    for half, distance in zip(path.halves[::-1], path.tilt(Symbol(TIME)), strict=True):
        if not isinstance(half, solution.Jumps) or half.turn.is_zero():
            continue
        j, function = Whole(sp.expand((x - half.own).value)), Cn if half.own.value else Sn
        jumps = half(x).value.replace(Whole, lambda y: Whole(sp.expand(y)))
        assert sp.expand(jumps - sp.pi * (j + HALF)) == 0
        [f] = distance.value.atoms(function)
        assert distance.value**2 == path.size.value**2 * f**2
        found += 1
    assert found == poles
    if path.reaches_top:
        shown = path.place(Symbol(TIME)).from_top.value
        [f] = shown.atoms(Cn)
        shift = sp.expand(f.args[0] / path.jacobi.two_K - x.value)
        [cell] = shift.atoms(Whole)
        assert shown == path.size.value * f
        assert shift == -cell
        assert sp.expand(cell.args[0] - x.value) == HALF  # floor(x + ½) is floor(x − ½) + 1


@pytest.mark.parametrize("name", ["beside both poles", "from u2, hanging", "weightless"])
def test_a_period_brings_what_is_told(name, monkeypatch):
    """φ and ψ at t + T, where whole numbers of periods are larger by 1, are Δφ and Δψ ahead."""
    found = family_of(name).solution(monkeypatch)
    at = found.at(Symbol(TIME))
    later = TIME + found.path.period.value

    def written(x, ahead=0):
        """With arguments expanded, and a whole number less in those of whole numbers."""
        x = x.replace(Whole, lambda y: Whole(sp.expand(y - (ahead if y.has(TIME) else 0))))
        x = x.xreplace({f: f + ahead for f in x.atoms(Whole) if f.has(TIME)})
        return sp.expand(x.replace(Argument, lambda y, *rest: Argument(sp.expand(y), *rest)))

    for angle, gain in zip((at.phi.value, at.psi.value), found.turned, strict=False):
        ahead = written(angle.xreplace({TIME: later}), 1)
        assert sp.expand(ahead - written(angle) - gain.value) == 0


def test_phi_reverses_where_it_is_told(monkeypatch):
    """That long after the lower turning point φ̇ is 0: a = b u."""
    family = Nutating(signs=(1, -1))
    path = family.solution(monkeypatch).path
    [F] = path.reversal.value.atoms(First)
    s2, c2, mc = F.args
    assert path.reversal.value == F / path.jacobi.two_K
    assert family.vanishes(mc - path.roots.mc.value)
    there = path.roots.one_plus_u1.value - 1 + path.roots.delta.value * s2 / (s2 + c2)
    assert family.vanishes(family.over.a.value - family.over.b.value * there)


def test_the_attitude_is_that_of_the_angles(monkeypatch):
    """The quaternion is the rotation of `equations`, and ω in space its angular velocity."""
    sine, cosine, of_sum, of_difference = sp.symbols("sine cosine sigma delta", positive=True)
    family = Algebra({cosine: 1 - sine**2}, {sine: 0.6, cosine: 0.8})
    monkeypatch.setattr(Symbol, "family", family)
    monkeypatch.setattr(solution, "arb", Symbol)
    phi, psi = of_sum + of_difference, of_sum - of_difference
    omega3 = lag.psidot + lag.phidot * (1 - 2 * sine**2)
    given = (
        0, lag.theta, phi, psi, *lag.VELOCITIES, 1 - 2 * sine**2, 2 * sine**2, 2 * cosine**2, 0, 0,
    )  # fmt: skip
    at = solution.ExactRecord(*map(Symbol, given), axis=(), n=0, omega3=Symbol(omega3))
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
    monkeypatch.setattr(cubic, "arb", Symbol)
    for given in ((f0, middle), (f0, middle, f2)):
        roots = [x.value for x in cubic._real_roots(Polynomial(*given))]
        assert len(roots) == len(given) - 1
        assert family.vanishes(sum(roots) + given[-2] / given[-1])
        for x in roots:
            assert family.vanishes(sum(f * x**i for i, f in enumerate(given)))
    middle, last = (f2**2 - 9 * f3**2 * r**2) / (3 * f3), f0  # so that p = −3r²
    roots = [x.value for x in cubic._real_roots(Polynomial(last, middle, sign * f2, f3))]
    [angle] = sum(roots).atoms(Angle)
    opposite, adjacent = angle.args
    triple = adjacent / (6 * sp.sqrt(3) * r**3)
    assert family.vanishes(opposite**2 + adjacent**2 - 108 * r**6)
    three = sum(roots).xreplace({angle: 3 * lag.u}).replace(Cosine, sp.cos)
    assert sp.expand(sp.expand_trig(three) + sign * f2 / f3) == 0
    for i, x in enumerate(roots):
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
    monkeypatch.setattr(elliptic, "acb", Carlson)
    found = elliptic.first_kind(*map(Symbol, (s2, c2, 1 - m))).value
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
    monkeypatch.setattr(elliptic, "arb", Symbol)
    monkeypatch.setattr(elliptic, "_MOST_STEPS", steps)
    found = elliptic.third_kind(Symbol(other**2), Symbol(root**2)).value
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
            mc, c2, x = 1 - m, 1 - s2, x - 0.5
            K = arb.pi() / (2 * arb(1).agm(mc.sqrt()))
            tau = arb(1).agm(mc.sqrt()) / arb(1).agm(m.sqrt())
            beta = elliptic.first_kind(s2, c2, m) / (2 * K)
            z = acb(x, -beta)
            theta, slope = (acb.modular_theta(z, acb(0, tau), n)[0] for n in (0, 1))
            sn, cn, dn = elliptic.Jacobi(tau).functions(x)
            (one, four), (rise, fall) = (
                (found[0].real, found[3].real)
                for found in (acb.modular_theta(acb(x), acb(0, tau), n) for n in (0, 1))
            )
            relative = rise / one - fall / four  # sn is θ₁/θ₄, but for a constant
            N = -c2 / s2
            c = 2 * K * ((c2 + m * s2) * (s2 + c2) / (s2 * c2)).sqrt()
            mean = elliptic.third_kind(mc, 1 - N) / K
            off = (slope / theta).imag - arb.pi() - c * (1 / (1 - N * sn * sn) - mean)
            of_sn = relative * sn - 2 * K * cn * dn
            for each in (off, of_sn, sn * sn + cn * cn - 1, m * sn * sn + dn * dn - 1):
                assert each.contains(0)
                assert each.rad() < arb(10) ** -380


def test_the_polynomials_are_the_terms_of_the_theta_functions():
    """(−1)ᵏ sin (2k + 1)y/sin y and (−1)ᵏ 2 cos 2ky in v = sin² y, as DLMF 20.2 has them."""
    last = 30
    columns = [matrix.transpose().table() for matrix in elliptic._multiples(last)]
    x = sp.Symbol("x")  # exp 2iy, by powers of which polynomials are compared
    v = sp.Poly(2 * x - 1 - x**2, x)  # 4 x v
    for n in range(last + 1):
        odd, even = (
            sum(
                (int(rows[n][i].unique_fmpz()) * v**i * sp.Poly(x ** (n - i), x) * 4 ** (n - i)
                 for i in range(n + 1)),
                sp.Poly(0, x),
            )
            for rows in columns
        )  # fmt: skip
        sines = sp.Poly([1] * (2 * n + 1), x)  # xᵏ sin (2k + 1)y/sin y
        cosines = sp.Poly(x ** (2 * n) + 1, x) if n else sp.Poly(1, x)
        assert odd == (-1) ** n * 4**n * sines
        assert even == (-1) ** n * 4**n * cosines


# --- planted errors ------------------------------------------------------------------------------

PLANTED = {
    "theta falls where it rises": ("planar rotation", "-side * place.rise,", "side * place.rise,"),
    "udot without dn": ("planar rotation", "self.w * dn * across", "self.w * across"),
    "the weight in uddot": ("planar rotation", "- start.g * sine**2", "+ start.g * sine**2"),
    "another K": ("planar rotation", "(2 * arb(1).agm(roots.mc.", "(2 * arb(1).agm(roots.m."),
    "half the period": ("planar rotation", "arb = 2 * self.K /", "arb = self.K /"),
    "1 - m for m": (
        "planar rotation",
        "arb(1).agm(roots.mc.sqrt()) / arb(1).agm(roots.m.sqrt())",
        "arb(1).agm(roots.m.sqrt()) / arb(1).agm(roots.mc.sqrt())",
    ),
    "the phase from the wrong end": (
        "planar rotation",
        "_since_lower(roots.down, roots.up)",
        "_since_lower(roots.up, roots.down)",
    ),
    "psi turns with phi": ("weightless", "side * (place.plus - place.minus)\n", "place.plus\n"),
    "psi without its spin": ("weightless", "self.psi0 + start.kappa * t", "self.psi0"),
    "the other pole's distance": (
        "weightless",
        "P_minus / (2 * from_top * from_top)",
        "P_minus / (2 * from_bottom**2)",
    ),
    "the angle swept backwards": ("weightless", "x + self.swept(x)", "x - self.swept(x)"),
    "its mean counted twice": (
        "weightless",
        "self.sign * arb.pi()\n",
        "2 * self.sign * arb.pi()\n",
    ),
    "sine for cosine of the pole": (
        "weightless",
        "roots.one_plus_u1, roots.delta\n",
        "roots.delta, roots.one_plus_u1\n",
    ),
    "the other turning point": ("weightless", "pole, arb(0.5)", "pole, arb(0)"),
    "the third kind upside down": ("weightless", "at_u2 / at_u1", "at_u1 / at_u2"),
    "m' for m at the pole": (
        "P- = 0 below the top",
        "self._pole, self.path.roots.m)",
        "self._pole, self.path.roots.mc)",
    ),
    "x0 twice as steep": ("separatrix", "(over.udot0 / (2 *", "(over.udot0 / ("),
    "the wrong growth": (
        "separatrix",
        "self.one_minus_u1 / 2).sqrt()",
        "self.one_minus_u1).sqrt()",
    ),
    "sech for tanh": ("separatrix", "x.tanh(), x.sech(), x.sech()", "x.sech(), x.tanh(), x.tanh()"),
    "the arctangent of 1/r": ("separatrix", "size / floor * x", "floor / size * x"),
    "half a spin too much": (
        "on the vertical, up",
        "return self.over.b / 2, -",
        "return self.over.b, -",
    ),
    "a steady cone at another rate": ("steady", "plus * t, minus", "2 * plus * t, minus"),
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
    codes = {"code": solution, "roots": cubic}
    [of] = [of for of, code in codes.items() if right in inspect.getsource(code)]
    source = inspect.getsource(codes[of])
    assert source.count(right) == 1
    changed = ModuleType(codes[of].__name__)
    exec(compile(source.replace(right, wrong), error, "exec"), vars(changed))
    with pytest.raises(AssertionError):
        check(monkeypatch, family_of(name), **codes | {of: changed})


@pytest.mark.parametrize("order", [(1, 0, 2), (0, 2, 1)])
def test_roots_in_another_order_are_found_too(order, monkeypatch):
    family = Nutating()
    family.distances = tuple(family.distances[i] for i in order)
    with pytest.raises(AssertionError):
        check(monkeypatch, family)
