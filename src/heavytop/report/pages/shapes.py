"""What the document of every schema must hold for a page to be made of it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Final

from heavytop.report.pages.forms import (
    Shape,
    Unfit,
    either,
    having,
    known,
    listed,
    named,
    number,
    one_of,
    plain,
    size,
    text,
    truth,
)

MANY: Final = 200  # methods, cases or kinds: a figure of more could not be read
FEW: Final = 60  # keys of a table with names that are free
PANELS: Final = 12  # of a figure
POINTS: Final = 2000  # of a figure, each maybe of another look
CELLS: Final = 10_000  # of a figure, each with a mark
LONGEST: Final = 100  # letters of a name
NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9._=+-]*")


def word(value: Any) -> Any:
    """A name that means itself in a command: no option, nor a list."""
    if len(text(value)) <= LONGEST and NAME.fullmatch(value):
        return value
    raise Unfit(f"{value[:40]!r} is no name of a method, case or scene")


def by_word(shape: Shape, most: int) -> Shape:
    """Things of one shape by names that mean themselves in a command."""
    things = named(shape, most)
    return lambda value: {word(name): each for name, each in things(value).items()}


value: Final = known(either(number, text))  # more than 15 digits are a text
names: Final = listed(text, MANY)
versions: Final = {"versions": named(known(text), FEW)}
places: Final = having(p_phi=number, E_prime=number)
columns: Final = listed(known(number))
sizes: Final = listed(known(size))  # of errors

wish: Final = either(value, names)  # of a scene
scene: Final = having(
    {"format": number, "span": named(value, FEW), "want": named(wish, FEW)},
    name=text, title=text, source=text, top=named(value, FEW), start=named(value, FEW),
)  # fmt: skip
motion: Final = having(
    kind=text, tags=listed(text, MANY), certified=truth, margin=value, theta_min=value,
    theta_max=value, period=value, precession=value, spin=value,
)  # fmt: skip
event: Final = having(kind=text, t=value, theta=value, phi=value, phidot=value, residual=value)
plan: Final = having(
    formulation=word, precision=text, states=number, tolerance=value, projected=truth,
    folded=truth, reasons=listed(text, MANY),
)  # fmt: skip
constants: Final = having(E=value, E_prime=value, p_phi=value, p_psi=value)
final: Final = having(dict.fromkeys(("t", "theta", "phi", "psi"), value))
run: Final = having(
    versions | {"missed_events": named(sizes, FEW)},
    scene=scene, motion=motion, constants=constants, plan=plan, outcome=text,
    events=having(table=listed(event)), final=known(final), errors=named(plain, FEW),
    files=named(text, FEW), missed_digits=named(number, FEW), cost=having(steps=number),
)  # fmt: skip
grown: Final = having(energy=known(number), phase=known(number))
method: Final = having(
    {"formulation": text, "language": text, "setting": named(value, FEW), "stderr": grown,
     "steps": known(number), "us_per_period": known(number), "ended": named(text, MANY)},
    name=word, periods=listed(size), energy=sizes, p_phi=sizes, p_psi=sizes,
    phase_s=sizes, axis=sizes, invariants=named(sizes, PANELS), skipped=known(text),
    energy_exponent=known(number), phase_exponent=known(number),
)  # fmt: skip
drift: Final = having(
    versions,
    scene=scene, periods=number, ensemble=number, samples=number, seed=number,
    methods=listed(method, MANY),
)  # fmt: skip
timed: Final = (
    "tolerance", "steps_a_period", "rhs_evaluations", "energy_error", "setup_s", "runs", "periods",
    "steps", "digits",
)  # fmt: skip
point: Final = having(
    dict.fromkeys(timed, known(number)) | {"wants": text, "stands_for": text, "missed": truth},
    method=word, formulation=text, bits=number, measures=text, us_per_period=size,
    error=known(size), theta_error=known(size), rival=truth, language=text,
)  # fmt: skip
workprec: Final = having(
    versions,
    scene=scene, periods=number, budget=number, points=listed(point, POINTS),
    front=listed(number, POINTS), front_theta=listed(number, POINTS),
    skipped=listed(having({"setting": named(value, FEW), "wants": text}, method=word, reason=text)),
)  # fmt: skip
OUTCOMES: Final = (
    "ok", "inaccurate", "singular", "stalled", "diverged", "step-limit", "time-limit", "refused",
    "missed-events",
)  # fmt: skip
case: Final = having(
    case=word, method=word, outcome=one_of(*OUTCOMES), error=known(number),
    digits_lost=known(number), note=text, untold=truth,
)  # fmt: skip
stress: Final = having(
    versions,
    limits=named(number, FEW), hard=by_word(text, MANY), methods=by_word(text, MANY),
    settings=named(value, MANY),
    cases=listed(case, CELLS), skipped=listed(having(case=word, method=word, reason=text)),
)  # fmt: skip
axis: Final = having(name=word, low=number, high=number, count=number, log=truth)
curve: Final = having(name=text, x=listed(number), y=listed(number))
atlas: Final = having(
    versions | {"tiles": having(done=number, all=number), "what": text},
    scene=scene, axes=having(x=axis, y=axis), shape=listed(number, 2), counts=named(number, MANY),
    uncertified=number, curves=listed(curve, 1000),
    files=named(text, FEW),
)  # fmt: skip
edge: Final = having(
    {"theta": columns}, p_phi=columns, E_prime=columns, rate=columns, fast=listed(truth)
)  # fmt: skip
circuit: Final = having(
    winding=number, s=columns, p_phi=columns, E_prime=columns, precession=columns,
    principal_precession=columns,
)  # fmt: skip
line: Final = having(p_psi=listed(number, MANY), p_phi=columns, E_prime=columns)
grid: Final = listed(listed(known(number), MANY), MANY)
sheet: Final = having({"rate": grid}, p_psi=grid, p_phi=grid, E_prime=grid)
critical_set: Final = having(sheets=listed(sheet, 2), thread=line, sleeping=line, hanging=line)
energy_momentum: Final = having(
    versions | {"critical_set": known(critical_set), "depth": known(number)},
    scene=scene, p_psi=number, ratio=known(number), window=having(p_phi=columns, E_prime=columns),
    start=having(kind=text, p_phi=number, E_prime=number), standing=places, hanging=places,
    thread=known(places), edge=edge, circuit=known(circuit), cusps=known(listed(places, 2)),
    through_top=listed(places, 2), through_bottom=listed(places, 2),
)  # fmt: skip
judged: Final = having(
    {"numbers": text, "failure": known(text), "script": text, "reason": text, "holds": names,
     "needs": known(text)},
    id=text, statement=text, authority=text, bound=known(number), measured=known(number),
    passed=known(truth), skipped=known(text),
)  # fmt: skip


def claim(value: Any) -> Any:
    """A claim whose verdict is that of its numbers."""
    found = judged(value)
    measured, bound, passed = found["measured"], found["bound"], found["passed"]
    if passed and (measured is None or bound is None or measured > bound):
        raise Unfit("passed, but not by its numbers")
    if (passed is None) is not bool(found["skipped"]):
        raise Unfit("neither a verdict nor skipped, or both")
    return found


asked: Final = {"asked": known(listed(text, 2000)), "proofs": truth}
validate: Final = having(versions | asked, claims=listed(claim, 2000))
trace: Final = having(
    name=word, title=text, kind=text, tags=listed(text, MANY), seconds=number,
    axis=listed(listed(number, 3), 2000),
)  # fmt: skip
traces: Final = having(traces=listed(trace, MANY))

SHAPES: Final[Mapping[str, Shape]] = {
    "heavytop/run/1": run,
    "heavytop/traces/1": traces,
    "heavytop/drift/1": drift,
    "heavytop/workprec/1": workprec,
    "heavytop/stress/1": stress,
    "heavytop/atlas/1": atlas,
    "heavytop/energy-momentum/1": energy_momentum,
    "heavytop/validate/1": validate,
}
"""By schema, in the order of the page, what a document must hold."""
