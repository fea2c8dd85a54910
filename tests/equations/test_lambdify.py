"""Expressions in other arithmetics, against sympy's own evaluation."""

import math
import random
import re

import heyoka as hy
import mpmath
import numpy as np
import pytest
import sympy as sp

from heavytop.equations.formulation import FORMULATIONS
from heavytop.equations.lambdify import Rounded, evaluate, exact_values, lambdify
from heavytop.errors import NotANumber, WrongType
from heavytop.exact import PI, Exact
from heavytop.integration.system import translate
from heavytop.run.binary_motion import start_values
from heavytop.scene.scene import load_scene
from heavytop.scene.scene_file import shipped_scenes

x, y = sp.symbols("x y", real=True)
X, Y = hy.make_vars("x", "y")


@pytest.mark.parametrize("expression", [
    x / 3 + sp.sqrt(2) * y,
    sp.Rational("0.1") * x - sp.Rational(7, 9),
    x / (3 * y * sp.sqrt(x)),
    sp.sin(x) ** 2 / sp.cos(y) ** 3,
    sp.sin(sp.Integer(1)) * x + sp.Rational(1, 3) / sp.sqrt(sp.Integer(2)),
    sp.sqrt(x) ** 3 - x**-2 + sp.exp(y) * sp.log(x),
    -x * y + 10**20,
], ids=str)  # fmt: skip
@pytest.mark.parametrize("precision", [53, 240])
def test_constants_are_exact_at_the_working_precision(expression, precision):
    """At x = 3/4 and y = 5/8, numbers that are exact in any precision."""
    there = translate([expression], {"x": X, "y": Y}, precision)
    kind = {} if precision == 53 else {"fp_type": hy.real, "prec": precision}
    function = hy.cfunc(there, [X, Y], compact_mode=True, **kind)
    numbers = [x if precision == 53 else hy.real(x, precision) for x in (0.75, 0.625)]
    found = sp.Float(str(function(numbers)[0]), max(17, int(precision * 0.3)))
    exact = expression.subs({x: sp.Rational(3, 4), y: sp.Rational(5, 8)}).evalf(90)
    error = abs(found - exact) / max(1, abs(exact))
    assert error < sp.Float(2) ** (4 - precision)


@pytest.mark.parametrize(("named", "expression"), {
    "Abs(x)": 1 + sp.Abs(x),
    "w": sp.sin(x) + sp.Symbol("w"),
    "f(x)": sp.Function("f")(x) * 2,
    "x**(-1/3)": y * x ** -sp.Rational(1, 3),
    "pi": x + sp.pi,
    "0.1": x * sp.Float("0.1", 80),
    "oo": x + sp.oo,
}.items())  # fmt: skip
def test_what_cannot_be_translated_is_named(named, expression):
    with pytest.raises(WrongType, match=re.escape(named)):
        translate([expression], {"x": X, "y": Y})


@pytest.mark.parametrize("name", FORMULATIONS)
def test_every_arithmetic_gives_the_rates_that_sympy_gives(name):
    form = FORMULATIONS[name].build()
    symbols = (*form.states, *form.constants_in(form.derivatives))
    source = random.Random(name)
    values = [sp.Rational(source.randint(2**8, 2**10), 2**10) for _ in symbols]
    there = dict(zip(symbols, values, strict=True))
    exact = [sp.sympify(x).subs(there).evalf(60) for x in form.derivatives]
    doubles = [float(x) for x in values]
    named = {s.name: x for s, x in zip(symbols, doubles, strict=True)}
    variables = {s.name: hy.expression(s.name) for s in symbols}
    ctx = mpmath.MPContext()
    ctx.dps = 50
    by_math, by_mpmath = (
        {name: getattr(library, name) for name in ("sin", "cos", "sqrt")} for library in (math, ctx)
    )
    precise = lambdify(form.derivatives, symbols, ctx.mpf, by_mpmath)
    compiled = hy.cfunc(translate(form.derivatives, variables), [*variables.values()])
    for rates, bound in (
        (lambdify(form.derivatives, symbols)(*doubles), 1e-14),
        (evaluate(form.derivatives, named, float, by_math), 1e-14),
        (compiled(np.array(doubles)), 1e-14),
        (precise(*map(ctx.mpf, doubles)), 1e-48),  # these are exact
    ):
        for rate, true in zip(rates, exact, strict=True):
            assert abs(sp.Float(str(rate), 60) - true) < bound * (1 + abs(true))


@pytest.mark.parametrize("name", FORMULATIONS)
def test_a_start_is_the_exact_one_rounded_once(name):
    entry = FORMULATIONS[name]
    for variant in entry.variants:
        form = entry.build(variant)
        expressions = (*form.parameters.values(), *form.start)
        rounded = Rounded(expressions)
        for scene in map(load_scene, shipped_scenes()):
            at_pole = 0 in (scene.start.theta.sign(), (scene.start.theta - PI).sign())
            if entry.starts_at_pole or not at_pole:
                given = start_values(scene)
                exactly = [float(value) for value in exact_values(expressions, given)]
                assert list(map(float.hex, rounded(given))) == list(map(float.hex, exactly))


def test_what_balls_do_not_round_exact_numbers_do():
    half_way = sp.Integer(1) + sp.Rational(1, 2**53) + x**40  # x^40 decides, below 128 bits
    zero = sp.cos(y) ** 2 + sp.sin(y) ** 2 - 1
    given = {"x": Exact.of("0.001"), "y": Exact.of("1.25")}
    assert Rounded([half_way, zero, x])(given) == [1.0 + 2.0**-52, 0.0, 0.001]
    with pytest.raises(NotANumber, match="larger than any double"):
        Rounded([x * x])({"x": Exact.of("1e200")})
