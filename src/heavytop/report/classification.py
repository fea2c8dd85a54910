"""What is known of a motion without integrating it, as facts."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from decimal import Decimal
from typing import Any, Final

from heavytop.report.parts import FactRows, Known, Part, number, short
from heavytop.report.run import constants, course

Row = tuple[str, str]

DIGITS: Final = 17  # shown of what is enclosed
FACTS: Final = (
    ("nutation", "{nutation_frequency} rad/s"),
    ("", "range of cos θ {nutation_amplitude}"),
    ("", "turns of φ in one: {rotation_number}"),
    ("small nutation", "{small_nutation_frequency} rad/s about this motion"),
    ("the other rate", "{other}"),
    ("a small tilt", "grows by e in {growth_time} s"),
    ("a small tilt", "precesses between {slow_cone_rate} and {fast_cone_rate} rad/s"),
    ("sleeps", "from |ω₃| = {sleeping_threshold} rad/s on"),
    ("p_ψ²/4A|gMR|", "{fast_top_ratio}"),
    ("", "as a fast top: mean φ̇ {fast_top_precession_rate} rad/s{fast_top_precession_error}"),
    ("", "as a fast top: period {fast_top_nutation_period} s{fast_top_period_error}"),
    ("", "as a fast top: range of cos θ {fast_top_amplitude}{fast_top_amplitude_error}"),
)
"""Labels and words, with the names of facts."""


def classify_parts(document: Known) -> Iterator[Part]:
    """A classification: kind and why, range of tilt and means per period, constants, rates."""
    motion, enclosure = document["motion"], document["enclosure"]
    names = ("theta_min", "theta_max", "period", "precession", "spin")
    proved = {name: _proved(motion[name], enclosure[name]) for name in names}
    yield FactRows.of([
        *_verdict(motion),
        *course(motion, proved),
        *constants(document["constants"]),
        *_facts(document["facts"]),
    ])  # fmt: skip


def _proved(value: Any, bounds: list[str] | None) -> Any:
    """A value to as many digits as are proved, where it is enclosed."""
    return value if bounds is None else between(*bounds)


def _verdict(motion: Known) -> Iterator[Row]:
    yield "kind", f"{motion['kind']}, {_proof(motion)}"
    if motion["tags"]:
        yield "tags", ", ".join(motion["tags"])
    if motion["open_tags"]:
        yield "tags undecided", ", ".join(motion["open_tags"])
    yield "why", motion["why"]
    if motion["certified"]:
        low, high = motion["margin_enclosure"]
        within = f", to {high - low:.0e}" if high > low else ""
        yield "margin", f"{number(motion['margin'])}{within}"


def _proof(motion: Known) -> str:
    return "proved" if motion["certified"] else f"|x| < {number(motion['bound'])}"


def between(low: str, high: str) -> str:
    """A number between two bounds, of 17 digits or as many as are certain to a unit of the last.

    Examples
    --------
    >>> between("0.09999999999999999999", "0.10000000000000000001"), between("0.1234", "0.1240")
    ('0.1', '0.124')
    """
    least, most = Decimal(low), Decimal(high)
    middle, radius = (least + most) / 2, (most - least) / 2
    last = middle.adjusted() - DIGITS + 1
    if radius:
        last = max(last, radius.adjusted() + 1)
    text = round(middle, -last).normalize()
    return f"{text:f}" if -6 < text.adjusted() < DIGITS else f"{text:e}"


def _facts(facts: Known) -> Iterator[Row]:
    """The facts that are known, each in the words of `FACTS`."""
    shown = {name: number(x) for name, x in facts.items() if x is not None}
    for name, x in facts.items():
        if name.startswith("fast_top") and name.endswith("error"):
            shown[name] = "" if x is None else f", off by {100 * x:+.3g} %"
        elif name.startswith("fast_top") and x is not None:
            shown[name] = short(x)
    if facts["steady_branch"] is None:
        shown.pop("small_nutation_frequency", None)
    if rate := facts["growth_rate"]:
        shown["growth_time"] = number(1 / rate)
    if (other := facts["other_precession_rate"]) is not None:
        about = facts["other_nutation_frequency"]
        nods = "" if about is None else f", with a small nutation of {number(about)} rad/s"
        shown["other"] = f"{number(other)} rad/s{nods}"
    yield "ω₃", f"{shown['omega3']} rad/s"
    yield from _range(facts, "φ̇", "phidot", "mean_precession_rate")
    yield from _range(facts, "ψ̇", "psidot", "mean_spin_rate")
    for label, words in FACTS:
        with suppress(KeyError):  # of what is not known
            yield label, words.format_map(shown)


def _range(facts: Known, label: str, name: str, mean: str) -> Iterator[Row]:
    low, high = facts[f"{name}_min"], facts[f"{name}_max"]
    if low is None or high is None:
        return
    if low == high:
        yield label, f"{number(low)} rad/s"
        return
    text = f"{number(low)} to {number(high)} rad/s"
    if facts[mean] is not None:
        text += f", in the mean {number(facts[mean])}"
        if not low <= facts[mean] <= high:  # the angle jumps in passing a pole, and is counted so
            text += " with its jumps by π at the pole"
    yield label, text
    if facts[f"{name}_reverses"]:
        yield "", f"reverses at θ = {number(facts[f'{name}_reversal_theta'])} rad"
