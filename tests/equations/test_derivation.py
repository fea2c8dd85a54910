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
# omega3 stands for psidot + phidot cos(theta), alpha3 for its rate, s and c for sin(theta) and
# cos(theta).
EFFECTIVE = "(p_phi - p_psi*c)**2/(2*A*s**2) + p_psi**2/(2*C) + gMR*c"
KINETIC = "(A*(phidot**2*s**2 + thetadot**2) + C*omega3**2)/2"
ABOUT_THE_VERTICAL = "A*s*(s*phiddot + 2*c*thetadot*phidot) + C*(alpha3*c - omega3*s*thetadot)"
BOOK = [  # a step, and an equation of it
    ("angular velocity", "omega_1", "phidot*s*sin(psi) + thetadot*cos(psi)"),
    ("angular velocity", "omega_2", "phidot*s*cos(psi) - thetadot*sin(psi)"),
    ("angular velocity", "omega_3", "omega3"),
    ("kinetic energy", "T", KINETIC),
    ("potential energy", "V", "gMR*c"),
    ("Lagrangian", "L", f"{KINETIC} - gMR*c"),
    ("Lagrange equations", "0", "A*thetaddot - A*phidot**2*s*c + C*omega3*phidot*s - gMR*s"),
    ("Lagrange equations", "0", ABOUT_THE_VERTICAL),
    ("Lagrange equations", "0", "C*alpha3"),
    ("accelerations", "thetaddot", "(A*phidot**2*s*c - C*omega3*phidot*s + gMR*s)/A"),
    ("accelerations", "phiddot", "(C*omega3 - 2*A*phidot*c)*thetadot/(A*s)"),
    ("accelerations", "psiddot", "phidot*thetadot*s - c*(C*omega3 - 2*A*phidot*c)*thetadot/(A*s)"),
    ("momenta", "p_theta", "A*thetadot"),
    ("momenta", "p_phi", "A*s**2*phidot + C*omega3*c"),
    ("momenta", "p_psi", "C*omega3"),
    ("energy", "E", f"{KINETIC} + gMR*c"),
    ("cyclic velocities", "phidot", "(p_phi - p_psi*c)/(A*s**2)"),
    ("cyclic velocities", "psidot", "p_psi/C - c*(p_phi - p_psi*c)/(A*s**2)"),
    ("Routhian", "R", f"A*thetadot**2/2 - ({EFFECTIVE})"),
    ("effective potential", "V_eff", EFFECTIVE),
    ("reduced energy", "E", f"A*thetadot**2/2 + {EFFECTIVE}"),
    ("cubic", "u", "c"),
    ("cubic", "udot**2", "2*(E_prime - gMR*u)*(1 - u**2)/A - ((p_phi - p_psi*u)/A)**2"),
    *(("axis", f"e_{x}", e) for x, e in (("x", "s*sin(phi)"), ("y", "-s*cos(phi)"), ("z", "c"))),
    ("axis equations", "edot_x", "l_y*e_z - l_z*e_y"),
    ("axis equations", "edot_y", "l_z*e_x - l_x*e_z"),
    ("axis equations", "edot_z", "l_x*e_y - l_y*e_x"),
    ("axis equations", "ldot_x", "-gMR*e_y/A"),
    ("axis equations", "ldot_y", "gMR*e_x/A"),
    ("axis equations", "l_z", "p_phi/A"),
    ("axis equations", "e_x*l_x + e_y*l_y + e_z*l_z", "p_psi/A"),
]
STEPS = list(dict.fromkeys(name for name, *_ in BOOK))


def read(text):
    s, c = sp.sin(S["theta"]), sp.cos(S["theta"])
    short = {"s": s, "c": c, "omega3": S["psidot"] + S["phidot"] * c}
    short["alpha3"] = S["psiddot"] + S["phiddot"] * c - S["phidot"] * S["thetadot"] * s
    return sp.sympify(text, locals=S | short)


def zero(expression):
    """Whether an expression vanishes, tried by sympy's rules and not by the package's own."""
    return sp.simplify(sp.expand(sp.expand_trig(expression))) == 0


@pytest.mark.parametrize("name", STEPS)
def test_is_what_the_book_has(name):
    [shown] = [each.equations for each in derivation() if each.name == name]
    book = [(lhs, read(written)) for at, lhs, written in BOOK if at == name]
    assert [str(each.lhs) for each in shown] == [lhs for lhs, _ in book]
    assert all(zero(each.rhs - rhs) for each, (_, rhs) in zip(shown, book, strict=True))


def test_the_text_has_every_step_in_words_and_no_raw_name():
    assert [each.name for each in derivation()] == STEPS
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
        assert set(re.findall(r"(?<![\\a-zA-Z])[a-zA-Z]{2,}", row)) <= {"gMR", "eff"}


def test_json_reads_back_to_the_same_expressions():
    document = json.loads(json.dumps(derive_document(derivation())))
    assert document["schema"] == "heavytop/derive/1"
    for plain, each in zip(document["steps"], derivation(), strict=True):
        assert (plain["name"], plain["words"]) == (each.name, each.words)
        for line, equation in zip(plain["equations"], each.equations, strict=True):
            assert line["lhs"] == str(equation.lhs)
            assert zero(sp.sympify(line["expression"], locals=S) - equation.rhs)
            assert line["latex"] in as_latex(derivation())
