"""The derivation of the heavy top step by step, printed as SICM's ``show-expression`` prints it.

The expressions are those of `heavytop.equations`, where each is derived from the one before; here
they get names and words, and are printed by sympy.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from typing import Any, Final, NamedTuple

import sympy as sp

from heavytop.equations import lagrangian as lag
from heavytop.equations.euler_poisson import axis_form, g, l_z
from heavytop.equations.lagrangian import A, C, gMR, p_phi, p_psi, theta

DERIVE_SCHEMA = "heavytop/derive/1"
# sympy has a subscript φ, but spells ψ and θ
GREEK: Final = {"p_theta": "p_θ", "p_phi": "p_φ", "p_psi": "p_ψ", "E_prime": "E′"}

_DOCUMENT = r"""\documentclass{{article}}
\usepackage{{amsmath}}
\usepackage[margin=2cm]{{geometry}}
\begin{{document}}
\section*{{The axisymmetric heavy top}}

{steps}

\end{{document}}
"""


class Step(NamedTuple):
    """One step of the derivation.

    Attributes
    ----------
    name : str
        What is derived.
    words : str
        One line of words, in plain ASCII.
    equations : tuple of sympy.Eq
        One, or one for each coordinate or component.
    """

    name: str
    words: str
    equations: tuple[Any, ...]


@cache
def derivation() -> tuple[Step, ...]:
    """Return the steps from the angular velocity to the equations of the axis.

    Examples
    --------
    >>> [step.name for step in derivation()][:3]
    ['angular velocity', 'kinetic energy', 'potential energy']
    >>> print(derivation()[2].equations[0].rhs)
    gMR*cos(theta)
    """
    form = axis_form()
    rates = (rate.subs(g, gMR / A) for rate in form.derivatives)
    steps = (
        ("angular velocity", "its body components, from the rotation matrix and its rate",
         _equations("omega_1:4", *lag.angular_velocity())),
        ("kinetic energy", "principal moments A, A and C about the pivot, which is at rest",
         _equations("T", lag.kinetic_energy())),
        ("potential energy",
         "summed over the constituents; about the centre of mass their heights cancel",
         _equations("V", lag.potential_energy())),
        ("Lagrangian", "L = T - V; precession, spin and time are absent from it",
         _equations("L", lag.lagrangian())),
        ("Lagrange equations", "for tilt, precession and spin: what vanishes along a motion",
         _equations([0, 0, 0], *map(by_moments, lag.lagrange_equations()))),
        ("accelerations", "the Lagrange equations solved; singular where the axis is vertical",
         _equations(lag.ACCELERATIONS, *map(by_moments, lag.accelerations()))),
        ("momenta", "derivatives of L by the velocities; the last two are constants of the motion",
         _equations("p_theta p_phi p_psi", *map(by_moments, lag.momenta()))),
        ("energy", "the Legendre transform of L, a constant of the motion; it is T + V",
         _equations("E", by_moments(lag.energy()))),
        ("cyclic velocities", "the definitions of the two constant momenta, solved",
         _equations("phidot psidot", *lag.cyclic_velocities())),
        ("Routhian", "L less constant momenta times their velocities: a Lagrangian for the tilt",
         _equations("R", lag.routhian())),
        ("effective potential",
         "minus what is left of the Routhian without the kinetic energy of the tilt",
         _equations("V_eff", lag.effective_potential())),
        ("reduced energy", "the energy in the tilt and its rate alone (SICM, equation 2.66)",
         _equations("E", lag.reduced_energy())),
        ("cubic", "the squared rate of u is a cubic; E' is the energy without that of the spin",
         _equations([lag.u, sp.Symbol("udot") ** 2], sp.cos(theta), lag.cubic())),
        ("axis", "the symmetry axis in space, the third column of the rotation matrix",
         _equations("e_x e_y e_z", *lag.axis())),
        ("axis equations",
         "the axis e turns about l, the angular momentum over A, and gravity turns l",
         _equations("edot_x edot_y edot_z ldot_x ldot_y", *rates)
         + _equations([l_z, form.spin], p_phi / A, p_psi / A)),
    )  # fmt: skip
    return tuple(map(Step._make, steps))


def _equations(left: str | Sequence[Any], *right: Any) -> tuple[Any, ...]:
    """The equations of left sides, by their names or as expressions, and right sides."""
    names = sp.symbols(left, seq=True) if isinstance(left, str) else left
    return tuple(sp.Eq(*sides, evaluate=False) for sides in zip(names, right, strict=True))


def by_moments(expression: Any) -> Any:
    """Return a fraction whose numerator is linear in A, C and gMR, collected by these.

    Examples
    --------
    >>> print(by_moments(sp.expand(lag.kinetic_energy())))
    (A*(phidot**2*sin(theta)**2 + thetadot**2) + C*(phidot*cos(theta) + psidot)**2)/2
    """
    above, below = sp.fraction(sp.cancel(sp.together(expression)))
    return sp.factor_terms(sp.collect(sp.expand(above), (A, C, gMR), _shortest) / below)


def _shortest(coefficient: Any) -> Any:
    """Return the coefficient in sines or in cosines, whichever factors into less."""
    sines = lag.normal_form(coefficient)
    cosines = sp.expand(sines.subs(sp.sin(theta) ** 2, 1 - sp.cos(theta) ** 2))
    return min(map(sp.factor, (sines, cosines)), key=sp.count_ops)


def as_text(steps: Iterable[Step], width: int = 80) -> str:
    """Return the steps as text for a terminal of `width` columns."""
    return "\n\n".join(_text(step, width) for step in steps)


def _text(step: Step, width: int) -> str:
    """A step as text: its name, its words and its equations."""
    equations = "\n\n".join(_pretty_text(each, width - 2) for each in step.equations)
    indented = "\n".join(f"  {line}".rstrip() for line in equations.splitlines())
    return f"{step.name.capitalize()}\n{step.words}\n\n{indented}"


def _pretty_text(equation: Any, width: int) -> str:
    """An equation in two-dimensional text, with Greek letters."""
    greek = {x: sp.Symbol(GREEK.get(x.name, x.name)) for x in equation.free_symbols}
    text: str = sp.pretty(equation.xreplace(greek), use_unicode=True, num_columns=width)
    return text


def as_latex(steps: Iterable[Step]) -> str:
    """Return the steps as one LaTeX document."""
    return _DOCUMENT.format(steps="\n\n".join(map(_latex, steps)))


def _latex(step: Step) -> str:
    """A step in LaTeX."""
    rows = " \\\\\n".join(map(_row, step.equations))
    title = f"\\paragraph{{{step.name.capitalize()}:}} {step.words}."
    return f"{title}\n\\begin{{align*}}\n{rows}\n\\end{{align*}}"


def _row(equation: Any) -> str:
    """An equation as a row of LaTeX's ``align*``."""
    latex: str = sp.latex(equation, fold_func_brackets=True, symbol_names={lag.E_prime: "E'"})
    return latex.replace(" = ", " &= ")


def derive_document(steps: Iterable[Step]) -> dict[str, Any]:
    """Return the steps as plain values, schema heavytop/derive/1.

    ``lhs`` and ``expression`` are in sympy's own spelling, ``latex`` is the same line in LaTeX.
    """
    rows = [{**x._asdict(), "equations": [_strings(e) for e in x.equations]} for x in steps]
    return {"schema": DERIVE_SCHEMA, "steps": rows}


def _strings(equation: Any) -> dict[str, str]:
    """An equation as JSON has it."""
    return {"lhs": str(equation.lhs), "expression": str(equation.rhs), "latex": _row(equation)}
