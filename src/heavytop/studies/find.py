"""Find: which value of one number of a scene makes a fact of its motion what is asked for.

The range is sampled, and where the answer changes between two samples it is halved until doubles
are next to each other. Facts are proved to more digits than a double has.
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache, partial
from itertools import pairwise
from operator import attrgetter
from typing import Any, ClassVar, Final, TypeAlias

from heavytop.analytic.motion import Motion
from heavytop.classification import Kind
from heavytop.classification.classify import SIGN_BITS, SceneSigns
from heavytop.classification.kinds import RULES, Criterion
from heavytop.errors import BadScene, NoClosedForm, NotANumber, Refused, refuse
from heavytop.exact import Exact
from heavytop.exact.balls import working
from heavytop.exact.pairs import UNIT
from heavytop.exact.parse import UNITS_OF, of_one_unit
from heavytop.results.base import Result
from heavytop.results.table import Fact
from heavytop.scene.arguments import Reader, one_of, parse_options
from heavytop.scene.quantities import QUANTITY_READERS, UNIT_OF, Quantity, quantity_of
from heavytop.scene.scene import Scene, expect_scene
from heavytop.scene.scene_file import TABLES
from heavytop.scene.state import State
from heavytop.studies.atlas_plane import even_values
from heavytop.text import nearest

MOST_POINTS: Final = 1_000_000  # of a range
SAMPLES: Final = 128  # of a range, and as many by the logarithm of one without 0
_ROUNDINGS: Final = 10 * UNIT  # of a fact that is made of others, and of what is wanted
_JUMP: Final = 1e-6  # relative: between doubles next to each other no fact changes so much
_LEAST: Final = 1e-300  # below which there are no numbers in scenes but 0
_THIRDS: Final = 48  # after which the least of a fact does not change
_WISH: Final = re.compile(r"\s*(.+?)\s*(<=|>=|=)\s*(.+?)\s*")
_RANGE: Final = re.compile(r"\s*(?:(top|start)\.)?(\w+)\s*=([^:]+):([^:]+)(?::\s*([0-9]+)\s*)?")

Bracket: TypeAlias = tuple[float, float]
Enclosed: TypeAlias = tuple[float, float, bool]  # and whether it is proved to be between
MotionAt: TypeAlias = "Callable[[float], Motion | None]"
Distance: TypeAlias = "Callable[[float], float]"
"""How far the motion of a value is from what is asked for; its sign is proved. Nan if nowhere."""


def _per_weight(motion: Motion, power: int, factor: float) -> float | None:
    """A power of |p_ψ| over |gMR|, times a factor; None without weight."""
    momentum, weight = abs(float(motion.constants.p_psi)), abs(float(motion.top.gMR))
    return factor * momentum**power / weight if weight else None


FOUND_FACTS: Final[Mapping[str, tuple[Callable[[Motion], float | None], str]]] = {
    **{
        name: (attrgetter(name), quantity_of(name).unit)
        for name in ("period", "round", "theta_min", "theta_max", "amplitude", "precession", "spin")
    },
    "ratio": (lambda m: _per_weight(m, 2, 1 / (4 * float(m.top.A))), ""),
    "round_estimate": (lambda m: _per_weight(m, 1, 2 * math.pi) or None, "s"),
}
"""Facts and their units: of the motion, p_ψ²/4A gMR, and what the formula of a fast top gives."""


class Found(Result):
    """What `find` found: all solutions in the range, in their order.

    Attributes
    ----------
    scene : mapping
        Its top and its start.
    vary, so_that : str
    solutions : tuple of mapping
        Of each the ``value`` that has what is asked for, the ``bracket`` of two values around it,
        whether it is ``proved`` to be between these, and the ``facts`` at it [SI].
    holds : tuple of (float, float)
        Where it holds, of what holds on intervals: their ends [SI].
    why : str
        Why there is none.
    """

    schema: ClassVar = "heavytop/find/1"

    scene: Mapping[str, Any]
    vary: str
    so_that: str
    solutions: Sequence[Any]
    holds: Sequence[Bracket]
    why: str

    def facts(self) -> Iterator[Fact]:
        """The solutions, and the facts of each; or why there is none."""
        key = self.vary.partition("=")[0].strip()
        yield "so that", self.so_that
        for each in self.solutions:
            ends = fact_quantity(key, ".17g").with_unit(*each.bracket, between=" and ")
            proved = "proved between" if each.proved else "not proved, between"
            yield key, f"{fact_quantity(key).with_unit(each.value)}, {proved} {ends}"
            known = {fact_quantity(n, ".6g"): x for n, x in each.facts.items() if x is not None}
            yield "", ", ".join(f"{of.symbol} {of.with_unit(x)}" for of, x in known.items())
        if self.holds:
            where = (fact_quantity(key, ".6g").with_unit(*ends) for ends in self.holds)
            yield "", f"holds from {', from '.join(where)}"
        if self.why:
            yield "", self.why


def fact_quantity(name: str, form: str = ".12g") -> Quantity:
    """A fact, or a key of a scene, as a quantity."""
    return Quantity(name.replace("_", " "), _unit_of(name), format=form)


def _unit_of(name: str) -> str:
    """The SI unit of a fact, or of a key of the scene."""
    return FOUND_FACTS[name][1] if name in FOUND_FACTS else UNIT_OF.get(name.rpartition(".")[2], "")


def find(scene: Scene, vary: str, so_that: str) -> Found:
    """Find which value of a scene gives the motion you want.

    Parameters
    ----------
    scene : Scene
        Its top and its start.
    vary : str
        Which number, and its range: ``"start.psidot = 10:400"``, or in a unit, ``"… = 1:60 rpm"``.
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
    is asked for between them. ``tests/studies/test_find.py`` has 100 problems of known answers.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> found = find(load_scene("sicm-dropped"), "start.psidot=130:200", "theta_max <= 0.15")
    >>> [round(each.value, 6) for each in found.solutions], found.holds[0][1]
    ([156.855673], 200.0)
    """
    expect_scene(scene)
    readers: dict[str, Reader] = {"vary": _read_samples, "so_that": _read_wish}
    read, faults = parse_options(scene.name, {"vary": vary, "so_that": so_that}, readers)
    refuse(faults)
    (key, points), (name, relation, wanted) = read["vary"], read["so_that"]
    motion_at = cache(partial(motion_of, scene, key))
    if not any(map(motion_at, points)):
        scene.changed(key, points[0])  # which says why not
    holds: list[Bracket] = []
    instead = ""
    if name == "kind":
        brackets = [*_find_zeros(motion_at, points, wanted)]
        if not brackets:
            brackets, holds = _find_ends(
                lambda x: 1.0 if kind_of(motion_at(x)) == wanted else -1.0, points
            )
        kinds = {kind for x in points if (kind := kind_of(motion_at(x)))}
        instead = f": there are {', '.join(sorted(kinds))}"
    else:
        distance = partial(_distance, motion_at, name, wanted)
        points, side = _with_nearest(distance, points), -1 if relation == "<=" else 1
        if relation == "=":
            brackets, instead = _find_equal(distance, points, name, wanted)
        else:
            brackets, holds = _find_ends(
                lambda x: -1.0 if math.isnan(off := distance(x)) else side * off, points
            )
    solutions = []
    for low, high, proved in brackets:
        x = _middle(low, high)
        facts = facts_of(motion_at(x), FOUND_FACTS)
        found = {"value": x, "bracket": (low, high), "proved": proved, "facts": facts}
        solutions.append(found)
    why = ""
    if not (brackets or holds):
        ends = fact_quantity(key, ".6g").with_unit(points[0], points[-1], between=" and ")
        why = f"none between {ends}{instead}"
    return Found(
        scene=scene.problem(), vary=vary, so_that=so_that, solutions=solutions, holds=holds, why=why
    )


def motion_of(scene: Scene, key: str, x: float | Exact) -> Motion | None:
    """The motion of a scene with another value of a key; None where there is no such scene."""
    with warnings.catch_warnings(), suppress(BadScene, NotANumber):
        warnings.simplefilter("ignore")
        changed = scene.changed(key, x if abs(float(x)) > _LEAST else 0.0)
        return Motion(changed.top, changed.start)
    return None


def kind_of(motion: Motion | None) -> str | None:
    """The kind of a motion, if there is one."""
    return None if motion is None else str(motion.kind)


def facts_of(motion: Motion | None, names: Iterable[str]) -> dict[str, float | None]:
    """Facts of a motion by name; None where it has none, or none that is decided."""
    return {name: _fact(motion, name) for name in names}


def _fact(motion: Motion | None, name: str) -> float | None:
    with suppress(NoClosedForm):
        return None if motion is None else FOUND_FACTS[name][0](motion)
    return None


# --- where it is so ------------------------------------------------------------------------------


def _distance(motion_at: MotionAt, name: str, wanted: float, x: float) -> float:
    """How far a fact is off; 0 within the roundings that it may have, nan where there is none."""
    value = _fact(motion_at(x), name)
    if value is None or not math.isfinite(value):
        return math.nan
    off = value - wanted
    return off if abs(off) > _ROUNDINGS * max(abs(value), abs(wanted)) else 0.0


def _find_equal(
    distance: Distance, points: Sequence[float], name: str, wanted: float
) -> tuple[list[Enclosed], str]:
    """Where a fact is what is wanted, but not where it jumps over that; and what it is.

    An angle jumps by half turns, however large it is.
    """
    found = []
    for low, high in _brackets(distance, points):
        below, above = distance(low), distance(high)
        size = abs(wanted) + abs(below)
        if not abs(above - below) > _JUMP * (min(size, 1) if _unit_of(name) == "rad" else size):
            found.append((low, high, min(below, above) < 0 < max(below, above)))
    values = [off + wanted for off in map(distance, points) if not math.isnan(off)]
    goes = "does not exist"
    if values:
        goes = f"goes from {min(values):.6g} to {max(values):.6g} {FOUND_FACTS[name][1]}".rstrip()
    return found, f": the {name} {goes}"


def _find_ends(side: Distance, points: Sequence[float]) -> tuple[list[Enclosed], list[Bracket]]:
    """The ends of where something holds (a side not below 0), and between which it does."""
    found = [(*ends, {*map(side, ends)}) for ends in _brackets(side, points)]
    brackets = [(low, high, max(sides) > 0) for low, high, sides in found if min(sides) < 0]
    ends = [points[0], *((low + high) / 2 for low, high, _ in brackets), points[-1]]
    return brackets, [(a, b) for a, b in pairwise(ends) if side(a + (b - a) / 2) >= 0]


def _find_zeros(motion_at: MotionAt, points: Sequence[float], kind: str) -> Iterator[Enclosed]:
    """Where the numbers change their sign that are 0 in a kind, the others being as it wants.

    Of two that change it is not proved that they do at once.
    """
    for rule in (rule for rule in RULES if rule.kind == kind):
        distances = [partial(_criterion, motion_at, number) for number in rule.zeros]
        factors = [partial(_criterion, motion_at, number) for number in rule.positive]
        moving = [each for each in distances if any(each(x) for x in points)]
        for low, high in _brackets(moving[0], _with_nearest(moving[0], points)) if moving else ():
            positive = all(math.prod(each(x) for each in factors) > 0 for x in (low, high))
            others = any(_same_side(each, low, high) for each in moving[1:])
            met = [x for x in (low, _middle(low, high), high) if moving[0](x) == 0]
            so = any(kind_of(motion_at(x)) == kind for x in met)
            if not met:  # LOOPING is 0 too where waves only touch it
                so = kind != Kind.CUSPS or Kind.LOOPS in map(kind_of, map(motion_at, (low, high)))
            if so and positive and not others:
                yield low, high, bool(met) or len(moving) == 1


def _middle(low: float, high: float) -> float:
    """The value between two ends, 0 where they have it between them."""
    return 0.0 if low <= 0 <= high else low + (high - low) / 2


def _criterion(motion_at: MotionAt, number: Criterion, x: float) -> float:
    """A number that distinguishes kinds, with its proved sign; nan where there is none."""
    if (motion := motion_at(x)) is None:
        return math.nan
    signs = SceneSigns(motion.top, motion.start)
    with working(SIGN_BITS):
        side = signs.sign(number).number
        return math.nan if side is None else side * (abs(float(number.value(signs.balls))) or 1.0)


def _same_side(distance: Distance, a: float, b: float) -> bool:
    """Whether both are on one side of what is asked for."""
    one, other = distance(a), distance(b)
    return (one > 0 and other > 0) or (one < 0 and other < 0)


def _brackets(distance: Distance, points: Sequence[float]) -> Iterator[Bracket]:
    """Ends, as near as they can be, of where the side changes or what is asked for is met."""
    before: float | None = None
    zeros: list[float] = []
    for x in [*points, math.inf]:
        off = distance(x) if x < math.inf else math.nan
        if off == 0:
            zeros.append(x)
            continue
        if zeros:
            low = zeros[0] if before is None else _bisect(distance, before, zeros[0])[0]
            yield low, zeros[-1] if math.isnan(off) else _bisect(distance, x, zeros[-1])[0]
        elif not math.isnan(off) and before is not None and not _same_side(distance, before, x):
            low, high = _bisect(distance, before, x)
            if not math.isnan(end := distance(high)):
                yield low, high if end else _bisect(distance, x, high)[0]
        before, zeros = None if math.isnan(off) else x, []


def _bisect(distance: Distance, a: float, b: float) -> Bracket:
    """The last double on the side of a, and the next one towards b."""
    while (middle := a + (b - a) / 2) not in (a, b):
        a, b = (middle, b) if _same_side(distance, a, middle) else (a, middle)
    return a, b


def _with_nearest(distance: Distance, points: Sequence[float]) -> list[float]:
    """The points, and others between them where a distance that keeps its side is least."""
    more = []
    for triple in zip(points, points[1:], points[2:], strict=False):
        alike = _same_side(distance, *triple[:2]) and _same_side(distance, *triple[1:])
        sizes = [abs(distance(x)) for x in triple]
        if alike and sizes[1] <= min(sizes) < max(sizes):
            more.append(_nearest(distance, triple[0], triple[2]))
    return sorted({*points, *more})


def _nearest(distance: Distance, a: float, b: float) -> float:
    """Where it is least between two points, by thirds; or where its side changes."""
    first = a
    for _ in range(_THIRDS):
        x, y = a + (b - a) / 3, b - (b - a) / 3
        for other in (x, y):
            if not _same_side(distance, first, other):
                return other
        a, b = (a, y) if abs(distance(x)) < abs(distance(y)) else (x, b)
    return a


# --- what is asked for -----------------------------------------------------------------------


def read_range(text: Any) -> tuple[str, Exact, Exact, int]:
    """Read KEY=A:B, or KEY=A:B:N; the key, the smaller end and the other, and N, 0 if not given.

    >>> read_range("start.psidot = 3 : 1 : 4")
    ('start.psidot', Exact.of('1'), Exact.of('3'), 4)
    """
    parts = _RANGE.fullmatch(text) if isinstance(text, str) else None
    if parts is None:
        raise Refused("KEY=A:B or KEY=A:B:N of a number of top or start: start.psidot=10:400 rpm")
    table, name, *ends, number = parts.groups()
    homes = {key: home for home in ("top", "start") for key in TABLES[home]}
    known = [key for key in homes if key in QUANTITY_READERS and table in (None, homes[key])]
    if name not in known:
        raise Refused(
            f"a number of the {table or 'scene'}: {', '.join(known)}", nearest(name, known)
        )
    first, last = sorted(map(QUANTITY_READERS[name], of_one_unit(*ends)), key=float)
    if len(number or "") > len(str(MOST_POINTS)) or not 1 <= int(number or 1) <= MOST_POINTS:
        raise Refused(f"1 to {MOST_POINTS} points")
    for end in (first, last) if name == "theta" else ():
        State(end)  # which warns of a tilt outside [0, π]
    return f"{homes[name]}.{name}", first, last, int(number or 0)


def _read_samples(text: Any) -> tuple[str, list[float]]:
    """The key of a range, and points of it: N, or as many as serve."""
    key, first, last, count = read_range(text)
    low, high = float(first), float(last)
    points = {*even_values(first, last, count or SAMPLES + 1), high}
    if low * high > 0 and not count:
        points |= {low * (high / low) ** (k / SAMPLES) for k in range(SAMPLES)}
    return key, sorted(x for x in points if low <= x <= high)


def _read_wish(text: Any) -> tuple[str, str, Any]:
    """Read FACT = X, FACT <= X, FACT >= X, or kind = KIND."""
    if not isinstance(text, str) or (parts := _WISH.fullmatch(text)) is None:
        raise Refused("FACT = X, <= X or >= X, such as round = 3.5 s; or kind = loops")
    name, relation, wanted = parts.groups()
    if name == "kind" and relation == "=":
        return name, relation, one_of({str(kind): str(kind) for kind in Kind})(wanted)
    if name not in FOUND_FACTS:
        raise Refused(f"a fact out of kind, {', '.join(FOUND_FACTS)}", nearest(name, FOUND_FACTS))
    return name, relation, float(Exact.of(wanted, UNITS_OF[_unit_of(name)]))
