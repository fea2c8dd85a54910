"""Find: which value of one number of a scene makes a fact of its motion what is asked for.

The range is sampled, and where the answer changes between two samples it is halved until doubles
are next to each other. Facts are proved to more digits than a double has, and so are signs.
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache, partial
from itertools import pairwise
from typing import Any, Final, TypeAlias

from heavytop.analytic.motion import Motion
from heavytop.classification import Kind
from heavytop.classification.classify import SIGN_BITS, SceneSigns, UndecidedError
from heavytop.classification.kinds import RULES, Criterion
from heavytop.errors import BadScene, NoClosedForm, NotANumber
from heavytop.exact import Exact
from heavytop.exact.balls import working
from heavytop.exact.pairs import UNIT
from heavytop.exact.parse import UNITS_OF
from heavytop.scene import arguments
from heavytop.scene.arguments import Reader, Refused
from heavytop.scene.quantities import QUANTITY_READERS, UNIT_OF
from heavytop.scene.scene import Scene
from heavytop.scene.scene_file import TABLES
from heavytop.text import Shown, nearest

FIND_SCHEMA: Final = "heavytop/find/1"
SAMPLES: Final = 128  # of a range, and as many by the logarithm of one without 0
_ROUNDINGS: Final = 8 * UNIT  # of a fact that is made of others
_JUMP: Final = 1e-6  # relative: between doubles next to each other no fact changes so much
_THIRDS: Final = 48  # after which the least of a fact does not change
_WISH: Final = re.compile(r"\s*(.+?)\s*(<=|>=|==|=|≤|≥)\s*(.+?)\s*")
_RANGE: Final = re.compile(r"\s*(top|start)\.(\w+)\s*=([^:]+):([^:]+)(?::\s*([0-9]+)\s*)?")
_RATIOS: Final = ("p_psi^2/4A gMR", "p_ψ²/4A gMR", "p_ψ²/4A|gMR|")
_SPELLINGS: Final = {"==": "=", "≤": "<=", "≥": ">=", **dict.fromkeys(_RATIOS, "ratio")}

Bracket: TypeAlias = tuple[float, float]
Answer: TypeAlias = tuple[list[Bracket], list[Bracket], str]
"""Brackets of the solutions, ranges in which an inequality holds, and why there is nothing."""
MotionAt: TypeAlias = "Callable[[float], Motion | None]"
Distance: TypeAlias = "Callable[[float], float | None]"
"""How far the motion of a value is from what is asked for; its sign is proved. None if nowhere."""


def _per_weight(motion: Motion, power: int, factor: float) -> float | None:
    """A power of |p_ψ| over |gMR|, times a factor; None without either of them."""
    momentum, weight = abs(float(motion.constants.p_psi)), abs(float(motion.top.gMR))
    return factor * momentum**power / weight if momentum and weight else None


FOUND_FACTS: Final[Mapping[str, tuple[Callable[[Motion], float | None], str]]] = {
    "period": (lambda m: m.period, "s"),
    "round": (lambda m: m.round, "s"),
    "theta_min": (lambda m: m.theta_min, "rad"),
    "theta_max": (lambda m: m.theta_max, "rad"),
    "amplitude": (lambda m: m.amplitude, "rad"),
    "precession": (lambda m: m.precession, "rad"),
    "spin": (lambda m: m.spin, "rad"),
    "ratio": (lambda m: _per_weight(m, 2, 1 / (4 * float(m.top.A))), ""),
    "round_estimate": (lambda m: _per_weight(m, 1, 2 * math.pi), "s"),
}
"""Facts and their units: of the motion, p_ψ²/4A gMR, and what the formula of a fast top gives."""


@dataclass(frozen=True)
class Solution:
    """A value that has what is asked for, between two at which that is proved to differ [SI]."""

    value: float
    bracket: tuple[float, float]
    facts: Mapping[str, float | None]


@dataclass(frozen=True)
class Found(Shown):
    """What `find` found: all solutions in the range, in their order.

    Attributes
    ----------
    scene : Scene
    vary, so_that : str
    solutions : tuple of Solution
    why : str
        Where it holds, or why there is none.
    """

    scene: Scene
    vary: str
    so_that: str
    solutions: tuple[Solution, ...]
    why: str

    def document(self) -> dict[str, Any]:
        """The document of the schema ``heavytop/find/1``."""
        found = {name: getattr(self, name) for name in ("vary", "so_that", "why")}
        solutions = [asdict(each) for each in self.solutions]
        return {
            "schema": FIND_SCHEMA,
            "scene": self.scene.problem(),
            **found,
            "solutions": solutions,
        }


def find(scene: Scene, vary: str, so_that: str) -> Found:
    """The values of one number of a scene for which its motion is as asked.

    Parameters
    ----------
    scene : Scene
        Its top and its start.
    vary : str
        Which number, and its range: ``"start.psidot = 10:400"``, with units if one likes.
    so_that : str
        ``"round = 3.5 s"``, ``"theta_max <= 5 deg"`` or ``"kind = cusps"``: a fact with =, <= or
        >=, or a kind. Of an inequality, and of a kind that has room, the solutions are the ends of
        where it holds.

    Returns
    -------
    Found

    Raises
    ------
    BadScene
        There is no such number, range, fact or kind, or no scene in the range; every fault is
        listed.

    Notes
    -----
    Solutions closer to each other than the samples are found where the fact comes nearest to what
    is asked for between them. ``tests/analytic/test_find.py`` has 100 problems of known answers.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> found = find(load_scene("sicm-dropped"), "start.psidot=130:200", "theta_max <= 0.15")
    >>> [round(each.value, 6) for each in found.solutions], found.why
    ([156.855673], 'holds from 156.856 to 200 rad/s')
    """
    arguments.expect("scene", scene, Scene, "load_scene gives one")
    readers: dict[str, Reader] = {"vary": read_range, "so_that": _read_wish}
    read, faults = arguments.parse_options(scene.name, {"vary": vary, "so_that": so_that}, readers)
    if faults:
        raise BadScene(tuple(faults))
    (key, points), (name, relation, wanted) = read["vary"], read["so_that"]
    motion_at = lru_cache(maxsize=None)(partial(motion_of, scene, key))
    if not any(map(motion_at, points)):
        scene.changed(key, points[0])  # which says why not
    if name == "kind":
        brackets, inside, why = _of_kind(motion_at, points, wanted)
    else:
        brackets, inside, why = _of_fact(motion_at, points, name, relation, wanted)
    if inside:
        where = ", ".join(f"from {a:.6g} to {b:.6g}" for a, b in inside)
        why = f"holds {where} {unit_of(key)}".rstrip()
    middles = [(low + (high - low) / 2, (low, high)) for low, high in brackets]
    solutions = [
        Solution(x, bracket, facts_of(motion_at(x), FOUND_FACTS)) for x, bracket in middles
    ]
    return Found(scene, vary, so_that, tuple(solutions), why)


def motion_of(scene: Scene, key: str, x: float) -> Motion | None:
    """The motion of a scene with another value of a key; None where there is no such scene."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            changed = scene.changed(key, x)
        except (BadScene, NotANumber):
            return None
    return Motion(changed.top, changed.start)


def value_of(motion: Motion | None, name: str) -> float | None:
    """A fact of a motion; None where it has none, or none that is decided."""
    try:
        return None if motion is None else FOUND_FACTS[name][0](motion)
    except NoClosedForm:
        return None


def facts_of(motion: Motion | None, names: Iterable[str]) -> dict[str, float | None]:
    """Facts of a motion by name."""
    return {name: value_of(motion, name) for name in names}


# --- a fact, and a kind ----------------------------------------------------------------------


def _of_fact(
    motion_at: MotionAt, points: Sequence[float], name: str, relation: str, wanted: float
) -> Answer:
    """Where a fact is what is wanted, or on its side of it."""

    def distance(x: float) -> float | None:
        """How far the fact is off; 0 within the roundings that it may have."""
        value = value_of(motion_at(x), name)
        if value is None or not math.isfinite(value):
            return None
        off = value - wanted
        return off if abs(off) > _ROUNDINGS * max(abs(value), abs(wanted)) else 0.0

    points = _with_nearest(distance, points)
    if relation != "=":
        side = -1 if relation == "<=" else 1
        return _where(lambda x: (off := distance(x)) is not None and off * side >= 0, points)
    found = [each for each in _brackets(distance, points) if not _jumps(distance, wanted, *each)]
    values = [off + wanted for off in map(distance, points) if off is not None]
    goes = "does not exist"
    if values:
        goes = f"goes from {min(values):.6g} to {max(values):.6g} {FOUND_FACTS[name][1]}".rstrip()
    return found, [], "" if found else f"{_none(points)}: the {name} {goes}"


def _jumps(distance: Distance, wanted: float, low: float, high: float) -> bool:
    below, above = distance(low) or 0.0, distance(high) or 0.0
    return abs(above - below) > _JUMP * (abs(wanted) + abs(below))


def _of_kind(motion_at: MotionAt, points: Sequence[float], kind: str) -> Answer:
    """Where a kind holds; of a kind that asks for zeros, where these numbers change their sign."""
    found: list[Bracket] = []
    for rule in (rule for rule in RULES if rule.kind == kind):
        distances = [partial(_number, motion_at, number) for number in rule.zeros]
        moving = [distance for distance in distances if any(map(distance, points))]
        for low, high in _brackets(moving[0], _with_nearest(moving[0], points)) if moving else ():
            around = [motion for motion in map(motion_at, (low, high)) if motion is not None]
            loops = kind != Kind.CUSPS or Kind.LOOPS in {motion.kind for motion in around}
            more = [partial(_number, motion_at, number) for number in rule.positive]
            positive = all(math.prod(each(x) or 0.0 for each in more) > 0 for x in (low, high))
            if loops and positive and not any(_alike(each, low, high) for each in moving[1:]):
                found.append((low, high))
    if found:
        return found, [], ""
    kinds = {str(motion.kind) for motion in map(motion_at, points) if motion is not None}
    if kind not in kinds:
        return [], [], f"{_none(points)}: there are {', '.join(sorted(kinds)) or 'no motions'}"
    return _where(lambda x: (motion := motion_at(x)) is not None and motion.kind == kind, points)


def _number(motion_at: MotionAt, number: Criterion, x: float) -> float | None:
    """A criterion of kinds, with its proved sign."""
    if (motion := motion_at(x)) is None:
        return None
    signs = SceneSigns(motion.top, motion.start)
    with working(SIGN_BITS):
        try:
            return signs.sign(number) * (abs(float(number.value(signs.balls))) or 1.0)
        except UndecidedError:
            return None


def _where(holds: Callable[[float], bool], points: Sequence[float]) -> Answer:
    """The ends of where something holds, and between which of them it does."""
    brackets = [*_brackets(lambda x: 1.0 if holds(x) else -1.0, points)]
    ends = [points[0], *((low + high) / 2 for low, high in brackets), points[-1]]
    inside = [(a, b) for a, b in pairwise(ends) if holds(a + (b - a) / 2)]
    return brackets, inside, "" if inside else _none(points)


def _none(points: Sequence[float]) -> str:
    return f"none between {points[0]:.6g} and {points[-1]:.6g}"


# --- sides of what is asked for --------------------------------------------------------------


def _alike(distance: Distance, a: float, b: float) -> bool:
    """Whether both are on one side."""
    one, other = distance(a) or 0.0, distance(b) or 0.0
    return (one < 0 and other < 0) or (one > 0 and other > 0)


def _brackets(distance: Distance, points: Sequence[float]) -> Iterator[Bracket]:
    """Ends, as near as they can be, of where the side changes or what is asked for is met."""
    before: float | None = None
    zeros: list[float] = []
    for x in [*points, math.inf]:
        off = distance(x) if x < math.inf else None
        if off == 0:
            zeros.append(x)
            continue
        if zeros:
            low = zeros[0] if before is None else _halved(distance, before, zeros[0])[0]
            yield low, zeros[-1] if off is None else _halved(distance, x, zeros[-1])[0]
        elif off is not None and before is not None and not _alike(distance, before, x):
            low, high = _halved(distance, before, x)
            if (end := distance(high)) is not None:
                yield low, high if end else _halved(distance, x, high)[0]
        before, zeros = None if off is None else x, []


def _halved(distance: Distance, a: float, b: float) -> Bracket:
    """The last double on the side of a, and the next one towards b."""
    while (middle := a + (b - a) / 2) not in (a, b):
        a, b = (middle, b) if _alike(distance, a, middle) else (a, middle)
    return a, b


def _with_nearest(distance: Distance, points: Sequence[float]) -> list[float]:
    """The points, and others between them where a distance that keeps its side is least."""
    more = []
    for triple in zip(points, points[1:], points[2:], strict=False):
        alike = _alike(distance, *triple[:2]) and _alike(distance, *triple[1:])
        sizes = [abs(distance(x) or 0.0) for x in triple]
        if alike and sizes[1] <= min(sizes) < max(sizes):
            more.append(_nearest(distance, triple[0], triple[2]))
    return sorted({*points, *more})


def _nearest(distance: Distance, a: float, b: float) -> float:
    """Where it is least between two points, by thirds; or where its side changes."""
    first = a
    for _ in range(_THIRDS):
        x, y = a + (b - a) / 3, b - (b - a) / 3
        for other in (x, y):
            if not _alike(distance, first, other):
                return other
        a, b = (a, y) if abs(distance(x) or 0.0) < abs(distance(y) or 0.0) else (x, b)
    return a


# --- what is asked for -----------------------------------------------------------------------


def read_range(text: Any, count: int = 0) -> tuple[str, list[float]]:
    """Read KEY=A:B, or KEY=A:B:N; the key, and points from A to B: N, or `count`, or as many serve.

    >>> read_range("start.psidot = 10 : 20 : 3")
    ('start.psidot', [10.0, 15.0, 20.0])
    """
    parts = _RANGE.fullmatch(text) if isinstance(text, str) else None
    if parts is None:
        raise Refused("KEY=A:B of a number of top or start, such as start.psidot=10:400")
    table, name, *ends, number = parts.groups()
    if name not in (homes := [key for key in TABLES[table] if key in QUANTITY_READERS]):
        raise Refused(f"a number of the {table}: {', '.join(homes)}", nearest(name, homes))
    low, high = sorted(float(QUANTITY_READERS[name](end.strip())) for end in ends)
    steps = int(number or count or SAMPLES + 1)
    points = {low + (high - low) * k / max(steps - 1, 1) for k in range(steps)} | {high}
    if low * high > 0 and not (number or count):
        points |= {low * (high / low) ** (k / SAMPLES) for k in range(SAMPLES)}
    return f"{table}.{name}", sorted(x for x in points if low <= x <= high)


def _read_wish(text: Any) -> tuple[str, str, Any]:
    """Read FACT = X, FACT <= X, FACT >= X, or kind = KIND."""
    if not isinstance(text, str) or (parts := _WISH.fullmatch(text)) is None:
        raise Refused("FACT = X, FACT <= X or FACT >= X, such as round = 3.5 s")
    name, relation = (_SPELLINGS.get(part, part) for part in parts.groups()[:2])
    if name == "kind" and relation == "=":
        return name, relation, arguments.one_of({str(kind): str(kind) for kind in Kind})(parts[3])
    if name not in FOUND_FACTS:
        raise Refused(f"a fact out of kind, {', '.join(FOUND_FACTS)}", nearest(name, FOUND_FACTS))
    return name, relation, float(Exact.of(parts[3], UNITS_OF[unit_of(name)]))


def unit_of(name: str) -> str:
    """The SI unit of a column: of a fact, or of a key of the scene."""
    return FOUND_FACTS[name][1] if name in FOUND_FACTS else UNIT_OF.get(name.rpartition(".")[2], "")
