"""`heavytop derive`: what it shows is what the book has, in a terminal, in LaTeX and as JSON."""

import dataclasses
import json
import re

import pytest
import sympy as sp
from sympy.printing.pretty.pretty_symbology import line_width, pretty_use_unicode

from heavytop.equations.derivation import (
    as_latex,
    as_text,
    derivation,
    derive_document,
    in_terminal,
)

NAMES = (
    "A C gMR theta phi psi thetadot phidot psidot thetaddot phiddot psiddot p_phi p_psi E_prime u "
    "e_x e_y e_z l_x l_y l_z"
)
S = {name: sp.Symbol(name, real=True) for name in NAMES.split()}
STEPS = (
    "angular velocity", "kinetic energy", "potential energy", "Lagrangian", "Lagrange equations",
    "accelerations", "momenta", "energy", "cyclic velocities", "Routhian", "effective potential",
    "reduced energy", "cubic", "axis", "axis equations",
)  # fmt: skip

# Written by hand from SICM, section 2.10, and from the vector equations of a top seen from space.
# omega3 stands for psidot + phidot cos(theta), s and c for sin(theta) and cos(theta).
BOOK = {
    "angular velocity": {
        "omega_1": "phidot*s*sin(psi) + thetadot*cos(psi)",
        "omega_2": "phidot*s*cos(psi) - thetadot*sin(psi)",
        "omega_3": "omega3",
    },
    "kinetic energy": {"T": "(A*(phidot**2*s**2 + thetadot**2) + C*omega3**2)/2"},
    "potential energy": {"V": "gMR*c"},
    "Lagrangian": {"L": "(A*(phidot**2*s**2 + thetadot**2) + C*omega3**2)/2 - gMR*c"},
    "accelerations": {
        "thetaddot": "(A*phidot**2*s*c - C*omega3*phidot*s + gMR*s)/A",
        "phiddot": "(C*omega3 - 2*A*phidot*c)*thetadot/(A*s)",
        "psiddot": "phidot*thetadot*s - c*(C*omega3 - 2*A*phidot*c)*thetadot/(A*s)",
    },
    "momenta": {
        "p_theta": "A*thetadot",
        "p_phi": "A*s**2*phidot + C*omega3*c",
        "p_psi": "C*omega3",
    },
    "energy": {"E": "(A*(phidot**2*s**2 + thetadot**2) + C*omega3**2)/2 + gMR*c"},
    "cyclic velocities": {
        "phidot": "(p_phi - p_psi*c)/(A*s**2)",
        "psidot": "p_psi/C - c*(p_phi - p_psi*c)/(A*s**2)",
    },
    "Routhian": {"R": "A*thetadot**2/2 - (p_phi - p_psi*c)**2/(2*A*s**2) - p_psi**2/(2*C) - gMR*c"},
    "effective potential": {"V_eff": "(p_phi - p_psi*c)**2/(2*A*s**2) + p_psi**2/(2*C) + gMR*c"},
    "reduced energy": {
        "E": "A*thetadot**2/2 + (p_phi - p_psi*c)**2/(2*A*s**2) + p_psi**2/(2*C) + gMR*c"
    },
    "cubic": {
        "u": "c",
        "udot**2": "2*(E_prime - gMR*u)*(1 - u**2)/A - ((p_phi - p_psi*u)/A)**2",
    },
    "axis": {"e_x": "s*sin(phi)", "e_y": "-s*cos(phi)", "e_z": "c"},
    "axis equations": {
        "edot_x": "l_y*e_z - l_z*e_y",
        "edot_y": "l_z*e_x - l_x*e_z",
        "edot_z": "l_x*e_y - l_y*e_x",
        "ldot_x": "-gMR*e_y/A",
        "ldot_y": "gMR*e_x/A",
        "l_z": "p_phi/A",
        "e_x*l_x + e_y*l_y + e_z*l_z": "p_psi/A",
    },
}


def read(text):
    short = {
        "s": sp.sin(S["theta"]),
        "c": sp.cos(S["theta"]),
        "omega3": S["psidot"] + S["phidot"] * sp.cos(S["theta"]),
    }
    return sp.sympify(text, locals=S | short)


def step(name):
    return next(each for each in derivation() if each.name == name)


def zero(expression):
    """Whether an expression vanishes, tried by sympy's rules and not by the package's own."""
    return sp.simplify(sp.expand(sp.expand_trig(expression))) == 0


def test_the_steps_in_order():
    assert tuple(each.name for each in derivation()) == STEPS
    assert set(BOOK) | {"Lagrange equations"} == set(STEPS)


@pytest.mark.parametrize("name", BOOK)
def test_is_what_the_book_has(name):
    shown = {str(e.lhs): e.expression for e in step(name).equations}
    assert list(shown) == list(BOOK[name])
    for lhs, written in BOOK[name].items():
        assert zero(shown[lhs] - read(written)), lhs


def test_the_lagrange_equations_are_those_of_the_lagrangian():
    t = sp.Symbol("t")
    angles = {name: sp.Function(name)(t) for name in ("theta", "phi", "psi")}
    moving = {S[name]: f for name, f in angles.items()}
    moving |= {S[f"{name}dot"]: f.diff(t) for name, f in angles.items()}
    moving |= {S[f"{name}ddot"]: f.diff(t, 2) for name, f in angles.items()}
    L = read(BOOK["Lagrangian"]["L"])
    for shown, (name, f) in zip(step("Lagrange equations").equations, angles.items(), strict=True):
        momentum = L.diff(S[f"{name}dot"]).subs(moving)
        residual = momentum.diff(t) - L.diff(S[name]).subs(moving)
        back = {f.diff(t, 2): S[f"{n}ddot"] for n, f in angles.items()}
        back |= {f.diff(t): S[f"{n}dot"] for n, f in angles.items()}
        back |= {f: S[n] for n, f in angles.items()}
        assert shown.lhs == 0
        assert zero(shown.expression - residual.subs(back))


def test_the_axis_equations_follow_from_the_accelerations():
    q = [S[n] for n in ("theta", "phi", "psi")]
    v = [S[f"{n}dot"] for n in ("theta", "phi", "psi")]
    a = [read(written) for written in BOOK["accelerations"].values()]

    def rate(x):
        return sum(x.diff(p) * r for p, r in zip(q + v, v + a, strict=True))

    e = sp.Matrix([read(written) for written in BOOK["axis"].values()])
    p_psi, p_phi = read("C*omega3"), read("A*s**2*phidot + C*omega3*c")
    ell = e.cross(e.applyfunc(rate)) + p_psi / S["A"] * e
    along = dict(zip([S[n] for n in ("e_x", "e_y", "e_z")], e, strict=True))
    along |= dict(zip([S[n] for n in ("l_x", "l_y", "l_z")], ell, strict=True))
    along |= {S["p_psi"]: p_psi, S["p_phi"]: p_phi}
    left = {
        **{f"edot_{n}": rate(x) for n, x in zip("xyz", e, strict=True)},
        **{f"ldot_{n}": rate(x) for n, x in zip("xy", ell, strict=False)},
        "l_z": ell[2],
        "e_x*l_x + e_y*l_y + e_z*l_z": e.dot(ell),
    }
    for shown in step("axis equations").equations:
        assert zero(left[str(shown.lhs)] - shown.expression.subs(along)), shown.lhs


def test_a_step_cannot_be_changed():
    with pytest.raises(dataclasses.FrozenInstanceError):
        derivation()[0].name = "x"


def columns(text):
    """How many columns the widest line takes; a combining dot takes none."""
    return max(line_width(line) for line in text.splitlines())


class TestText:
    def test_fits_eighty_columns(self):
        assert columns(as_text(derivation())) <= 80

    def test_folds_between_terms_where_the_terminal_is_narrower(self):
        theta_equation = step("Lagrange equations").equations[0]
        wide, narrow = (in_terminal(0, theta_equation.expression, width) for width in (80, 64))
        assert columns(wide) > 64 >= columns(narrow)
        assert narrow.endswith("\n  - gMR⋅sin(θ)")

    def test_has_dots_and_greek_and_each_line_of_words(self):
        text = as_text(derivation())
        for word in ("θ̈ =", "φ̇", "p_φ = ", "p_ψ = ", "E′", "ℓ̇_x", *(s.words for s in derivation())):
            assert word in text
        for raw in ("theta", "phidot", "E_prime", "psi", "↪"):
            assert raw not in text


def test_latex_does_not_depend_on_the_terminal():
    shown = derive_document(derivation())
    before = pretty_use_unicode(False)
    try:
        assert derive_document(derivation()) == shown
        assert as_text(derivation()).splitlines()[3] == (
            "  omega_1 = phidot*sin(psi)*sin(theta) + thetadot*cos(psi)"
        )
    finally:
        pretty_use_unicode(before)


class TestLatex:
    latex = as_latex(derivation())

    def test_braces_and_environments_are_balanced(self):
        depth = 0
        for mark in re.findall(r"(?<!\\)[{}]", self.latex):
            depth += 1 if mark == "{" else -1
            assert depth >= 0
        assert depth == 0
        begun, ended = (re.findall(rf"\\{w}{{([a-z*]+)}}", self.latex) for w in ("begin", "end"))
        assert sorted(begun) == sorted(ended)
        assert begun.count("align*") == len(STEPS)

    def test_every_row_stands_by_itself(self):
        # \left and \right may not be parted by a new row or an &
        for block in re.findall(r"\\begin{align\*}\n(.*?)\n\\end{align\*}", self.latex, re.DOTALL):
            for row in block.split("\\\\\n"):
                assert row.count("&") == 1
                for half in row.split("&"):
                    assert half.count(r"\left") == half.count(r"\right")
                    assert half.count("{") == half.count("}")

    def test_no_name_is_left_raw(self):
        formulas = "".join(re.findall(r"\\begin{align\*}(.*?)\\end", self.latex, re.DOTALL))
        words = re.findall(r"(?<![\\a-zA-Z])[a-zA-Z]{2,}", formulas)
        assert set(words) <= {"gMR", "align", "eff"}
        assert r"\ddot{\theta}" in formulas
        assert r"\dot{\ell}_{x}" in formulas
        assert "E'" in formulas

    def test_is_plain_ascii_with_no_special_sign_in_the_words(self):
        assert self.latex.isascii()
        for each in derivation():
            assert not re.search(r"[\\${}&#%_^~]", each.words + each.name), each.words

    def test_uses_only_commands_of_latex_and_amsmath(self):
        known = {
            "documentclass", "usepackage", "begin", "end", "section", "paragraph", "left", "right",
            "frac", "dot", "ddot", "sin", "cos", "theta", "phi", "psi", "omega", "ell", "mathrm",
            "quad",
        }  # fmt: skip
        assert set(re.findall(r"\\([a-zA-Z]+)", self.latex)) <= known


class TestJson:
    def test_reads_back_to_the_same_expressions(self):
        document = json.loads(json.dumps(derive_document(derivation())))
        assert document == derive_document(derivation())
        assert document["schema"] == "heavytop/derive/1"
        for plain, each in zip(document["steps"], derivation(), strict=True):
            assert (plain["name"], plain["words"]) == (each.name, each.words)
            for line, equation in zip(plain["equations"], each.equations, strict=True):
                assert line["lhs"] == str(equation.lhs)
                assert zero(sp.sympify(line["expression"], locals=S) - equation.expression)
                assert line["latex"] in TestLatex.latex
