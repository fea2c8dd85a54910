"""The derivation of the heavy top, shown step by step as SICM's ``show-expression`` shows it.

Every expression comes from `heavytop.equations`, where one follows from the other; here they are
put in order, each with its name and a line of words.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

from heavytop.equations import gathered, printing, reduction, shown
from heavytop.equations import lagrangian as lag

SCHEMA = "heavytop/derive/1"

_DOCUMENT = r"""\documentclass{{article}}
\usepackage{{amsmath}}
\begin{{document}}
\section*{{The axisymmetric heavy top}}

{steps}

\end{{document}}
"""


@dataclass(frozen=True, slots=True)
class Equation:
    """One line of a derivation: lhs = expression, both of them sympy's."""

    lhs: Any
    expression: Any


@dataclass(frozen=True, slots=True)
class Step:
    """One step of the derivation.

    Attributes
    ----------
    name : str
        What is derived.
    words : str
        One line of words, in plain ASCII.
    equations : tuple of Equation
        One, or one for each coordinate or component.
    """

    name: str
    words: str
    equations: tuple[Equation, ...]


@cache
def derivation() -> tuple[Step, ...]:
    """Return the steps from the angular velocity to the equations of the axis.

    Examples
    --------
    >>> [step.name for step in derivation()][:3]
    ['angular velocity', 'kinetic energy', 'potential energy']
    >>> print(derivation()[2].equations[0].expression)
    gMR*cos(theta)
    """
    return (*_mechanics(), *_reduction(), *_axis())


def _mechanics() -> Iterator[Step]:
    gather = gathered.by_moments
    yield _step(
        "angular velocity",
        "its body components, from the rotation matrix and its rate",
        zip(shown.OMEGA, lag.angular_velocity(), strict=True),
    )
    yield _step(
        "kinetic energy",
        "principal moments A, A and C about the pivot, which is at rest",
        [(shown.T, lag.kinetic_energy())],
    )
    yield _step(
        "potential energy",
        "summed over the constituents; about the centre of mass their heights cancel",
        [(shown.V, lag.potential_energy())],
    )
    yield _step(
        "Lagrangian",
        "L = T - V; precession, spin and time are absent from it",
        [(shown.L, lag.lagrangian())],
    )
    yield _step(
        "Lagrange equations",
        "for tilt, precession and spin: what vanishes along a motion",
        ((0, gather(equation)) for equation in lag.lagrange_equations()),
    )
    yield _step(
        "accelerations",
        "the Lagrange equations solved; singular where the axis is vertical",
        zip(lag.ACCELERATIONS, map(gather, lag.accelerations()), strict=True),
    )
    yield _step(
        "momenta",
        "derivatives of L by the velocities; the last two are constants of the motion",
        zip(shown.MOMENTA, map(gather, lag.momenta()), strict=True),
    )
    yield _step(
        "energy",
        "the Legendre transform of L, a constant of the motion; it is T + V",
        [(shown.E, gather(lag.energy()))],
    )


def _reduction() -> Iterator[Step]:
    yield _step(
        "cyclic velocities",
        "the definitions of the two constant momenta, solved",
        zip((lag.phidot, lag.psidot), reduction.cyclic_velocities(), strict=True),
    )
    yield _step(
        "Routhian",
        "L less constant momenta times their velocities: a Lagrangian for the tilt",
        [(shown.R, reduction.routhian())],
    )
    yield _step(
        "effective potential",
        "minus what is left of the Routhian without the kinetic energy of the tilt",
        [(shown.V_eff, reduction.effective_potential())],
    )
    yield _step(
        "reduced energy",
        "the energy in the tilt and its rate alone (SICM, equation 2.66)",
        [(shown.E, reduction.reduced_energy())],
    )
    yield _step(
        "cubic",
        "the squared rate of u is a cubic; E' is the energy without that of the spin",
        shown.cubic_equations(),
    )


def _axis() -> Iterator[Step]:
    yield _step(
        "axis",
        "the symmetry axis in space, the third column of the rotation matrix",
        zip(shown.AXIS, lag.axis(), strict=True),
    )
    yield _step(
        "axis equations",
        "the axis e turns about l, the angular momentum over A, and gravity turns l",
        shown.axis_equations(),
    )


def _step(name: str, words: str, equations: Iterable[tuple[Any, Any]]) -> Step:
    return Step(name, words, tuple(Equation(lhs, rhs) for lhs, rhs in equations))


def as_text(steps: Iterable[Step], width: int = 80) -> str:
    """Return the steps as text for a terminal of `width` columns."""
    return "\n\n".join(_text(step, width) for step in steps)


def _text(step: Step, width: int) -> str:
    equations = (printing.in_terminal(e.lhs, e.expression, width - 2) for e in step.equations)
    lines = "\n\n".join(equations).splitlines()
    indented = "\n".join(f"  {line}".rstrip() for line in lines)
    return f"{step.name[0].upper() + step.name[1:]}\n{step.words}\n\n{indented}"


def as_latex(steps: Iterable[Step]) -> str:
    """Return the steps as one LaTeX document, which needs nothing but amsmath."""
    return _DOCUMENT.format(steps="\n\n".join(map(_latex, steps)))


def _latex(step: Step) -> str:
    rows = " \\\\\n".join(printing.in_latex(e.lhs, e.expression) for e in step.equations)
    name = step.name[0].upper() + step.name[1:]
    return f"\\paragraph{{{name}:}} {step.words}.\n\\begin{{align*}}\n{rows}\n\\end{{align*}}"


def derive_document(steps: Iterable[Step]) -> dict[str, Any]:
    """Return the steps as plain values, schema heavytop/derive/1.

    ``lhs`` and ``expression`` are in sympy's own spelling, ``latex`` is the same line in LaTeX.
    """
    return {"schema": SCHEMA, "steps": [_plain(step) for step in steps]}


def _plain(step: Step) -> dict[str, Any]:
    equations = [
        {
            "lhs": str(e.lhs),
            "expression": str(e.expression),
            "latex": printing.in_latex(e.lhs, e.expression),
        }
        for e in step.equations
    ]
    return {"name": step.name, "words": step.words, "equations": equations}
