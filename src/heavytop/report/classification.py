"""What is known of a motion without integrating it, as facts."""

from __future__ import annotations

from collections.abc import Iterator
from decimal import Decimal
from typing import Any, Final

from heavytop.report.parts import Facts, Known, Part, number, short
from heavytop.report.run import constants, course

Row = tuple[str, str]

DIGITS: Final = 17  # shown of what is enclosed


def classify_parts(document: Known) -> Iterator[Part]:
    """A classification: kind and why, range of tilt and means per period, constants, rates."""
    motion, enclosure = document["motion"], document["enclosure"]
    names = ("theta_min", "theta_max", "period", "precession", "spin")
    proved = {name: _proved(motion[name], enclosure[name]) for name in names}
    yield Facts.of([
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
    yield "ω₃", f"{number(facts['omega3'])} rad/s"
    yield from _range(facts, "φ̇", "phidot", "mean_precession_rate")
    yield from _range(facts, "ψ̇", "psidot", "mean_spin_rate")
    yield from _nutation(facts)
    yield from _steady(facts)
    yield from _on_the_vertical(facts)
    yield from _fast_top(facts)


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


def _nutation(facts: Known) -> Iterator[Row]:
    if facts["nutation_frequency"] is None:
        return
    yield "nutation", f"{number(facts['nutation_frequency'])} rad/s"
    yield "", f"range of cos θ {number(facts['nutation_amplitude'])}"
    if facts["rotation_number"] is not None:
        yield "", f"turns of φ in one: {number(facts['rotation_number'])}"


def _steady(facts: Known) -> Iterator[Row]:
    if facts["steady_branch"] is None:
        return
    nodding = facts["small_nutation_frequency"]
    yield "small nutation", f"{number(nodding)} rad/s about this motion"
    if facts["other_precession_rate"] is not None:
        other = facts["other_nutation_frequency"]
        about = "" if other is None else f", with a small nutation of {number(other)} rad/s"
        yield "the other rate", f"{number(facts['other_precession_rate'])} rad/s{about}"


def _on_the_vertical(facts: Known) -> Iterator[Row]:
    if facts["growth_rate"] is not None:
        yield "a small tilt", f"grows by e in {number(1 / facts['growth_rate'])} s"
    if facts["slow_cone_rate"] is not None:
        slow, fast = number(facts["slow_cone_rate"]), number(facts["fast_cone_rate"])
        yield "a small tilt", f"precesses between {slow} and {fast} rad/s"
    if facts["sleeping_threshold"] is not None:
        yield "sleeps", f"from |ω₃| = {number(facts['sleeping_threshold'])} rad/s on"


def _fast_top(facts: Known) -> Iterator[Row]:
    if facts["fast_top_ratio"] is None:
        return
    yield "p_ψ²/4A|gMR|", short(facts["fast_top_ratio"])
    for label, value, error, unit in (
        ("mean φ̇", "precession_rate", "precession_error", " rad/s"),
        ("period", "nutation_period", "period_error", " s"),
        ("range of cos θ", "amplitude", "amplitude_error", ""),
    ):
        estimate = facts[f"fast_top_{value}"]
        if estimate is not None:
            off = _percent(facts[f"fast_top_{error}"])
            yield "", f"as a fast top: {label} {short(estimate)}{unit}{off}"


def _percent(error: float | None) -> str:
    return "" if error is None else f", off by {100 * error:+.3g} %"
