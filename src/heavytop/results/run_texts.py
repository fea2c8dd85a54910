"""What a run, a plan and a classification say, as facts and tables."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from decimal import Decimal
from typing import Any, Final

from heavytop.results.base import Fact, Table, with_unit
from heavytop.scene.quantities import MISSING, QUANTITIES, Quantity, quantity_of
from heavytop.text import duration

ROUNDING: Final = 8 * sys.float_info.epsilon  # of the largest in a column
MANY_TURNS: Final = 1000  # from which on an angle is also told as turns and a rest
FIRST_EVENTS: Final = 8  # rows shown at a terminal; the rest is counted
PROVED_DIGITS: Final = 17  # shown of what is enclosed
CONSTANTS: Final = ("E", "E_prime", "p_phi", "p_psi")
COURSE: Final = ("theta_min", "theta_max", "period", "precession", "spin")
FACTS: Final = (
    ("nutation", "rad/s", "{nutation_frequency}"),
    ("", "", "range of cos θ {nutation_amplitude}"),
    ("", "", "turns of φ per nutation: {rotation_number}"),
    ("small nutation", "rad/s", "{small_nutation_frequency} about this motion"),
    ("the other rate", "rad/s", "{other_precession_rate}{nods}"),
    ("a small tilt", "s", "grows by e in {growth_time}"),
    ("a small tilt", "rad/s", "precesses between {slow_cone_rate} and {fast_cone_rate}"),
    ("sleep stable", "rad/s", "from |ω₃| = {sleeping_threshold} on"),
    ("p_ψ²/4A|gMR|", "", "{fast_top_ratio}"),
)
"""Of a classification: labels, units, and words with the names of facts."""
ESTIMATES: Final = {
    "precession": ("rad/s", "mean φ̇ {}"),
    "period": ("s", "period {}"),
    "amplitude": ("", "range of cos θ {}"),
    "round": ("s", "once round in {}"),
}
"""Of a fast top: what textbooks estimate, its unit, and words."""


def run_facts(run: Any) -> Iterator[Fact]:
    """A run: what follows without integrating, the plan, the end, the errors, the cost."""
    motion, cost = run.motion, run.cost
    proved = ", proved" if motion.certified else ""
    tags = f" ({', '.join(motion.tags)})" if motion.tags else ""
    yield "kind", f"{motion.kind}{tags}{proved}"
    if motion.why:
        yield "why", motion.why
    yield from course_rows(motion, motion)
    yield from quantities(run.constants, *CONSTANTS)
    yield from _estimates(motion.estimates)
    yield from _plan(run.plan)
    yield from (("note", text) for text in run.warnings)
    yield from _end(run)
    yield "errors", f"against the closed form: {_errors(run.errors)}"
    if run.events.table and motion.kind.startswith("through-"):
        yield "at the pole", "φ jumps by π: the value before or after it is given; φ̇ is the limit"
    yield "cost", _cost(cost)


def plan_facts(plan: Mapping[str, Any]) -> Iterator[Fact]:
    """A plan: the equations, their precision, why, and what is expected."""
    yield from _plan(plan)
    for warning in plan["warnings"]:
        yield "warning", warning
    if plan["cost_s"] is not None and plan["states"]:
        yield "expected", f"{duration(plan['cost_s'])} of steps"


def classify_facts(found: Any) -> Iterator[Fact]:
    """A classification: kind and why, range of tilt and means per period, constants, rates."""
    motion, enclosure = found.motion, found.enclosure
    yield from verdict_rows(motion)
    yield from course_rows(motion, {
        name: motion[name] if enclosure[name] is None else between(*enclosure[name])
        for name in COURSE
    })  # fmt: skip
    yield from quantities(found.constants, *CONSTANTS)
    yield from _facts(found.motion_facts)
    yield from _estimates(motion["estimates"])
    yield from (("note", text) for text in found.warnings)


def course_rows(motion: Mapping[str, Any], values: Mapping[str, Any]) -> Iterator[Fact]:
    """Range of tilt, period, and means per period, of those there are, with their values."""
    low, high = (measured("", values[name]) for name in COURSE[:2])
    if MISSING not in (low, high):
        least, greatest = (f"{math.degrees(float(end)):.2f}°" for end in (low, high))
        aside = "deg" not in quantity_of("theta").shown  # else it would be said twice
        if low == high:
            yield "θ", f"{measured('rad', low)}{aside * f' ({least})'}, constant"
        else:
            both = measured("rad", low, high, between=" and ")
            yield "θ between", f"{both}{aside * f' ({least} to {greatest})'}"
    yield from quantities(values, "period")
    if motion["kind"] == "planar-pendulum" and "swinging" in motion["tags"]:
        twice = measured("s", 2 * float(motion["period"]))
        yield "", f"the swing there and back {twice}; φ jumps by π at the vertical"
    yield from quantities(values, "precession", "spin")
    yield from quantities(motion, "round", "amplitude")


def _plan(plan: Mapping[str, Any]) -> Iterator[Fact]:
    marks = ["projected"] if plan["projected"] else []
    tolerance = f"tolerance {short(plan['tolerance'])}"
    how = (plan["precision"], f"{plan['states']} states", tolerance) if plan["states"] else ()
    yield "plan", ", ".join((plan["formulation"], *how, *marks))
    for reason in plan["reasons"]:
        yield "", f"· {reason}"


def _end(run: Any) -> Iterator[Fact]:
    """The state at the end, the events that were counted, and what went wrong."""
    if final := run.final:
        angles = [name for name in ("theta", "phi", "psi") if final.get(name) is not None]
        t, theta = QUANTITIES["t"], QUANTITIES["theta"]
        named = ((QUANTITIES[name], final[name]) for name in angles)
        known = ", ".join(f"{each.symbol} = {each.text(x)}" for each, x in named)
        yield (
            f"at t = {t.text(final['t'])} {t.shown[0]}",
            f"{known} {theta.shown[0]}" if known else MISSING,
        )
        if final.get("reaction"):
            force = ", ".join(f"{x:.8g}" for x in final["reaction"])
            yield "", f"force of the pivot [{force}] N"
        for name in ("phi", "psi"):
            if abs(turns := final.get(f"{name}_turns") or 0) >= MANY_TURNS:
                rest = measured("rad", final[f"{name}_mod"])
                yield "", f"{QUANTITIES[name].symbol} = {turns} turns and {rest}"
        counts = ((run.events[name], name) for name in ("turning", "reversal", "cusp"))
        asked = [f"{count} {name}" for count, name in counts if count is not None]
        yield "events", ", ".join(asked) or "none requested"
    if missed := run.missed_digits:
        yield "digits missed", ", ".join(f"{name} {off:.1e}" for name, off in missed.items())
    if run.outcome != "finished":
        yield "outcome", run.outcome


def event_tables(events: Any) -> Iterator[Table]:
    """The events, with as many digits as fit."""
    if not events.table:
        return
    columns = {n: settled(row[n] for row in events.table) for n in ("t", "theta", "phi", "phidot")}
    rows = [
        {"event": row.kind, "residual": row.residual} | {n: x[k] for n, x in columns.items()}
        for k, row in enumerate(events.table)
    ]
    yield Table(rows, ("event", *columns, "residual"), first=FIRST_EVENTS, more=events.omitted)


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


def _errors(found: Mapping[str, Any]) -> str:
    known = (
        f"{name.replace('_', ' ')} {short(off)} {quantity_of(name).unit}".removesuffix(" 1")
        for name, off in found.items()
        if isinstance(off, int | float)
    )
    return ", ".join(filter(None, (*known, found.get("why_not"))))


def _cost(cost: Mapping[str, Any]) -> str:
    parts = [f"{cost['steps']} step{'s'[: cost['steps'] != 1]}"]
    for label, name in (("derive", "derive_s"), ("compile", "compile_s"), ("run", "integrate_s")):
        if cost[name] is not None:
            parts.append(f"{label} {1000 * cost[name]:.1f} ms")
    if cost["us_per_period"] is not None:
        parts.append(f"{cost['us_per_period']:.1f} µs a period")
    return ", ".join(parts)


# --- without integrating -------------------------------------------------------------------------


def verdict_rows(motion: Mapping[str, Any]) -> Iterator[Fact]:
    """The kind of a motion, its tags, and why."""
    proof = "proved" if motion["certified"] else f"|x| < {measured('', motion['bound'])}"
    yield "kind", f"{motion['kind']}, {proof}"
    if motion["tags"]:
        yield "tags", ", ".join(motion["tags"])
    if motion["open_tags"]:
        yield "tags undecided", ", ".join(motion["open_tags"])
    yield "why", motion["why"]


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


def _facts(facts: Mapping[str, Any]) -> Iterator[Fact]:
    """The facts that are known, each in the words of `FACTS`."""
    known = {name: x for name, x in facts.items() if isinstance(x, int | float)}
    if facts["steady_branch"] is None:
        known.pop("small_nutation_frequency", None)
    if rate := facts["growth_rate"]:
        known["growth_time"] = 1 / rate
    about = facts["other_nutation_frequency"]
    nods = "" if about is None else f", with a small nutation of {measured('rad/s', about)}"
    yield from quantities(facts, "omega3")
    yield from _range(facts, "phidot", "mean_precession_rate")
    yield from _range(facts, "psidot", "mean_spin_rate")
    for label, unit, words in FACTS:
        shown = {name: measured(unit, x) for name, x in known.items()}
        with suppress(KeyError):  # of what is not known
            yield label, words.format(**shown, nods=nods)


def _range(facts: Mapping[str, Any], name: str, mean: str) -> Iterator[Fact]:
    label, (low, high) = QUANTITIES[name].symbol, (facts[f"{name}_{end}"] for end in ("min", "max"))
    if low is None or high is None:
        return
    if low == high:
        yield label, measured("rad/s", low)
        return
    text = measured("rad/s", low, high)
    if facts[mean] is not None:
        text += f", mean {measured('rad/s', facts[mean])}"
        if not low <= facts[mean] <= high:  # the angle jumps in passing a pole, and is counted so
            text += " with its jumps by π at the pole"
    yield label, text
    if facts[f"{name}_reverses"]:
        yield "", f"reverses at θ = {measured('rad', facts[f'{name}_reversal_theta'])}"


def _estimates(estimates: Mapping[str, Any]) -> Iterator[Fact]:
    """What textbooks give for a fast top, with their errors."""
    for name, known in estimates.items():
        off = "" if known["error"] is None else f", off by {100 * known['error']:+.3g} %"
        unit, words = ESTIMATES[name]
        estimate = measured(unit, known["estimate"], form=".3g")
        yield "", f"fast-top estimate: {words.format(estimate)}{off}"


def quantities(values: Mapping[str, Any], *names: str) -> Iterator[Fact]:
    """Quantities that have a value, by their symbols, with their units."""
    for name in names:
        if values[name] is not None:
            yield QUANTITIES[name].symbol, with_unit(name, values[name])


def measured(unit: str, *values: Any, between: str = " to ", form: str = ".12g") -> str:
    """Values with their unit, as it is or as people asked for it.

    >>> measured("rad", 0.5, 1), measured("", "0.66666666666666666667"), measured("", None)
    ('0.5 to 1 rad', '0.66666666666666666667', '–')
    """
    quantity = Quantity("", unit, format=form)
    factor = quantity.shown[1]
    texts = (quantity.text(x if factor == 1.0 else float(x)) for x in values)
    return f"{between.join(texts)} {quantity.shown[0]}".rstrip()


def short(value: Any) -> str:
    """A value to 3 digits."""
    return Quantity("", format=".3g").text(value if value is None else float(value))
