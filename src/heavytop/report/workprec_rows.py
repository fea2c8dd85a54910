"""What tables of work–precision documents share: a summary for each method, and its numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple

TARGETS: Final = ("1e-6", "1e-9", "1e-12")
Known = Mapping[str, Any]


class Summary(NamedTuple):
    """A method, at its cheapest within each of `TARGETS`, and at its best.

    Attributes
    ----------
    name : str
        Of auto, with what was asked.
    within : tuple of mapping or None
    best : mapping
    setup_s : float
        The longest of all its settings [s].
    """

    name: str
    within: tuple[Known | None, ...]
    best: Known
    setup_s: float


def summaries(points: Sequence[Known]) -> Iterator[Summary]:
    """A summary for each method, and for each choice of auto.

    Parameters
    ----------
    points : sequence of mapping
        Those of a document of the schema ``heavytop/workprec/1``.
    """
    for of_method in grouped(points, lambda p: (p["method"], p["measures"], p.get("stands_for"),
                                                 p.get("wants"))):  # fmt: skip
        yield Summary(
            _name(of_method),
            tuple(_within(of_method, float(target)) for target in TARGETS),
            min(of_method, key=lambda point: point["error"]),
            max(point["setup_s"] for point in of_method),
        )


def grouped(points: Iterable[Known], key: Callable[[Known], Any]) -> list[list[Known]]:
    """Those with one key together, in the order in which they come."""
    found: dict[Any, list[Known]] = {}
    for point in points:
        found.setdefault(key(point), []).append(point)
    return list(found.values())


def _name(points: Sequence[Known]) -> str:
    return _digits(points) if "digits" in points[0] else str(points[0]["method"])


def _digits(points: Sequence[Known]) -> str:
    """What was asked of auto, as ``auto, 6, 9, 12 of axis``."""
    return f"auto, {', '.join(str(p['digits']) for p in points)} of {_sign(points[0]['wants'])}"


def _sign(wants: str) -> str:
    return "θ" if wants == "theta" else "axis"


def _within(points: Sequence[Known], bound: float) -> Known | None:
    met = [point for point in points if point["error"] <= bound]
    return min(met, key=lambda point: point["us_per_period"], default=None)


def time(point: Known) -> str:
    """The time of a period to three digits [µs], without an exponent."""
    rounded = f"{point['us_per_period']:.3g}"
    return f"{float(rounded):.0f}" if "e" in rounded else rounded


def error(point: Known) -> str:
    """The error of a point, marked where it is that of θ."""
    return f"{point['error']:.1e}{' θ' if point['measures'] == 'theta' else '  '}"


def who(point: Known) -> str:
    """The name of a method, and of auto the method that it chose."""
    return str(point.get("stands_for", point["method"]))


def setting(point: Known) -> str:
    """The setting of a point in words."""
    if point["tolerance"] is not None:
        return f"{point['tolerance']:.2g}"
    return f"{point['steps_a_period']:g} steps a period"
