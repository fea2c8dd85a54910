"""What the document of every schema must hold for a page to be made of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from heavytop.pages.foreign import (
    Shape,
    either,
    having,
    known,
    listed,
    named,
    number,
    text,
    truth,
)

MANY: Final = 200  # methods, cases or kinds: a figure of more could not be read
value: Final = known(either(number, text))  # more than 15 digits are a text
places: Final = having(p_phi=number, E_prime=number)
columns: Final = listed(known(number))

scene: Final = having(name=text, title=text, source=text, top=named(value), start=named(value))
motion: Final = having(
    kind=text, tags=listed(text, MANY), certified=truth, margin=value, theta_min=value,
    theta_max=value, period=value, precession=value, spin=value,
)  # fmt: skip
event: Final = having(kind=text, t=value, theta=value, phi=value, phidot=value, residual=value)
plan: Final = having(
    formulation=text, precision=text, states=number, tolerance=value, projected=truth,
    folded=truth, reasons=listed(text, MANY),
)  # fmt: skip
run: Final = having(
    scene=scene, motion=motion, constants=named(value), plan=plan, outcome=text,
    events=having(table=listed(event)), final=known(named(lambda _: None)),
    errors=named(lambda _: None), files=named(text), versions=named(text),
    missed_digits=named(number), cost=having(steps=number),
)  # fmt: skip
method: Final = having(
    name=text, periods=listed(number), energy=columns, p_phi=columns, p_psi=columns,
    phase_s=columns, axis=columns, invariants=named(columns, MANY), skipped=known(text),
    energy_exponent=known(number), phase_exponent=known(number),
)  # fmt: skip
drift: Final = having(
    scene=scene, periods=number, ensemble=number, samples=number, seed=number,
    methods=listed(method, MANY),
)  # fmt: skip
point: Final = having(
    method=text, formulation=text, bits=number, measures=text, us_per_period=number,
    error=known(number), theta_error=known(number), rival=truth, language=text,
)  # fmt: skip
workprec: Final = having(
    scene=scene, periods=number, budget=number, points=listed(point, 5000),
    front=listed(number, 5000), front_theta=listed(number, 5000),
    skipped=listed(named(lambda _: None)),
)  # fmt: skip
case: Final = having(
    case=text, method=text, outcome=text, error=known(number), digits_lost=known(number), note=text,
    untold=truth,
)  # fmt: skip
stress: Final = having(
    limits=named(number), hard=named(text, MANY), methods=named(text, MANY),
    cases=listed(case, MANY * MANY), skipped=listed(having(case=text, method=text, reason=text)),
)  # fmt: skip
axis: Final = having(name=text, low=number, high=number, count=number, log=truth)
curve: Final = having(name=text, x=listed(number), y=listed(number))
atlas: Final = having(
    scene=scene, axes=having(x=axis, y=axis), shape=listed(number, 2), counts=named(number, MANY),
    uncertified=number, curves=listed(curve, 1000), files=named(text),
)  # fmt: skip
energy_momentum: Final = having(
    scene=scene, p_psi=number, ratio=known(number), window=having(p_phi=columns, E_prime=columns),
    start=having(kind=text, p_phi=number, E_prime=number), standing=places, hanging=places,
    thread=known(places), edge=having(p_phi=columns, E_prime=columns, rate=columns),
    circuit=known(having(winding=number, s=columns, precession=columns)),
)  # fmt: skip
claim: Final = having(
    id=text, statement=text, authority=text, bound=value, measured=value, passed=known(truth),
    skipped=known(text),
)  # fmt: skip
validate: Final = having(claims=listed(claim, 2000))
trace: Final = having(
    name=text, title=text, kind=text, tags=listed(text, MANY), seconds=number,
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
