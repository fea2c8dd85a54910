"""Expressions that the closed form's code takes for balls, and when such an expression is 0.

A `Family` of motions is a set of symbols, the squares of those that are roots, and one point, at
which comparisons are looked up. `Family.record` runs the code of `analytic/constants`, `form` and
`roots` on them: no formula of these is written again. What only has a number is a function with a
known derivative: sn, cn, dn, tanh, sech, and the sweeps, which are arguments of theta functions.

An expression vanishes if its numerator, reduced by the squares and by sn² + cn² = 1 = m sn² + dn²,
is the polynomial 0 over the rational numbers. It is then 0 for every motion of the family.
"""

from functools import cache

import sympy as sp
from flint import arb

from heavytop.analytic import balls, constants, form, roots
from heavytop.classification.reduced import Reduced, Regime
from heavytop.equations import lagrangian as lag

TIME, PHI, PSI = sp.symbols("t phi_start psi_start", real=True)
w, size, low, m, k, span, gamma = sp.symbols("w size low m k span gamma", positive=True)
sn, cn, dn, sn0, cn0, dn0 = sp.symbols("sn cn dn sn0 cn0 dn0", real=True)
u, spin, Q_plus, Q_minus = sp.symbols("u spin Q_plus Q_minus", real=True)

ZERO, HALF = sp.Integer(0), sp.Rational(1, 2)


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


class Sweep(sp.Function):
    """The sweep of Φ₊ (0) or Φ₋ (1): of z, of v, and of which it is; an odd function of z."""

    @classmethod
    def eval(cls, z, *_):
        return ZERO if z == 0 else None

    def fdiff(self, _=1):
        return SweepRate(*self.args)


SweepRate, Mean, Angle, Asinh = map(sp.Function, ("SweepRate", "Mean", "Angle", "Asinh"))
Cosine, First, Third = map(sp.Function, ("Cosine", "First", "Third"))  # as `roots` has them
NUMBERS = {Sn: 0.6, Cn: 0.8, Dn: 0.9, Tanh: 0.6, Sech: 0.8, Asinh: 0.7}
POINT = {
    TIME: 1e-9, w: 1.3, size: 0.8, low: 0.6, m: 0.3, k: 0.6, span: 1.2, gamma: 1.3,
    sn: 0.6, cn: 0.8, dn: 0.9, sn0: 0.6, cn0: 0.8, dn0: 0.9, u: 0.3, spin: 3.0,
    lag.A: 1.0, lag.C: 0.5,
}  # fmt: skip


class Symbol:
    """What the code takes for a ball; `family` is the one whose motion is looked at."""

    family = None

    def __init__(self, value):
        value = value.value if isinstance(value, Symbol) else value
        value = int(value.unique_fmpz()) if isinstance(value, arb) else value  # the default, 0
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

    def __float__(self):
        return self.family.at_the_point(self.value)

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


class Theta:
    """What `theta.Theta` computes, of z = scale x: for m < 1 as it does for m ≤ ½."""

    def __init__(self, m, mc, bits):
        self.m, self.hyperbolic = m.value, m.value == 1
        self.two_K = sp.Integer(0) if self.hyperbolic else sp.pi / Mean(mc.sqrt().value)
        self.scale = Symbol(1 if self.hyperbolic else sp.pi / self.two_K)
        self.half = Symbol(0 if self.hyperbolic else sp.pi / 2)
        Symbol.family.take(self.m)

    def function(self, N, upper, which):
        def value(z, *_):
            x = z.value / self.scale.value + (self.two_K / 2 if upper else 0)
            functions = (Tanh, Sech, Sech) if self.hyperbolic else (Sn, Cn, Dn)
            return Symbol(functions[which - 1](x, self.m) if which else 1)

        return value

    def sweep(self, N, v, sign, beside):
        if self.hyperbolic:  # v is the arctangent of an expression
            return lambda z, *_: sign * Symbol(sp.atan(Tanh(z.value, self.m) / v.value.args[0]))
        which = [half.v for half in Symbol.family.halves].index(v)
        return lambda z, *_: sign * Symbol(Sweep(z.value, v.value, which))

    def step(self, v, sign):
        return sign * Symbol(sp.pi) / 2


def first_kind(s2, c2, mc):
    return Symbol(First(s2.value, c2.value, mc.value))


def third_kind(mc, p):
    return Symbol(Third(mc.value, p.value))


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

    def constants(self, monkeypatch, **changed):
        """What the code, or a changed one, makes of this family."""
        codes = {"constants": constants, "form": form, "roots": roots, "balls": balls} | changed
        monkeypatch.setattr(Symbol, "family", self)
        for code in codes.values():
            monkeypatch.setattr(code, "arb", Symbol)
        of_numbers = {"Theta": Theta, "first_kind": first_kind, "third_kind": third_kind}
        of_numbers |= {"Roots": codes["roots"].Roots}
        for name, symbolic in of_numbers.items():
            monkeypatch.setattr(codes["constants"], name, symbolic)
        of_numbers = {"atan2": Symbol.atan2, "sin_cos": Symbol.sin_cos, "modulo_circle": Symbol}
        of_numbers |= {"argument": lambda z, _: (z, z, z)}
        for name, symbolic in of_numbers.items():
            monkeypatch.setattr(codes["balls"], name, symbolic)
        monkeypatch.setattr(codes["form"], "balls", codes["balls"])
        monkeypatch.setattr(codes["roots"], "_distances", lambda *_: [*map(Symbol, self.distances)])
        given = self.over.mirrored() if self.regime.mirrored else self.over
        angles = Symbol(PHI), Symbol(PSI)
        self.codes = codes
        self.found = codes["constants"].Constants(given, angles, self.regime, 64)
        return self.found

    def record(self, monkeypatch, n=0, **changed):
        """Where the top is, nearest the turning point n after that of the start."""
        found = self.constants(monkeypatch, **changed)
        N = self.codes["balls"]
        monkeypatch.setattr(
            N, "nearest", lambda c, z: lambda t: (n, (n + c.first) % 2 == 1, z(n, t))
        )
        return self.codes["form"].Form(found, N)(Symbol(TIME))

    @property
    def halves(self):
        """Φ₊ and Φ₋, also while they are made."""
        return self.found.halves

    def take(self, m):
        """The parameter of the elliptic functions is that which the code made."""

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

    def plain(self, expression):
        """sn, cn and dn are those of w t + x₀, by which rates of sweeps are written too."""
        rates = expression.atoms(SweepRate)
        self.rates |= {x: self.rate(*x.args) for x in rates - set(self.rates)}
        expression = expression.xreplace({x: self.rates[x] for x in rates})
        now = {Sn: sn, Cn: cn, Dn: dn}
        values = {f: now[f.func] for f in expression.atoms(Sn, Cn, Dn)}
        values |= {f: sp.Integer(1) for f in values if f.func is Dn and f.args[1] == 0}
        return expression.xreplace(values)

    def rate(self, z, v, which):
        """The rate of the argument of iθ₁(x − iβ), π + c (E − Ē) with E = 1/(1 − N sn² 2Kx), per z.

        `test_the_rate_of_the_argument` says why; x is counted from the turning point beside the
        pole. With s = sn² of w t + x₀, E is α + β/(1 − n s), n that of the code's own integral of
        the third kind, Π(n|m)/K the mean of 1/(1 − n s).
        """
        m, two_K, half = self.found.theta.m, self.found.theta.two_K, self.halves[int(which)]
        [Pi] = half.turn.value.atoms(Third)
        (s2, c2, other), (mc, p) = v.args, Pi.args
        assert v.func is First
        assert self.vanishes(other - m)  # F(φ|1 − m)
        assert self.vanishes(mc + m - 1)
        N = -c2 / s2
        c = two_K * self.root((c2 + m * s2) * (s2 + c2) / (s2 * c2))
        E = 1 / (1 - N * (cn**2 / (dn**2 if m != 0 else 1) if which else sn**2))
        begin, end = (1 / (1 - N), 1) if which else (1, 1 / (1 - N))
        slope = (end - begin) / (1 / p - 1)
        assert self.vanishes(E - begin + slope - slope / (1 - (1 - p) * sn**2))
        return (sp.pi + c * (E - begin + slope - slope * Pi / (two_K / 2))) / sp.pi

    def at_start(self, expression):
        """The expression at t = 0: sn F(φ|m) is sin φ, cn and dn belong to it."""
        c = self.found
        phase, two_K, m = c.phase.value, c.theta.two_K, c.theta.m
        if phase.has(First):
            [F] = phase.atoms(First)
            assert phase in (F / two_K, -F / two_K)
            s2, c2, mc = F.args
            assert self.vanishes(mc + m - 1)
            sine = self.root(s2 / (s2 + c2)) * (-1 if phase.could_extract_minus_sign() else 1)
            cosine = self.root(c2 / (s2 + c2))
        else:
            sine, cosine = {ZERO: (0, 1), -HALF: (-1, 0)}[phase]
        begin = {Sn: sine, Cn: cosine, Dn: self.root(sp.sympify(1 - m * sine**2))}
        expression = super().at_start(expression)
        values = {}
        for f in expression.atoms(Sn, Cn, Dn):
            # −1 is as good a turning point of u₂ as 1, from which sn and cn are of the other sign
            shift = sp.simplify(f.args[0] / two_K - phase)
            assert shift in (0, 1)
            values[f] = begin[f.func] * (-1 if shift and f.func is not Dn else 1)
        return expression.xreplace(values)


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
        now = {Tanh: sn, Sech: cn}
        return expression.xreplace({f: now[f.func] for f in expression.atoms(Tanh, Sech)})

    def at_start(self, expression):
        """The expression at t = 0, where sinh x₀ = y of x₀ = asinh y."""
        [y] = self.found.x0.value.args
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

    def vanishes(self, expression):
        """With sn 0 = 0 and cn 0 = dn 0 = 1, as the argument never grows."""
        still = {Sn(0, 0): 0, Cn(0, 0): 1, Dn(0, 0): 1}
        return super().vanishes(sp.sympify(expression).subs(still))
