"""The closed form against exact published states and against the rigid-body equations.

`rigid_series` integrates the equations by their own Taylor series at 40 digits, in a form that has
no pole, and finds what it has in the closed form and in the intervals of `enclose`.
"""

import random
from fractions import Fraction

import pytest

import heavytop as ht
from heavytop.numbers.decimals import context
from heavytop.numbers.intervals import Interval, rational

from .rigid_series import MOTIONS, WORK, attitude, here, motion, solved

CTX = context(60)
SICM = ("3.28e-4", "6.6e-5", "0.0456")
LIE = ("15.234375", "0.46875", "147.15")
SIMO = (5, 1, 20)
WHITTAKER = (2, 1, 2, "pi/3", 0, 0, 0, "2/sqrt(3)", "5/sqrt(3)")


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
    form = ht.Motion(ht.Top(*top), ht.State(theta, phidot=phidot, **spin)).form(30)
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
    form = motion(*LIE, "pi/2", phi="pi", phidot="-4.61538", psidot=150).form(30)
    ctx, at = form.ctx, form(Fraction(t))
    node = ctx.cos(at.phi), ctx.sin(at.phi), 0
    spin = [at.thetadot * node[i] + at.psidot * at.axis[i] for i in range(3)]
    spin[2] += at.phidot
    for got, want in zip((*at.axis, *spin), map(ctx.mpf, LIE_STATES[t]), strict=True):
        assert abs(got - want) < ctx.mpf("1e-16") * max(1, abs(want))
    assert abs(form.period - ctx.mpf("0.74520694761676905573")) < ctx.mpf("1e-20")
    assert abs(form.precession - ctx.mpf("0.6810111281938199783")) < ctx.mpf("1e-19")


def inside(ball, value, digits=33):
    """Whether an interval holds a number that is good to so many digits."""
    slack = Fraction(1, 10**digits) * max(1, abs(ball.middle))
    return value in Interval(ball.middle, ball.spread + slack)


@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("t", ["1.7", "-0.9"])
def test_closed_form_solves_the_rigid_body_equations(name, t):
    """Axis and a body vector agree to 1e-33 with the equations integrated at 40 digits."""
    args = MOTIONS[name]
    at = motion(*args).form(40)(t)
    e, _, v, _ = solved(args, t)
    got_e, got_v = attitude(*map(here, (at.phi, at.theta, at.psi)))
    distance = max(abs(a - b) for a, b in zip((*e, *v), (*got_e, *got_v), strict=True))
    assert distance < WORK.mpf("1e-33")
    assert max(abs(a - b) for a, b in zip(e, at.axis, strict=True)) < WORK.mpf("1e-33")


@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("t", ["1.7", "-0.9"])
def test_intervals_hold_what_the_rigid_body_equations_say(name, t):
    """Axis, attitude and rates at 40 digits; the rates from ℓ: ė = ℓ × e, and ω₃ = ℓ·e + κ."""
    args = MOTIONS[name]
    found = ht.enclose(ht.Top(*args[:3]), motion(*args).start, 40)
    e, l, v, kappa = solved(args, t)  # noqa: E741
    assert all(inside(*pair) for pair in zip(found.axis(t), e, strict=True))
    w, x, y, z = (WORK.mpf(b.middle.numerator) / b.middle.denominator for b in found.quaternion(t))
    column = 2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z
    first = w * w + x * x - y * y - z * z, 2 * (x * y + w * z), 2 * (x * z - w * y)
    off = [a - b for a, b in zip((*column, *first), (*e, *v), strict=True)]
    assert max(map(abs, off)) < WORK.mpf("1e-33")
    sin2 = e[0] ** 2 + e[1] ** 2
    if sin2 < 1e-20:
        return  # on a pole the angles have no rates of their own
    edot = [l[1] * e[2] - l[2] * e[1], l[2] * e[0] - l[0] * e[2], l[0] * e[1] - l[1] * e[0]]
    phidot = (e[0] * edot[1] - e[1] * edot[0]) / sin2
    omega3 = sum(a * b for a, b in zip(l, e, strict=True)) + kappa
    rates = -edot[2] / WORK.sqrt(sin2), phidot, omega3 - phidot * e[2]
    assert all(inside(*pair, 28) for pair in zip(found.rates(t), rates, strict=True))


def test_random_tops_solve_the_rigid_body_equations():
    """The same for tops drawn at random, either sign of gMR."""
    draw = random.Random(20121)
    for _ in range(6):
        A = draw.uniform(0.5, 2)
        args = (A, A * draw.uniform(0.01, 2), draw.uniform(-5, 5), draw.uniform(0.01, 3.1),
                draw.uniform(-3, 3), draw.uniform(-3, 3), draw.uniform(-2, 2),
                draw.uniform(-4, 4), draw.uniform(-8, 8))  # fmt: skip
        at = motion(*args).form(40)("1.25")
        e, _, v, _ = solved(args, "1.25")
        got = attitude(*map(here, (at.phi, at.theta, at.psi)))
        assert max(abs(a - b) for a, b in zip((*e, *v), (*got[0], *got[1]), strict=True)) < 1e-33


@pytest.mark.parametrize("name", [n for n in MOTIONS if not n.startswith(("through", "planar"))])
def test_rates_are_derivatives(name):
    """θ̇, φ̇, ψ̇, u̇ against central differences of the angles, to 1e-18 of their size."""
    form = motion(*MOTIONS[name]).form(60)
    ctx, h = form.ctx, form.ctx.mpf("1e-12")
    for t in map(ctx.mpf, ("-0.8", "0.3", "2.1")):
        before, at, after = form(t - h), form(t), form(t + h)
        for field in ("theta", "phi", "psi", "u"):
            slope = (getattr(after, field) - getattr(before, field)) / (2 * h)
            rate = getattr(at, field + "dot")
            assert abs(slope - rate) < 1e-18 * max(1, abs(rate)) ** 3, field


@pytest.mark.parametrize("name", MOTIONS)
def test_start_is_the_start(name):
    """At t = 0 every angle and rate is the given one, in the interval too."""
    begun = motion(*MOTIONS[name])
    form, found = begun.form(30), ht.enclose(begun.top, begun.start, 25)
    at, start = form(0), begun.start
    if start.theta.sign() == 0:
        return  # φ and ψ, and their rates, have no value of their own on a pole
    names = ("theta", "phi", "psi", "thetadot", "phidot", "psidot")
    balls = found.theta(0), found.phi(0), found.psi(0), *found.rates(0)
    for name, ball in zip(names, balls, strict=True):
        given = getattr(start, name).mpf(form.ctx)
        assert abs(getattr(at, name) - given) < 1e-28
        assert inside(ball, given, 38)


@pytest.mark.parametrize("name", MOTIONS)
def test_a_period_later(name):
    """θ is the same, φ and ψ have gained Δφ and Δψ; but for jumps, at the mean rates."""
    begun = motion(*MOTIONS[name])
    form = begun.form(40)
    if form.period is None:
        assert not begun.nutates
        return
    T, t = form.period, form.ctx.mpf("0.37")
    at, later = form(t), form(t + T)
    close = form.ctx.mpf("1e-36")
    assert abs(later.theta - at.theta) < close
    assert abs(later.phi - at.phi - form.precession) < close
    assert abs(later.psi - at.psi - form.spin) < close * max(1, abs(form.spin))
    regime, pi = begun.rising.regime, form.ctx.pi
    passes = [not regime.misses_top, not regime.misses_bottom]
    if regime.mirrored:
        passes.reverse()
    low, high = sorted(form.tilts)
    passed = [passes[0] and low < close, passes[1] and pi - high < close]
    over = (form.precession + form.relative_spin, form.precession - form.relative_spin)
    jumps = (2 * pi * passed[1], 2 * pi * passed[0])  # at θ = 0 of φ − ψ, at θ = π of φ + ψ
    for whole, jump, mean in zip(over, jumps, form.mean_rates, strict=True):
        assert abs(whole - jump - mean * T) < close * max(1, abs(whole))


def test_jumps_at_the_poles():
    """A pass makes φ jump by +π; ψ by −π at the top, where φ + ψ runs on, by +π at the bottom."""
    form = motion(2, 1, 3, 3, thetadot=5).form(30)  # planar, turning over
    bottom, top = form.lower_turning, form.lower_turning + form.period / 2
    eps = form.ctx.mpf("1e-25")
    for t, jump in ((top, -1), (bottom, 1)):
        before, after = form(t - eps), form(t + eps)
        assert abs(after.phi - before.phi - form.ctx.pi) < 1e-20
        assert abs(after.psi - before.psi - jump * form.ctx.pi) < 1e-20
        assert abs(after.theta - before.theta) < 1e-20


@pytest.mark.parametrize(("theta", "up"), [(0, 1), ("pi", -1)])
@pytest.mark.parametrize("thetadot", [1, -1])
@pytest.mark.parametrize("gMR", [3, -3])
def test_start_on_a_pole_names_the_side_it_goes_to(theta, up, thetadot, gMR):
    """φ₀ is where the axis goes; when θ̇₀ points through the pole it is φ₀ + π, and ψ₀ ∓ π."""
    begun = motion(2, 1, gMR, theta, phi="0.3", psi="0.2", thetadot=thetadot, psidot=1)
    at = begun.form(30)(Fraction(1, 10**20))
    turned = thetadot * up < 0
    assert abs(at.phi - CTX.mpf("0.3") - turned * CTX.pi) < 1e-19
    assert abs(at.psi - CTX.mpf("0.2") + up * turned * CTX.pi) < 1e-19


@pytest.mark.parametrize("gamma_t", [1, 5, 20, 60])
def test_elementary_separatrix(gamma_t):
    """1/u = 1 + sech γt (Whittaker §71–73; Woodhouse, problem 5.3); here γ = 1, A = 2, C = 1."""
    form = motion(*WHITTAKER).form(40)
    u = 1 / (1 + form.ctx.sech(gamma_t))
    at = form(gamma_t)
    assert abs(at.one_minus_u / (1 - u) - 1) < form.ctx.mpf("1e-25")


def test_reversal_in_time():
    """A motion from a turning point runs backwards as it runs forwards, mirrored."""
    form = motion(*SICM, "0.1", phidot=-15, psidot=140).form(40)
    for t in (Fraction("0.3"), 7):
        one, other = form(t), form(-t)
        assert abs(one.theta - other.theta) < 1e-38
        assert abs(one.phi + other.phi) < 1e-38 * 100
        assert abs(one.psi + other.psi) < 1e-38 * 10000


@pytest.mark.parametrize("digits", [20, 50, 100])
def test_digits_are_kept(digits):
    """The same state at `digits` and at twice that, 1e6 periods away."""
    begun = motion(*LIE, "pi/2", phidot="-4.61538", psidot=150)
    t = 745206
    coarse, fine = begun.form(digits)(t), begun.form(2 * digits)(t)
    for one, other in zip(angles(coarse), angles(fine), strict=True):
        assert abs(one - context(250).make_mpf(other._mpf_)) < CTX.mpf(10) ** -digits * max(
            1, abs(one)
        )


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("x", [0, 1, 60, 200])
def test_next_to_the_separatrix_it_is_the_separatrix(x, side):
    """1e-300 off Whittaker's, 1/u = 1 + sech γt: all digits of the distance from the top."""
    *top, theta, phi, psi, thetadot, phidot, psidot = WHITTAKER
    beside = f"{psidot} + {side}e-300"
    form = motion(*top, theta, phi, psi, thetadot, phidot, beside).form(100)
    sech = form.ctx.sech(x)
    assert abs(form(x).one_minus_u / (sech / (1 + sech)) - 1) < form.ctx.mpf("1e-58")
    assert form.modulus[1] < form.ctx.mpf("1e-150")


@pytest.mark.parametrize("part", ["0.02", "0.2", "0.3", "0.48", "0.52", "0.7", "0.8", "0.98"])
@pytest.mark.parametrize("gMR", [3, -3])
def test_periods_are_counted_from_the_nearest_lower_turning(part, gMR):
    """Begun anywhere on the way, the u₁ nearest is what times and n count from."""
    args = (2, 1, gMR, "1.5", 0, 0, -1, "0.5", 3)
    first = motion(*args).form(50)
    ctx, T = first.ctx, first.period
    at = first(ctx.mpf(part) * T + first.lower_turning)
    given = (*angles(at), at.thetadot, at.phidot, at.psidot)
    again = motion(*args[:3], *map(rational, given))
    form, since = again.form(40), ctx.mpf(part) * T
    want = since if since < T / 2 else since - T
    assert abs(form.lower_turning + want) < ctx.mpf("1e-40")
    for t in ("-3.29", "-0.61", "0", "0.11", "0.41", "0.93", "2.71"):
        time = ctx.mpf(t) * T
        n = int(ctx.floor((time + want) / T + ctx.mpf("0.5")))
        assert form(time).n == again.at(float(time)).n == n
