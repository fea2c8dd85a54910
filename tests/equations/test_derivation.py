"""`heavytop derive`: what it shows is what the book has, in a terminal, in LaTeX and as JSON."""

import json
import re

import pytest
import sympy as sp

from heavytop.equations.derivation import as_latex, as_text, derivation, derive_document

NAMES = (
    "A C gMR theta phi psi thetadot phidot psidot thetaddot phiddot psiddot p_phi p_psi E_prime u "
    "e_x e_y e_z l_x l_y l_z"
)
S = {name: sp.Symbol(name, real=True) for name in NAMES.split()}

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
    "cubic": {"u": "c", "udot**2": "2*(E_prime - gMR*u)*(1 - u**2)/A - ((p_phi - p_psi*u)/A)**2"},
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


@pytest.mark.parametrize("name", BOOK)
def test_is_what_the_book_has(name):
    shown = {str(e.lhs): e.rhs for e in step(name).equations}
    assert list(shown) == list(BOOK[name])
    for lhs, written in BOOK[name].items():
        assert zero(shown[lhs] - read(written)), lhs


def test_the_lagrange_equations_are_those_of_the_lagrangian():
    t = sp.Symbol("t")
    angles = {name: sp.Function(name)(t) for name in ("theta", "phi", "psi")}
    dots = ("ddot", "dot", "")
    back = {f.diff(t, 2 - k): S[name + dots[k]] for k in range(3) for name, f in angles.items()}
    moving = {symbol: rate for rate, symbol in back.items()}
    L = read(BOOK["Lagrangian"]["L"])
    for shown, (name, f) in zip(step("Lagrange equations").equations, angles.items(), strict=True):
        momentum = L.diff(S[f"{name}dot"]).subs(moving)
        residual = momentum.diff(t) - L.diff(S[name]).subs(moving)
        assert shown.lhs == 0
        assert zero(shown.rhs - residual.subs(back)), f


def test_the_text_has_every_step_in_words_and_no_raw_name():
    assert {each.name for each in derivation()} == {*BOOK, "Lagrange equations"}
    text = as_text(derivation())
    assert all(each.words in text for each in derivation())
    for raw in ("theta", "phidot", "E_prime", "psi"):
        assert raw not in text


def test_every_row_of_the_latex_has_one_equation_and_no_raw_name():
    latex = as_latex(derivation())
    assert latex.isascii()
    blocks = re.findall(r"\\begin{align\*}\n(.*?)\n\\end{align\*}", latex, re.DOTALL)
    assert len(blocks) == len(derivation())
    for row in "\\\\\n".join(blocks).split("\\\\\n"):
        assert row.count("&=") == 1
        words = re.findall(r"(?<![\\a-zA-Z])[a-zA-Z]{2,}", row)
        assert set(words) <= {"gMR", "eff"}


def test_json_reads_back_to_the_same_expressions():
    document = json.loads(json.dumps(derive_document(derivation())))
    assert document["schema"] == "heavytop/derive/1"
    for plain, each in zip(document["steps"], derivation(), strict=True):
        assert (plain["name"], plain["words"]) == (each.name, each.words)
        for line, equation in zip(plain["equations"], each.equations, strict=True):
            assert line["lhs"] == str(equation.lhs)
            assert zero(sp.sympify(line["expression"], locals=S) - equation.rhs)
            assert line["latex"] in as_latex(derivation())
