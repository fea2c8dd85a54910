"""Expressions that the closed form's code takes for balls, and when such an expression is 0.

A `Family` of motions is a set of symbols, the squares of those that are roots, and one point, at
which comparisons are looked up. `Family.solution` runs the code of `analytic/solution` and of
`analytic/cubic` on them: no formula of the two is written again. What only has a number is a
function with a known derivative: sn, cn, dn, tanh, sech, and the argument of θ₁.

An expression vanishes if its numerator, reduced by the squares and by sn² + cn² = 1 = m sn² + dn²,
is the polynomial 0 over the rational numbers. It is then 0 for every motion of the family.
"""

from functools import cache

import sympy as sp

from heavytop.analytic import cubic, solution
from heavytop.classification.reduced import Reduced, Regime
from heavytop.equations import lagrangian as lag

TIME, PHASE, PHI, PSI = sp.symbols("t phase phi_start psi_start", real=True)
w, size, low, m, k, span, gamma = sp.symbols("w size low m k span gamma", positive=True)
sn, cn, dn, sn0, cn0, dn0 = sp.symbols("sn cn dn sn0 cn0 dn0", real=True)
u, spin, Q_plus, Q_minus = sp.symbols("u spin Q_plus Q_minus", real=True)

ZERO, HALF = sp.Integer(0), sp.Rational(1, 2)


class Whole(sp.Function):
    """A whole number near another: constant between its jumps."""

    def fdiff(self, _=1):
        return ZERO


class Sn(sp.Function):
    """Of an argument, and the parameter m."""

    def fdiff(self, _=1):
        return Cn(*self.args) * Dn(*self.args)


class Cn(sp.Function):
    def fdiff(self, _=1):
        return -Sn(*self.args) * Dn(*self.args)


class Dn(sp.Function):
    def fdiff(self, _=1):
        return -self.args[1] * Sn(*self.args) * Cn(*self.args)


class Tanh(sp.Function):
    def fdiff(self, _=1):
        return Sech(*self.args) ** 2


class Sech(sp.Function):
    def fdiff(self, _=1):
        return -Tanh(*self.args) * Sech(*self.args)


class Argument(sp.Function):
    """The argument of iθ₁(x − iβ): of x in periods, β, and the parameter m."""

    def fdiff(self, _=1):
        return ArgumentRate(*self.args)


ArgumentRate, Mean, Angle, Asinh = map(sp.Function, ("ArgumentRate", "Mean", "Angle", "Asinh"))
Cosine, First, Third = map(sp.Function, ("Cosine", "First", "Third"))  # as `elliptic` has them
NUMBERS = {Sn: 0.6, Cn: 0.8, Dn: 0.9, Tanh: 0.6, Sech: 0.8, Asinh: 0.7}
POINT = {
    TIME: 1.0, PHASE: 0.1, w: 1.3, size: 0.8, low: 0.6, m: 0.3, k: 0.6, span: 1.2, gamma: 1.3,
    sn: 0.6, cn: 0.8, dn: 0.9, sn0: 0.6, cn0: 0.8, dn0: 0.9, u: 0.3, spin: 3.0,
    lag.A: 1.0, lag.C: 0.5,
}  # fmt: skip


class Symbol:
    """What the code takes for a ball; `family` is the one whose motion is looked at."""

    family = None

    def __init__(self, value):
        value = value.value if isinstance(value, Symbol) else value
        self.value = sp.Rational(value) if isinstance(value, float) else sp.sympify(value)

    def __add__(self, other):
        return Symbol(self.value + Symbol(other).value)

    def __mul__(self, other):
        return Symbol(self.value * Symbol(other).value)

    __radd__, __rmul__ = __add__, __mul__

    def __neg__(self):
        return Symbol(-self.value)

    def __sub__(self, other):
        return self + -Symbol(other)

    def __rsub__(self, other):
        return Symbol(other) + -self

    def __truediv__(self, other):
        over = Symbol(other)
        if over.is_zero():
            return Symbol(sp.nan)
        return Symbol(self.family.simple(self.value / over.value))

    def __rtruediv__(self, other):
        return Symbol(other) / self

    def __pow__(self, n):
        return Symbol(self.value**n)

    def __lt__(self, other):
        return self.family.at_the_point((self - other).value) < 0

    def __le__(self, other):
        return not self > other

    def __gt__(self, other):
        return Symbol(other) < self

    def __ge__(self, other):
        return not self < other

    def __abs__(self):
        return self if self >= 0 else -self

    def is_finite(self):
        return self.value is not sp.nan

    def is_zero(self):
        return not self.value.has(TIME) and self.family.vanishes(self.value)

    def intersection(self, other):
        """One number from two sides, which have to be equal."""
        assert self.family.vanishes(self.value - other.value)
        return self

    def union(self, other):
        """One of the two: what is between them is not asked."""
        return self

    def min(self, other):
        return self if self < other else other

    def nonnegative_part(self):
        return self

    def mid(self):
        return self

    def unique_fmpz(self):
        return 0

    def sqrt(self):
        return Symbol(self.family.root(self.value))

    def agm(self, other):
        assert self.value == 1
        return Symbol(Mean(other.value))

    def sin_cos(self):
        return Symbol(sp.sin(self.value)), Symbol(sp.cos(self.value))

    def cos(self):
        return Symbol(Cosine(self.value))

    def atan(self):
        return Symbol(sp.atan(self.value))

    def asinh(self):
        return Symbol(Asinh(self.value))

    def tanh(self):
        return Symbol(Tanh(self.value))

    def sech(self):
        return Symbol(Sech(self.value))

    @staticmethod
    def pi():
        return Symbol(sp.pi)

    @staticmethod
    def atan2(y, x):
        return Symbol(Angle(y.value, x.value))


class Jacobi:
    """What `elliptic.Jacobi` computes: functions of 2K x, and the argument of iθ₁(x − iβ)."""

    def __init__(self, tau):
        self.m, root = ZERO, sp.Integer(1)
        if tau is not None:  # K'/K, with K = π/(2 agm(1, √(1 − m))) by Gauss
            over, under = sp.fraction(tau.value)
            root, self.m = over.args[0], under.args[0] ** 2
            assert Symbol.family.vanishes(self.m + root**2 - 1)
        self.two_K = sp.pi / Mean(root)
        Symbol.family.take(self.m)

    def functions(self, x):
        return tuple(Symbol(f(self.two_K * x.value, self.m)) for f in (Sn, Cn, Dn))

    def argument(self, x, beta):
        return Symbol(Argument(x.value, beta.value, self.m))


def first_kind(s2, c2, mc):
    return Symbol(First(s2.value, c2.value, mc.value))


def third_kind(mc, p):
    return Symbol(Third(mc.value, p.value))


def whole(x, *_):
    return Symbol(Whole(x.value))


def without_jumps(x):
    """A number of periods but for whole ones."""
    return sp.expand(x).replace(Whole, lambda _: ZERO)


@cache
def _out_of_root(square):
    """What comes out of the root of a polynomial, and what stays."""
    number, factors = sp.factor_list(square)
    out = sp.prod(f ** (n // 2) for f, n in factors)
    return out, number * sp.prod(f for f, n in factors if n % 2)


class Algebra:
    """Polynomials over the rational numbers, reduced by the squares of the symbols that are roots.

    Parameters
    ----------
    squares : dict from symbol to polynomial
        In the order in which they are put in: none has a symbol of those before.
    point : dict from symbol to float
        Where the sign of an expression is looked up.
    """

    numbers = NUMBERS

    def __init__(self, squares, point):
        self.squares, self.point, self.known = dict(squares), point, {}

    def plain(self, expression):
        """The same in symbols, and functions of which nothing has to be known."""
        return expression

    def vanishes(self, expression):
        return not self.fraction(sp.sympify(expression))[0]

    def at_the_point(self, expression):
        def number(x):
            if x.is_Function:
                return sp.Float(self.numbers.get(x.func, 1))
            return x.func(*map(number, x.args)) if x.args else sp.sympify(self.point.get(x, x))

        return float(number(expression))

    def root(self, square):
        """The root of a square, positive at the point; of anything else a radical."""
        if square.has(TIME):
            return sp.sqrt(square)
        over, under = sp.fraction(self.simple(square))
        out, rest = _out_of_root(over * under)
        for symbol, known in ((1, sp.Integer(1)), *self.squares.items()):
            of_known, rest_of_known = _out_of_root(known)
            ratio = rest / rest_of_known
            if ratio.is_Rational and ratio > 0:
                found = out / under * symbol / of_known * sp.sqrt(ratio)
                return found if self.at_the_point(found) > 0 else -found
        return sp.sqrt(square)

    def simple(self, expression):
        """The same, written shortly."""
        radicals = (x for x in expression.atoms(sp.Pow) if not x.exp.is_Integer)
        if expression.has(sp.Function, sp.pi, TIME) or any(radicals):
            return expression
        over, under = self.fraction(expression)
        over, under = over.cancel(under)
        return over.as_expr() / under.as_expr()

    def fraction(self, expression):
        """The reduced numerator, and a denominator that is not 0."""
        if expression not in self.known:
            self.known[expression] = self._fraction(self.plain(expression))
        return self.known[expression]

    def _fraction(self, plain):
        radicals = {}

        def named(base, exponent):  # √x is a symbol whose square is x
            if exponent.is_Rational and exponent.q == 2:
                root = radicals.setdefault(base, sp.Dummy("root", positive=True))
                return root ** (2 * exponent)
            return base**exponent

        plain = plain.xreplace({f: sp.Dummy() for f in plain.atoms(sp.Function) | {sp.pi}})
        if plain.has(sp.Pow):
            plain = plain.replace(sp.Pow, named)
        squares = {root: base for base, root in reversed(radicals.items())} | self.squares
        others = set().union(plain.free_symbols, *(x.free_symbols for x in squares.values()))
        order = [*squares, *sorted(others - set(squares), key=str)]
        ring = sp.ring(order, sp.QQ)[0]
        rules = [(i, ring.from_expr(sp.expand(x))) for i, x in enumerate(squares.values())]

        def reduced(p):
            for i, square in rules:
                if p.degree(i) < 2:
                    continue
                parts = {}
                for powers, number in p.terms():
                    half, odd = divmod(powers[i], 2)
                    rest = (*powers[:i], odd, *powers[i + 1 :])
                    parts.setdefault(half, ring.zero)[rest] = number
                p = sum((q * square**half for half, q in parts.items()), ring.zero)
            return p

        def power(p, n):
            result = ring.one
            for _ in range(n):
                result = reduced(result * p)
            return result

        def parts(x):
            if x.is_Rational or x.is_Symbol:
                return ring.from_expr(x), ring.one
            if x.is_Pow:
                over, under = parts(x.base)[:: 1 if x.exp > 0 else -1]
                return power(over, abs(int(x.exp))), power(under, abs(int(x.exp)))
            assert x.is_Add or x.is_Mul, x
            (a, b), *rest = map(parts, x.args)
            for c, d in rest:
                if x.is_Mul:
                    a, b = reduced(a * c), reduced(b * d)
                elif b == d:
                    a = a + c
                else:
                    _, e, f = b.cofactors(d)
                    a, b = reduced(a * f + c * e), reduced(b * f)
            return a, b

        over, under = parts(plain)
        assert under, "a denominator is 0"
        return over, under


class Family(Algebra):
    """Motions of one regime; `over` is the reduced motion seen with g ≥ 0."""

    over: Reduced
    regime: Regime
    distances: tuple

    def reduced(self, g, b, u0, udot0, drift0, kinetic0):
        """A reduced motion; κ is that of moments A and C."""
        kappa = b * (lag.A / lag.C - 1)
        return Reduced(*map(Symbol, (g, b, u0, 1 - u0, 1 + u0, udot0, drift0, kinetic0, kappa)))

    def solution(self, monkeypatch, code=solution, roots=cubic):
        """What the code of the closed form, and of the roots, makes of this family."""
        monkeypatch.setattr(Symbol, "family", self)
        of_numbers = {"arb": Symbol, "Jacobi": Jacobi, "_nearest": whole, "floor": whole}
        of_numbers |= {"first_kind": first_kind, "third_kind": third_kind, "Roots": roots.Roots}
        for name, symbolic in of_numbers.items():
            monkeypatch.setattr(code, name, symbolic)
        monkeypatch.setattr(roots, "arb", Symbol)
        monkeypatch.setattr(roots, "_distances", lambda *_: list(map(Symbol, self.distances)))
        given = self.over.mirrored() if self.regime.mirrored else self.over
        self.found = code.Solution(given, (Symbol(PHI), Symbol(PSI)), self.regime)
        return self.found

    def at_start(self, expression):
        """The expression at t = 0."""
        return expression.xreplace({TIME: ZERO})


class Nutating(Family):
    """All motions that nutate: u₁ = low − 1, u₂ − u₁ = size², w and m are as in the code.

    P± = 2w/size Q±. The start is anywhere: `begin` are sn, cn and dn there.
    """

    def __init__(
        self, low=low, size=size, m=m, begin=(sn0, cn0, dn0), signs=(1, 1), falls=False,
        mirrored=False, before=False,
    ):  # fmt: skip
        low, size, m = map(sp.sympify, (low, size, m))
        delta, high, u1 = size**2, 2 - low, low - 1
        ends = {
            Q_plus: sp.expand(low * (low + delta) * (m * low + delta)),
            Q_minus: sp.expand(high * (high - delta) * (delta - m * high)),
        }
        squares = {cn: 1 - sn**2, dn0: 1 - m * sn0**2, cn0: 1 - sn0**2}
        if m == 0:
            begin = (*begin[:2], 1)
            del squares[dn0]
        point = POINT | {cn0: -0.8 if falls else 0.8}
        for sign, (Q, square) in zip(signs, ends.items(), strict=True):
            point[Q] = sign * float(square.subs(point)) ** 0.5
        super().__init__(squares | {Q: x for Q, x in ends.items() if x != 0}, point)
        self.numbers = NUMBERS | ({Sn: -0.6} if before else {})
        plus, minus = (2 * w / size * Q if x != 0 else ZERO for Q, x in ends.items())
        g, a, b = 2 * w**2 * m / delta, (plus + minus) / 2, (plus - minus) / 2
        h = 2 * w**2 / delta * (3 * m * u1 + m * delta + delta) - b**2 / 2  # the sum of the roots
        s, c, d = map(sp.sympify, begin)
        u0, udot0 = u1 + delta * s**2, 2 * w * delta * s * c * d
        self.over = self.reduced(g, b, u0, udot0, a - b * u0, h - g * u0)
        third = (delta / m - delta * s**2,) if m != 0 else ()
        self.distances = (-delta * s**2, delta - delta * s**2, *third)
        self.regime = Regime(mirrored, m == 0, udot0 == 0, False, minus != 0, plus != 0, False)
        self.rates = {}

    def take(self, m):
        """The parameter of the elliptic functions is that which the code made."""
        if m != 0:
            modulus = m if m.is_polynomial() else sp.Dummy("modulus")
            self.squares = {dn: 1 - modulus * sn**2} | self.squares
            self.known = {}

    def solution(self, monkeypatch, code=solution, roots=cubic):
        """The same; the phase x₀/2K stands as a symbol."""
        found = super().solution(monkeypatch, code, roots)
        self.phase = found.path.phase.value
        vars(found.path)["phase"] = Symbol(PHASE)
        return found

    def later(self, x):
        """How many periods a number of them is after now, but for whole ones."""
        return without_jumps(x - self.found.path.periods(Symbol(TIME)).value)

    def plain(self, expression):
        """sn, cn and dn are those of w t + x₀, by which rates of arguments are written too."""
        rates = expression.atoms(ArgumentRate)
        self.rates |= {x: self.rate(*x.args) for x in rates - set(self.rates)}
        expression = expression.xreplace({x: self.rates[x] for x in rates})
        values = {}
        for f in expression.atoms(Sn, Cn, Dn):
            third = dn if f.args[1] != 0 else 1
            functions = {0: (sn, cn, third), -HALF: (-cn / third, None, None)}
            later = self.later(f.args[0] / self.found.path.jacobi.two_K)
            values[f] = functions[later][(Sn, Cn, Dn).index(f.func)]
        return expression.xreplace(values)

    def rate(self, x, beta, m):
        """The rate of the argument of iθ₁(x − iβ): π + c (E − Ē), E = 1/(1 − N sn² 2Kx).

        `test_the_rate_of_the_argument` says why. With s = sn² of w t + x₀, E is α + β/(1 − n s), n
        that of the code's own integral of the third kind, Π(n|m)/K the mean of 1/(1 − n s).
        """
        path = self.found.path
        two_K, own = path.jacobi.two_K, -self.later(x)
        half = path.halves[int(2 * own)]
        [F], [Pi] = beta.atoms(First), half.turn.value.atoms(Third)
        (s2, c2, other), (mc, p) = F.args, Pi.args
        assert beta == F / two_K
        assert self.vanishes(other - m)  # F(φ|1 − m)
        assert self.vanishes(mc + m - 1)
        N = -c2 / s2
        c = two_K * self.root((c2 + m * s2) * (s2 + c2) / (s2 * c2))
        E = 1 / (1 - N * Sn(two_K * x, m) ** 2)
        begin, end = (1, 1 / (1 - N)) if own == 0 else (1 / (1 - N), 1)
        slope = (end - begin) / (1 / p - 1)
        now = Sn(two_K * (TIME / path.period.value + PHASE), m)
        assert self.vanishes(E - begin + slope - slope / (1 - (1 - p) * now**2))
        return sp.pi + c * (E - begin + slope - slope * Pi / (two_K / 2))

    def at_start(self, expression):
        """The expression at t = 0: sn F(φ|m) is sin φ, cn and dn belong to it."""
        jacobi, phase = self.found.path.jacobi, self.phase
        if phase.has(First):
            [F] = phase.atoms(First)
            assert phase in (F / jacobi.two_K, -F / jacobi.two_K)
            s2, c2, mc = F.args
            assert self.vanishes(mc + jacobi.m - 1)
            sine = self.root(s2 / (s2 + c2)) * (-1 if phase.could_extract_minus_sign() else 1)
            cosine = self.root(c2 / (s2 + c2))
        else:
            sine, cosine = {ZERO: (0, 1), -HALF: (-1, 0)}[phase]
        begin = sine, cosine, self.root(sp.sympify(1 - jacobi.m * sine**2))
        expression = super().at_start(expression)
        for f in expression.atoms(Sn, Cn, Dn):
            assert without_jumps(f.args[0] / jacobi.two_K) == PHASE
        return expression.xreplace(
            {f: begin[(Sn, Cn, Dn).index(f.func)] for f in expression.atoms(Sn, Cn, Dn)}
        )


class Separatrix(Family):
    """All motions that tend to the top: 1 − u₁ = size², w = gamma size, sn0 = tanh x₀."""

    def __init__(self, planar=False, signs=(1, 1), mirrored=False, before=False):
        E, floor = (sp.sqrt(2), ZERO) if planar else (size, signs[0] * span)
        squares = {cn: 1 - sn**2, cn0: 1 - sn0**2} | ({} if planar else {span: 2 - E**2})
        super().__init__(squares, POINT | {span: 1.36**0.5, sn0: signs[1] * 0.6})
        self.numbers = NUMBERS | ({Tanh: -0.6} if before else {})
        b, g = 2 * gamma * floor, 2 * gamma**2
        u0, udot0 = 1 - E**2 * cn0**2, 2 * gamma * E**3 * cn0**2 * sn0
        self.over = self.reduced(g, b, u0, udot0, b * (1 - u0), g * (1 - u0))
        self.regime = Regime(mirrored, False, False, False, False, not planar, True)

    def plain(self, expression):
        """Functions of w t + x₀ as symbols."""
        if not expression.has(Tanh, Sech):
            return expression
        now = self.found.path.w.value * TIME + self.found.path.x0.value
        return expression.xreplace({Tanh(now): sn, Sech(now): cn})

    def at_start(self, expression):
        """The expression at t = 0, where sinh x₀ = y of x₀ = asinh y."""
        [y] = self.found.path.x0.value.args
        cosh = self.root(1 + y**2)
        values = {Tanh: y / cosh, Sech: 1 / cosh}
        expression = super().at_start(expression)
        expression = expression.xreplace(
            {f: values[f.func] for f in expression.atoms(Tanh, Sech) if f.args[0] == Asinh(y)}
        )
        return expression.replace(sp.atan, lambda x: sp.atan(self.simple(x)))


class Steady(Family):
    """All motions of constant tilt: a cone at the rate gamma, or an axis on the vertical."""

    def __init__(self, u0=u, weightless=False, mirrored=False):
        u0, sin2 = sp.sympify(u0), 1 - sp.sympify(u0) ** 2
        b = gamma * u0 if weightless else spin
        g = gamma * b - gamma**2 * u0 if sin2 != 0 else w
        super().__init__({}, POINT)
        self.over = self.reduced(g, b, u0, ZERO, gamma * sin2, gamma**2 * sin2 / 2)
        top, bottom = u0 == 1, u0 == -1
        self.regime = Regime(mirrored, weightless, True, True, not top, not bottom, False)
