"""The closed form in mpmath against exact published states and against the rigid-body equations.

The equations are integrated here by their own Taylor series at 40 digits, in the form that has
no pole: the axis e, the momentum ℓ = L/A and one more body vector v,

    ė = ℓ × e,   ℓ̇ = −g e × ẑ,   v̇ = (ℓ + κ e) × v,   κ = p_ψ (1/C − 1/A).
"""

import random
from fractions import Fraction

import pytest

from heavytop.analytic.theory.closed_form import MPForm
from heavytop.analytic.theory.reduced import Reduced
from heavytop.analytic.theory.theta_functions import Functions, Lattice
from heavytop.numbers.decimals import context

CTX = context(60)
WORK = context(45)
SICM = (Fraction("3.28e-4"), Fraction("6.6e-5"), Fraction("0.0456"))
LIE = (Fraction("15.234375"), Fraction("0.46875"), Fraction("147.15"))
SIMO = (5, 1, 20)
ROOT3 = CTX.sqrt(3)


def start(top, theta, phidot, psidot, thetadot=0, phi=0, psi=0, omega3=None):
    return Reduced.from_angles(CTX, *top, theta, phi, psi, thetadot, phidot, psidot, omega3=omega3)


def angles(record):
    return record.theta, record.phi, record.psi


# cases of SICM §2.10 and of Simo & Wong 1991: closed form at 50 digits for the decimals as
# printed, cross-checked by an independent integrator. phidot, spin, t, T, Δφ, θ, φ, ψ
PUBLISHED = [
    (SICM, "0.1", -15, {"psidot": 140}, 2, "0.54289551818821995785", "3.9741816546440002896",
     ("0.42694370530965690245", "15.116964095456707822", "236.55741389988304583")),
    (SICM, "0.1", 0, {"psidot": 140}, 2, "0.40140587019470118608", "2.5447045765778085269",
     ("0.10034197801825827725", "12.723297224661743492", "267.43844510670482409")),
    (SICM, "0.1", 15, {"psidot": 140}, 2, "0.30707767486330860938", "1.6506667427855664099",
     ("0.0073402039616035999567", "10.202056212530240399", "299.71994163326388011")),
    (SICM, "0.1", 15, {"omega3": 140}, 2, "0.40519342773311807625", "8.8559785436360372515",
     ("0.097999175790862108505", "43.890088225010207381", "236.1891611362196391")),
    (SIMO, "0.05", 0, {"psidot": 50}, 10, "0.6854584972896153183", "0.28610768780066136647",
     ("0.054220099402661058193", "4.1961910407406375175", "495.80979342433535177")),
    (SIMO, "0.3", 0, {"psidot": 50}, 10, "0.68225601583118194041", None,
     ("0.32090876129521087044", "4.1996398174746437151", "496.01365314730270421")),
]  # fmt: skip


@pytest.mark.parametrize(("top", "theta", "phidot", "spin", "t", "T", "turn", "end"), PUBLISHED)
def test_published_states_to_their_last_digit(top, theta, phidot, spin, t, T, turn, end):
    form = MPForm(
        start(top, Fraction(theta), phidot, spin.get("psidot", 0), omega3=spin.get("omega3")), 30
    )
    ctx = form.ctx
    assert abs(form.period - ctx.mpf(T)) < ctx.mpf("1e-20")
    if turn is not None:
        assert abs(form.precession - ctx.mpf(turn)) < ctx.mpf("1e-18")
    for got, want in zip(angles(form(t)), end, strict=True):
        assert abs(got - ctx.mpf(want)) < ctx.mpf("2e-20") * max(1, 10 * abs(got))


# axis and spatial ω of the Lie-group benchmark, 50 digits, cross-checked
LIE_STATES = {
    "0.01": ("0.046113597053992541", "0.99893500360930237", "-0.001547491785141019",
             "6.6076510932350919", "149.84739395407446", "-4.8403614979935789"),
    "0.2": ("0.60555056137711977", "0.59895768179491916", "-0.52398302743000318",
            "86.371693257061342", "92.431658122002961", "-80.794450910977386"),
    "1": ("0.17334396409838604", "0.64008859207056878", "-0.74849079113358131",
          "20.139786505764021", "96.243343865826055", "-113.43442578788221"),
    "2": ("-0.15041682274564176", "-0.72416559163689565", "-0.6730222695604441",
          "-27.658515525823269", "-106.16380414312445", "-102.4624638053261"),
    "10": ("-0.37014419157311039", "0.033503155579024894", "-0.92836997797803447",
           "-55.258126364176586", "-1.2241186281995731", "-139.5860921829604"),
}  # fmt: skip


@pytest.mark.parametrize("t", LIE_STATES)
def test_lie_group_benchmark(t):
    """The axis and ω = θ̇ n̂ + φ̇ ẑ + ψ̇ e of the benchmark, to every printed digit."""
    form = MPForm(start(LIE, CTX.pi / 2, Fraction("-4.61538"), 150, phi=CTX.pi), 30)
    ctx, at = form.ctx, form(Fraction(t))
    node = ctx.cos(at.phi), ctx.sin(at.phi), 0
    spin = [at.thetadot * node[i] + at.psidot * at.axis[i] for i in range(3)]
    spin[2] += at.phidot
    for got, want in zip((*at.axis, *spin), map(ctx.mpf, LIE_STATES[t]), strict=True):
        assert abs(got - want) < ctx.mpf("1e-16") * max(1, abs(want))
    assert abs(form.period - ctx.mpf("0.74520694761676905573")) < ctx.mpf("1e-20")
    assert abs(form.precession - ctx.mpf("0.6810111281938199783")) < ctx.mpf("1e-19")


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
    A, C, gMR, th, ph, ps, thd, phd, psd = (WORK.mpf(1) * WORK.mpmathify(x) for x in args)
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


ROOT3W = WORK.sqrt(3)
MOTIONS = {
    "loops": (2, 1, 3, 0.5, 0.3, -0.7, 0, -2, 5),
    "rising": (2, 1, 3, 1.5, 0.3, -0.7, -1, 0.5, 3),
    "falling": (2, 1.5, 3, 1.5, 0.3, -0.7, 1, 0.5, 3),
    "cusps": (2, 1, 3, 0.5, 0, 0, 0, 0, 7),
    "prolate to the limit": (1, 2, 3, 1.0, 1, 2, 0.5, 1, 3),
    "spherical top": (2, 2, 3, 1.0, 1, 2, 0.5, 1, 3),
    "slender": (1, 0.001, 3, 1.0, 1, 2, 0.5, 1, 300),
    "spherical pendulum": (2, 1, 3, 1.0, 0.2, 0.1, 0.4, 1.25, -1.25 * WORK.cos(1)),
    "past the bottom": (2, 1, 3, 2.5, 0, 0, 1, 0.01, 0.02),
    "past the top": (2, 1, 3, 0.01, 0, 0, 2, 0.5, 0.7),
    "hanging upside down": (2, 1, -3, 0.5, 0.3, -0.7, 0.25, -2, 5),
    "force-free": (2, 1, 0, 0.5, 0.3, -0.7, 0.25, -2, 5),
    "through the top": (2, 1, 3, 0, 0.3, -0.7, 3, 0, 2),
    "through the top, backwards": (2, 1, 3, 0, 0.3, -0.7, -3, 0, 2),
    "through the top, upside down": (2, 1, -3, 0, 0.3, -0.7, 1, 0, 2),
    "planar swing": (2, 1, 3, 2.5, 0.3, -0.7, 0.5, 0, 0),
    "planar from rest": (2, 1, 3, 0.5, 0.3, -0.7, 0, 0, 0),
    "planar rotation": (2, 1, 3, 2.5, 0.3, -0.7, 5, 0, 0),
    "planar rotation, backwards": (2, 1, 3, 2.5, 0.3, -0.7, -5, 0, 0),
    "sleeping": (2, 1, 3, 0, 0.3, -0.7, 0, 0, 2),
    "separatrix": (2, 1, 2, WORK.pi / 3, 0.3, -0.7, 0, 2 / ROOT3W, 5 / ROOT3W),
    "separatrix, leaving": (
        2, 1, 2, WORK.acos(WORK.mpf(4) / 5), 0, 0,  # p_φ = p_ψ = 2 and E' = gMR
        WORK.sqrt(WORK.mpf(26) / 90), WORK.mpf(5) / 9, WORK.mpf(14) / 9,
    ),
    "uniform": (Fraction("6.375e-3"), Fraction("7.5e-4"), Fraction("0.73575"),
                WORK.pi / 3, 0.3, -0.7, 0, 10, Fraction("135.6")),
}  # fmt: skip


def as_work(value):
    if isinstance(value, Fraction):
        return WORK.mpf(value.numerator) / value.denominator
    return value


@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("t", ["1.7", "-0.9"])
def test_closed_form_solves_the_rigid_body_equations(name, t):
    """Axis and a body vector agree to 1e-33 with the equations integrated at 40 digits."""
    args = tuple(as_work(value) for value in MOTIONS[name])
    form = MPForm(Reduced.from_angles(context(60), *args), 40)
    at = form(WORK.mpf(t))
    e, _, v = integrate(*body(args), WORK.mpf(t))
    got_e, got_v = attitude(
        *(WORK.mpf(1) * WORK.make_mpf(x._mpf_) for x in (at.phi, at.theta, at.psi))
    )
    distance = max(abs(a - b) for a, b in zip((*e, *v), (*got_e, *got_v), strict=True))
    assert distance < WORK.mpf("1e-33")
    assert max(abs(a - b) for a, b in zip(e, at.axis, strict=True)) < WORK.mpf("1e-33")


def test_random_tops_solve_the_rigid_body_equations():
    """The same for tops drawn at random, either sign of gMR."""
    draw = random.Random(20121)
    for _ in range(6):
        A = draw.uniform(0.5, 2)
        args = (A, A * draw.uniform(0.01, 2), draw.uniform(-5, 5), draw.uniform(0.01, 3.1),
                draw.uniform(-3, 3), draw.uniform(-3, 3), draw.uniform(-2, 2),
                draw.uniform(-4, 4), draw.uniform(-8, 8))  # fmt: skip
        at = MPForm(Reduced.from_angles(context(60), *args), 40)(WORK.mpf("1.25"))
        e, _, v = integrate(*body(args), WORK.mpf("1.25"))
        got = attitude(*(WORK.make_mpf(x._mpf_) for x in (at.phi, at.theta, at.psi)))
        assert max(abs(a - b) for a, b in zip((*e, *v), (*got[0], *got[1]), strict=True)) < 1e-33


@pytest.mark.parametrize("name", [n for n in MOTIONS if not n.startswith(("through", "planar"))])
def test_rates_are_derivatives(name):
    """θ̇, φ̇, ψ̇, u̇ against central differences of the angles, to 1e-18 of their size."""
    form = MPForm(Reduced.from_angles(CTX, *map(as_work, MOTIONS[name])), 60)
    ctx, h = form.ctx, form.ctx.mpf("1e-12")
    for t in map(ctx.mpf, ("-0.8", "0.3", "2.1")):
        before, at, after = form(t - h), form(t), form(t + h)
        for field in ("theta", "phi", "psi", "u"):
            slope = (getattr(after, field) - getattr(before, field)) / (2 * h)
            rate = getattr(at, field + "dot")
            assert abs(slope - rate) < 1e-18 * max(1, abs(rate)) ** 3, field


def test_start_is_the_start():
    """At t = 0 every angle and rate is the given one."""
    for name, args in MOTIONS.items():
        form = MPForm(Reduced.from_angles(CTX, *map(as_work, args)), 30)
        at = form(0)
        given = [form.ctx.mpf(1) * form.ctx.mpmathify(as_work(v)) for v in args[3:]]
        got = [at.theta, at.phi, at.psi, at.thetadot, at.phidot, at.psidot]
        if name.startswith("through"):
            continue  # φ and ψ, and their rates, have no value of their own on a pole
        for one, other in zip(got, given, strict=True):
            assert abs(one - other) < 1e-28, name


def test_jumps_at_the_poles():
    """A pass makes φ jump by +π; ψ by −π at the top, where φ + ψ runs on, by +π at the bottom."""
    form = MPForm(start((2, 1, 3), 3, 0, 0, thetadot=5), 30)  # planar, turning over
    top, bottom = form.orbit.T / 2 - form.orbit.t0, -form.orbit.t0
    eps = form.ctx.mpf("1e-25")
    for t, jump in ((top, -1), (bottom, 1)):
        before, after = form(t - eps), form(t + eps)
        assert abs(after.phi - before.phi - form.ctx.pi) < 1e-20
        assert abs(after.psi - before.psi - jump * form.ctx.pi) < 1e-20
        assert abs(after.theta - before.theta) < 1e-20


def test_start_on_a_pole_names_the_side_it_goes_to():
    """φ₀ is where the axis goes; when θ̇₀ points through the pole it is φ₀ + π."""
    for thetadot, turned in ((1, 0), (-1, 1)):
        at = MPForm(start((2, 1, 3), 0, 0, 1, thetadot=thetadot, phi=Fraction("0.3")), 30)(
            Fraction(1, 10**20)
        )
        assert abs(at.phi - Fraction("0.3").numerator / CTX.mpf(10) - turned * CTX.pi) < 1e-19


@pytest.mark.parametrize("gamma_t", [1, 5, 20, 60])
def test_elementary_separatrix(gamma_t):
    """1/u = 1 + sech γt (Whittaker §71–73; Woodhouse, problem 5.3); here γ = 1, A = 2, C = 1."""
    form = MPForm(start((2, 1, 2), CTX.pi / 3, 2 / ROOT3, 5 / ROOT3), 40)
    u = 1 / (1 + form.ctx.sech(gamma_t))
    at = form(gamma_t)
    assert abs(at.one_minus_u / (1 - u) - 1) < form.ctx.mpf("1e-25")


def test_reversal_in_time():
    """A motion from a turning point runs backwards as it runs forwards, mirrored."""
    form = MPForm(start(SICM, Fraction("0.1"), -15, 140), 40)
    for t in (Fraction("0.3"), 7):
        one, other = form(t), form(-t)
        assert abs(one.theta - other.theta) < 1e-38
        assert abs(one.phi + other.phi) < 1e-38 * 100
        assert abs(one.psi + other.psi) < 1e-38 * 10000


@pytest.mark.parametrize("digits", [20, 50, 100])
def test_digits_are_kept(digits):
    """The same state at `digits` and at twice that, 1e6 periods away."""
    motion = start(LIE, CTX.pi / 2, Fraction("-4.61538"), 150)
    t = 745206
    coarse, fine = MPForm(motion, digits)(t), MPForm(motion, 2 * digits)(t)
    for one, other in zip(angles(coarse), angles(fine), strict=True):
        assert abs(one - context(250).make_mpf(other._mpf_)) < CTX.mpf(10) ** -digits * max(
            1, abs(one)
        )


@pytest.mark.parametrize("mc", ["1", "0.7", "0.4", "1e-8", "1e-30"])
def test_jacobi_functions_invert_the_integral(mc):
    """F(asin sn | m) = x by Carlson's R_F, and sn² + cn² = 1, beside either turning point."""
    ctx = context(60)
    mc = ctx.mpf(mc)
    lattice = Lattice.of(ctx, 1 - mc, mc)
    functions, K = Functions.of(lattice, ctx.eps), ctx.elliprf(0, mc, 1)
    beside = [(x, False, x) for x in (K / 2, K / 7, ctx.mpf("1e-20"))]
    for x, upper, argument in [*beside, *((K - x, True, -x) for x in (K / 2, K / 7, K / 1000))]:
        s, c, d = functions(*lattice.argument(argument), upper)
        assert abs(s * ctx.elliprf(c * c, d * d, 1) / x - 1) < ctx.mpf("1e-45")
        assert abs(s * s + c * c - 1) < ctx.mpf("1e-58")


@pytest.mark.parametrize("x", [0, 1, 200])
def test_jacobi_functions_next_to_the_separatrix(x):
    """1 − m = 1e-300: sn, cn, dn are tanh, sech, sech, to all digits of each."""
    ctx = context(60)
    mc = ctx.mpf("1e-300")
    lattice = Lattice.of(ctx, 1 - mc, mc)
    s, c, d = Functions.of(lattice, ctx.eps)(*lattice.argument(ctx.mpf(x)), False)
    assert abs(s - ctx.tanh(x)) < ctx.mpf("1e-58")
    assert abs(c / ctx.sech(x) - 1) < ctx.mpf("1e-57")
    assert abs(d / ctx.sech(x) - 1) < ctx.mpf("1e-57")


@pytest.mark.parametrize("part", ["0.02", "0.2", "0.3", "0.48", "0.52", "0.7", "0.8", "0.98"])
@pytest.mark.parametrize("gMR", [3, -3])
def test_periods_are_counted_from_the_nearest_lower_turning(part, gMR):
    """Begun anywhere on the way, t₀ is the time since the u₁ nearest, and n counts from there."""
    args = (2, 1, gMR, Fraction("1.5"), 0, 0, -1, Fraction("0.5"), 3)
    first = MPForm(Reduced.from_angles(CTX, *args), 50)
    ctx, T = first.ctx, first.period
    at = first(ctx.mpf(part) * T - first.orbit.t0)
    angles_and_rates = (at.theta, at.phi, at.psi, at.thetadot, at.phidot, at.psidot)
    again = Reduced.from_angles(CTX, *args[:3], *angles_and_rates)
    form = MPForm(again, 40)
    since = ctx.mpf(part) * T
    want = since if since < T / 2 else since - T
    assert abs(form.orbit.t0 - want) < ctx.mpf("1e-40")
    for t in ("-3.29", "-0.61", "0", "0.11", "0.41", "0.93", "2.71"):
        time = ctx.mpf(t) * T
        n = int(ctx.floor((time + want) / T + ctx.mpf("0.5")))
        assert form(time).n == n
