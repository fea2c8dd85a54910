"""A run, a plan, and what is known of a motion without integrating: as facts and tables."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Iterator
from contextlib import suppress
from decimal import Decimal
from typing import Any, Final

from heavytop.report.tables import (
    MISSING,
    SYMBOLS,
    Fitting,
    Known,
    Line,
    Row,
    Table,
    headed,
    in_units,
    number,
    quantities,
    short,
    shown_unit,
    size,
)
from heavytop.spelling import duration

ROUNDING: Final = 8 * sys.float_info.epsilon  # of the largest in a column
MANY_TURNS: Final = 1000  # from which on an angle is also told as turns and a rest
FIRST_EVENTS: Final = 8  # rows shown at a terminal; the rest is counted
MOST_DIGITS, FEWEST_DIGITS = 12, 3  # of the numbers of an event
PROVED_DIGITS: Final = 17  # shown of what is enclosed
CONSTANTS: Final = ("E", "E_prime", "p_phi", "p_psi")
COURSE: Final = ("theta_min", "theta_max", "period", "precession", "spin")
OFF: Final = {  # what distances from the closed form are measured in
    "axis": "(a length)", "rates": "rad/s", "energy": "(relative)", "event_time": "s",
}  # fmt: skip
FACTS: Final = (
    ("nutation", "{nutation_frequency} rad/s"),
    ("", "range of cos θ {nutation_amplitude}"),
    ("", "turns of φ per nutation: {rotation_number}"),
    ("small nutation", "{small_nutation_frequency} rad/s about this motion"),
    ("the other rate", "{other}"),
    ("a small tilt", "grows by e in {growth_time} s"),
    ("a small tilt", "precesses between {slow_cone_rate} and {fast_cone_rate} rad/s"),
    ("sleep stable", "from |ω₃| = {sleeping_threshold} rad/s on"),
)
"""Of a classification: labels and words, with the names of facts."""
ESTIMATES: Final = (
    ("precession_rate", "precession_error", "mean φ̇ {} rad/s"),
    ("nutation_period", "period_error", "period {} s"),
    ("amplitude", "amplitude_error", "range of cos θ {}"),
)
"""Of a fast top: an estimate, its error, and its words."""


def run_parts(document: Known) -> Iterator[Line]:
    """A run: what is known without integrating, the plan, the end, the events, the errors."""
    motion, rows, cost = document["motion"], document["events"]["table"], document["cost"]
    proved = ", proved" if motion["certified"] else ""
    tags = f" ({', '.join(motion['tags'])})" if motion["tags"] else ""
    yield "kind", f"{motion['kind']}{tags}{proved}"
    if motion["why"]:
        yield "why", motion["why"]
    yield from course_rows(motion, motion)
    yield from quantities(document["constants"], *CONSTANTS)
    yield from _estimates(motion["estimates"])
    yield from _plan(document["plan"])
    yield from _notes(document)
    yield from _end(document)
    if rows:
        yield events(rows, document["events"]["omitted"])
    yield "errors", f"against the closed form: {_errors(document['errors'])}"
    if rows and motion["kind"].startswith("through-"):
        yield "at the pole", "φ jumps by π: the value before or after it is given; φ̇ is the limit"
    if "derive_s" in cost:
        yield "cost", _cost(cost)


def plan_parts(document: Known) -> Iterator[Line]:
    """A plan: the equations, their precision, why, and what is expected."""
    plan = document["plan"]
    yield from _plan(plan)
    for warning in plan["warnings"]:
        yield "warning", warning
    if plan["cost_s"] is not None and plan["states"]:
        off = "no digit right" if plan["error"] >= 1 else f"error {short(plan['error'])}"
        yield "expected", f"{duration(plan['cost_s'])} of steps, {off} at the end"


def classify_parts(document: Known) -> Iterator[Line]:
    """A classification: kind and why, range of tilt and means per period, constants, rates."""
    motion, enclosure = document["motion"], document["enclosure"]
    yield from verdict_rows(motion)
    yield from course_rows(motion, {
        name: motion[name] if enclosure[name] is None else between(*enclosure[name])
        for name in COURSE
    })  # fmt: skip
    yield from quantities(document["constants"], *CONSTANTS)
    yield from _facts(document["facts"])
    yield from _estimates(motion["estimates"])
    yield from _notes(document)


def _notes(document: Known) -> Iterator[Row]:
    for text in document.get("warnings", ()):
        yield "note", text


def course_rows(motion: Known, values: Known) -> Iterator[Row]:
    """Range of tilt, period, and means per period, of those there are, with their values."""
    low, high = (number(values[name]) for name in COURSE[:2])
    if MISSING not in (low, high):
        least, greatest = (f"{math.degrees(float(end)):.2f}°" for end in (low, high))
        if low == high:
            yield "θ", f"{low} rad ({least}), constant"
        else:
            yield "θ between", f"{low} and {high} rad ({least} to {greatest})"
    yield from quantities(values, "period")
    if motion["kind"] == "planar-pendulum" and "swinging" in motion["tags"]:
        twice = number(2 * float(motion["period"]))
        yield "", f"the swing there and back {twice} s; φ jumps by π at the vertical"
    yield from quantities(values, "precession", "spin")
    yield from quantities(motion, "round", "amplitude")


def _plan(plan: Known) -> Iterator[Row]:
    marks = ["projected"] if plan["projected"] else []
    tolerance = f"tolerance {short(plan['tolerance'])}"
    how = (plan["precision"], f"{plan['states']} states", tolerance) if plan["states"] else ()
    yield "plan", ", ".join((plan["formulation"], *how, *marks))
    for reason in plan["reasons"]:
        yield "", f"· {reason}"


def _end(document: Known) -> Iterator[Row]:
    """The state at the end, the events that were counted, and what went wrong."""
    if final := document["final"]:
        angles = [name for name in ("theta", "phi", "psi") if final.get(name) is not None]
        shown = (number(_shown(name, final[name])) for name in ("t", *angles))
        t, *values = shown
        known = ", ".join(f"{SYMBOLS[n][0]} = {x}" for n, x in zip(angles, values, strict=True))
        yield (
            f"at t = {t} {shown_unit('t')}",
            f"{known} {shown_unit('theta')}" if known else MISSING,
        )
        if final.get("reaction"):
            yield "", f"force of the pivot {number(final['reaction'], 8)} N"
        for name in ("phi", "psi"):
            if abs(turns := final.get(f"{name}_turns") or 0) >= MANY_TURNS:
                rest = number(final[f"{name}_mod"])
                yield "", f"{SYMBOLS[name][0]} = {turns} turns and {rest} rad"
        counts = ((document["events"][name], name) for name in ("turning", "reversal", "cusp"))
        asked = [f"{count} {name}" for count, name in counts if count is not None]
        yield "events", ", ".join(asked) or "none requested"
    if missed := document["missed_digits"]:
        yield "digits missed", ", ".join(f"{name} {size(off)}" for name, off in missed.items())
    if document["outcome"] != "finished":
        yield "outcome", document["outcome"]


def _shown(name: str, value: Any) -> Any:
    """A value as it is, or in the unit that was asked for."""
    return value if shown_unit(name) == SYMBOLS[name][1] else in_units(name, value)


def events(rows: list[Known], omitted: int) -> Fitting:
    """The events, with as many digits as fit; units below the headings where it is narrow."""
    names = ("t", "theta", "phi", "phidot")
    columns = {name: settled(_shown(name, row[name]) for row in rows) for name in names}
    heads = ("event", *map(headed, (*columns, "residual")))
    kinds = [str(row["kind"]) for row in rows]
    residuals = [short(_shown("residual", row["residual"])) for row in rows]

    def table(digits: int) -> Table:
        below = "\n" if digits < MOST_DIGITS else " "
        numbers = ([number(x, digits) for x in column] for column in columns.values())
        cells = tuple(zip(kinds, *numbers, residuals, strict=True))
        head = tuple(head.replace(" ", below) for head in heads)
        return Table(head, cells, first=FIRST_EVENTS, more=omitted)

    return Fitting(tuple((table(n),) for n in range(MOST_DIGITS, FEWEST_DIGITS - 1, -1)))


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


def _errors(found: Known) -> str:
    known = (
        f"{name.replace('_', ' ')} {short(off)} {OFF.get(name, 'rad')}"
        for name, off in found.items()
        if isinstance(off, int | float)
    )
    return ", ".join(filter(None, (*known, found.get("why_not"))))


def _cost(cost: Known) -> str:
    parts = [f"{cost['steps']} step{'s'[: cost['steps'] != 1]}"]
    for label, name in (("derive", "derive_s"), ("compile", "compile_s"), ("run", "integrate_s")):
        if cost[name] is not None:
            parts.append(f"{label} {1000 * cost[name]:.1f} ms")
    if cost["us_per_period"] is not None:
        parts.append(f"{cost['us_per_period']:.1f} µs a period")
    return ", ".join(parts)


# --- what is known without integrating -----------------------------------------------------------


def verdict_rows(motion: Known) -> Iterator[Row]:
    """The kind of a motion, its tags, and why."""
    proof = "proved" if motion["certified"] else f"|x| < {number(motion['bound'])}"
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


def _facts(facts: Known) -> Iterator[Row]:
    """The facts that are known, each in the words of `FACTS`."""
    shown = {name: number(x) for name, x in facts.items() if x is not None}
    if facts["steady_branch"] is None:
        shown.pop("small_nutation_frequency", None)
    if rate := facts["growth_rate"]:
        shown["growth_time"] = number(1 / rate)
    if (other := facts["other_precession_rate"]) is not None:
        about = facts["other_nutation_frequency"]
        nods = "" if about is None else f", with a small nutation of {number(about)} rad/s"
        shown["other"] = f"{number(other)} rad/s{nods}"
    yield from quantities(facts, "omega3")
    yield from _range(facts, "phidot", "mean_precession_rate")
    yield from _range(facts, "psidot", "mean_spin_rate")
    for label, words in FACTS:
        with suppress(KeyError):  # of what is not known
            yield label, words.format_map(shown)


def _range(facts: Known, name: str, mean: str) -> Iterator[Row]:
    label, (low, high) = SYMBOLS[name][0], (facts[f"{name}_{end}"] for end in ("min", "max"))
    if low is None or high is None:
        return
    if low == high:
        yield label, f"{number(low)} rad/s"
        return
    text = f"{number(low)} to {number(high)} rad/s"
    if facts[mean] is not None:
        text += f", mean {number(facts[mean])}"
        if not low <= facts[mean] <= high:  # the angle jumps in passing a pole, and is counted so
            text += " with its jumps by π at the pole"
    yield label, text
    if facts[f"{name}_reverses"]:
        yield "", f"reverses at θ = {number(facts[f'{name}_reversal_theta'])} rad"


def _estimates(estimates: Known) -> Iterator[Row]:
    """What textbooks give for a fast top, with their errors, and the ratio that is to be large."""
    if not estimates:
        return
    yield "p_ψ²/4A|gMR|", short(estimates.get("ratio"))
    for name, error, words in ESTIMATES:
        if name in estimates:
            off = f", off by {100 * estimates[error]:+.3g} %" if error in estimates else ""
            yield "", f"fast-top estimate: {words.format(short(estimates[name]))}{off}"
