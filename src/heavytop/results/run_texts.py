"""What a run, a plan and a classification say, as facts and tables."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Iterator, Mapping
from decimal import Decimal
from typing import Any, Final

from heavytop.results.base import Fact, Table
from heavytop.scene.quantities import MISSING, QUANTITIES, Quantity, quantity_of
from heavytop.text import duration

ROUNDING: Final = 8 * sys.float_info.epsilon  # of the largest in a column
MANY_TURNS: Final = 1000  # from which on an angle is also given as turns and a rest
FIRST_EVENTS: Final = 8  # rows shown at a terminal; the rest is counted
PROVED_DIGITS: Final = 17  # shown of what is enclosed
CONSTANTS: Final = ("E", "E_prime", "p_phi", "p_psi")
RATE, TIME, NUMBER = Quantity("", "rad/s"), Quantity("", "s"), Quantity("", "")
FACTS: Final = (
    ("nutation", RATE, "{nutation_frequency}"),
    ("", NUMBER, "range of cos θ {nutation_amplitude}"),
    ("", NUMBER, "turns of φ per nutation: {rotation_number}"),
    ("small nutation", RATE, "{small_nutation_frequency} about this motion"),
    ("the other rate", RATE, "{other_precession_rate}{nods}"),
    ("a small tilt", TIME, "grows by e in {growth_time}"),
    ("a small tilt", RATE, "precesses between {slow_cone_rate} and {fast_cone_rate}"),
    ("sleep stable", RATE, "from |ω₃| = {sleeping_threshold} on"),
    ("p_ψ²/4A|gMR|", NUMBER, "{fast_top_ratio}"),
)
"""Of a classification: labels, what the numbers are, and words with the names of facts."""
ESTIMATES: Final = {
    "precession": (RATE, "mean φ̇"),
    "period": (TIME, "period"),
    "amplitude": (NUMBER, "range of cos θ"),
    "round": (TIME, "once round in"),
}
"""Of a fast top: what textbooks estimate, and what it is."""


# --- a motion, known without integrating -----------------------------------------------------


def verdict_facts(motion: Mapping[str, Any]) -> Iterator[Fact]:
    """The kind of a motion, its tags, and why."""
    proof = "proved" if motion["certified"] else f"|x| < {NUMBER.text(motion['bound'])}"
    yield "kind", f"{motion['kind']}, {proof}"
    for label, name in (("tags", "tags"), ("tags undecided", "open_tags")):
        if motion[name]:
            yield label, ", ".join(motion[name])
    yield "why", motion["why"]


def course_facts(
    motion: Mapping[str, Any], enclosure: Mapping[str, Any] | None = None
) -> Iterator[Fact]:
    """Range of tilt, period, and means per period, of those there are; as enclosed, if it is."""
    proved = {name: between(*x) for name, x in (enclosure or {}).items() if x and name != "roots"}
    values = {**motion, **proved}
    theta, ends = quantity_of("theta"), [values["theta_min"], values["theta_max"]]
    if None not in ends:
        steady = ends[0] == ends[1]
        degrees = " to ".join(f"{math.degrees(float(end)):.2f}°" for end in ends[steady:])
        aside = f" ({degrees})" if theta.shown[0] != "deg" else ""
        if steady:
            yield "θ", f"{theta.with_unit(ends[0])}{aside}, constant"
        else:
            yield "θ between", f"{theta.with_unit(*ends, between=' and ')}{aside}"
    yield from numbers(values, "period")
    if motion["kind"] == "planar-pendulum" and "swinging" in motion["tags"]:
        twice = TIME.with_unit(2 * float(values["period"]))
        yield "", f"the swing there and back {twice}; φ jumps by π at the vertical"
    yield from numbers(values, "precession", "spin", "round", "amplitude")


def estimate_facts(estimates: Mapping[str, Any]) -> Iterator[Fact]:
    """What textbooks give for a fast top, with their errors."""
    for name, known in estimates.items():
        off = "" if known["error"] is None else f", off by {100 * known['error']:+.3g} %"
        quantity, words = ESTIMATES[name]
        estimate = quantity.with_unit(known["estimate"], form=".3g")
        yield "", f"fast-top estimate: {words} {estimate}{off}"


def rate_facts(facts: Mapping[str, Any]) -> Iterator[Fact]:
    """The rates of a motion and what else follows from its closed form, in the words of `FACTS`."""
    yield from numbers(facts, "omega3")
    yield from _range(facts, "phidot", "mean_precession_rate")
    yield from _range(facts, "psidot", "mean_spin_rate")
    growth, about = facts["growth_rate"], facts["other_nutation_frequency"]
    known = {**facts, "growth_time": 1 / growth if growth else None}
    if facts["steady_branch"] is None:
        known["small_nutation_frequency"] = None
    nods = "" if about is None else f", with a small nutation of {RATE.with_unit(about)}"
    for label, quantity, words in FACTS:
        needed = {name: known[name] for name in known if f"{{{name}}}" in words}
        if None not in needed.values():
            texts = {name: quantity.with_unit(x) for name, x in needed.items()}
            yield label, words.format(**texts, nods=nods)


def _range(facts: Mapping[str, Any], name: str, mean: str) -> Iterator[Fact]:
    label, (low, high) = QUANTITIES[name].symbol, (facts[f"{name}_{end}"] for end in ("min", "max"))
    if low is None or high is None:
        return
    if low == high:
        yield label, RATE.with_unit(low)
        return
    text = RATE.with_unit(low, high)
    if facts[mean] is not None:
        text += f", mean {RATE.with_unit(facts[mean])}"
        if not low <= facts[mean] <= high:  # the angle jumps in passing a pole, and is counted so
            text += " with its jumps by π at the pole"
    yield label, text
    if facts[f"{name}_reverses"]:
        tilt = QUANTITIES["theta"].with_unit(facts[f"{name}_reversal_theta"])
        yield "", f"reverses at θ = {tilt}"


def between(low: str, high: str) -> str:
    """A number between two bounds, of 17 digits or as many as are certain to a unit of the last.

    Examples
    --------
    >>> between("0.09999999999999999999", "0.10000000000000000001"), between("0.1234", "0.1240")
    ('0.1', '0.124')
    """
    least, most = Decimal(low), Decimal(high)
    middle, radius = (least + most) / 2, (most - least) / 2
    last = middle.adjusted() - PROVED_DIGITS + 1
    if radius:
        last = max(last, radius.adjusted() + 1)
    text = round(middle, -last).normalize()
    return f"{text:f}" if -6 < text.adjusted() < PROVED_DIGITS else f"{text:e}"


# --- a plan and a run ------------------------------------------------------------------------


def plan_facts(plan: Mapping[str, Any]) -> Iterator[Fact]:
    """A plan: the equations, their precision, and why."""
    how = [plan["formulation"]]
    if plan["states"]:
        how += [plan["precision"], f"{plan['states']} states"]
        how += [f"tolerance {float(plan['tolerance']):.3g}"]
    yield "plan", ", ".join(how + ["projected"] * bool(plan["projected"]))
    for reason in plan["reasons"]:
        yield "", f"· {reason}"


def forecast_facts(plan: Mapping[str, Any]) -> Iterator[Fact]:
    """What is to be expected of a plan that is not carried out."""
    for warning in plan["warnings"]:
        yield "warning", warning
    if plan["cost_s"] is not None and plan["states"]:
        yield "expected", f"{duration(plan['cost_s'])} of steps"


def end_facts(run: Any) -> Iterator[Fact]:
    """The state at the end, the events that were counted, and what went wrong."""
    if final := run.final:
        angles = [name for name in ("theta", "phi", "psi") if final.get(name) is not None]
        named = ((QUANTITIES[name], final[name]) for name in angles)
        known = ", ".join(f"{each.symbol} = {each.text(x)}" for each, x in named)
        unit = QUANTITIES["theta"].shown[0]
        yield f"at t = {TIME.with_unit(final['t'])}", f"{known} {unit}" if known else MISSING
        if final.get("reaction"):
            force = QUANTITIES["reaction"].with_unit(final["reaction"], form=".8g")
            yield "", f"force of the pivot {force}"
        for name in ("phi", "psi"):
            if abs(turns := final.get(f"{name}_turns") or 0) >= MANY_TURNS:
                rest = QUANTITIES[name].with_unit(final[f"{name}_mod"])
                yield "", f"{QUANTITIES[name].symbol} = {turns} turns and {rest}"
        counts = ((run.events[name], name) for name in ("turning", "reversal", "cusp"))
        wanted = [f"{count} {name}" for count, name in counts if count is not None]
        yield "events", ", ".join(wanted) or "none requested"
    if run.missed_digits:
        yield "digits missed", ", ".join(_sizes(run.missed_digits, ".1e"))
    if run.outcome != "finished":
        yield "outcome", run.outcome
    words = [*_sizes(run.errors, ".3g"), *filter(None, [run.errors.get("why_not")])]
    yield "errors", f"against the closed form: {', '.join(words)}"


def _sizes(errors: Mapping[str, Any], form: str) -> Iterator[str]:
    """Errors by name, with their units."""
    for name, off in errors.items():
        if isinstance(off, int | float):
            yield f"{name.replace('_', ' ')} {quantity_of(name).with_unit(off, form=form)}"


def cost_text(cost: Mapping[str, Any]) -> str:
    """Steps, and the time that each part of the work took."""
    parts = [f"{cost['steps']} step{'s'[: cost['steps'] != 1]}"]
    for label, name in (("derive", "derive_s"), ("compile", "compile_s"), ("run", "integrate_s")):
        if cost[name] is not None:
            parts.append(f"{label} {1000 * cost[name]:.1f} ms")
    if cost["us_per_period"] is not None:
        parts.append(f"{cost['us_per_period']:.1f} µs a period")
    return ", ".join(parts)


def event_table(events: Any) -> Table:
    """The events, with as many digits as fit."""
    columns = {n: settled(row[n] for row in events.table) for n in ("t", "theta", "phi", "phidot")}
    rows = [
        {"event": row.kind, "residual": row.residual} | {n: x[k] for n, x in columns.items()}
        for k, row in enumerate(events.table)
    ]
    return Table(rows, ("event", *columns, "residual"), first=FIRST_EVENTS, more=events.omitted)


def settled(values: Iterable[Any]) -> list[float | None]:
    """The numbers of a column, those that are rounding beside the largest as 0.

    Examples
    --------
    >>> settled([-15, -7.1e-15, "12.3", None])
    [-15.0, 0.0, 12.3, None]
    """
    found = [None if value is None else float(value) for value in values]
    least = ROUNDING * max((abs(value) for value in found if value is not None), default=0.0)
    return [0.0 if value is not None and abs(value) < least else value for value in found]


def numbers(values: Mapping[str, Any], *names: str) -> Iterator[Fact]:
    """Quantities that have a value, by their symbols, with their units."""
    for name in names:
        if values[name] is not None:
            yield QUANTITIES[name].symbol, QUANTITIES[name].with_unit(values[name])
