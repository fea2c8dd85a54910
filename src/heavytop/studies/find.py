"""Find the values of one number of a scene for which its motion has a wanted fact or kind.

The range is sampled, and an interval over which the answer changes is bisected until its ends are
neighbouring doubles. Facts are proved to more digits than a double has.
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
_ROUNDINGS: Final = 10 * UNIT  # relative, of a fact that is computed from others
_JUMP: Final = 1e-6  # relative: a larger change between neighbouring doubles is a jump
_LEAST: Final = 1e-300  # a scene has no smaller numbers but 0
_THIRDS: Final = 48  # steps of a search for the minimum of a fact
_WISH: Final = re.compile(r"\s*(.+?)\s*(<=|>=|=)\s*(.+?)\s*")
_RANGE: Final = re.compile(r"\s*(?:(top|start)\.)?(\w+)\s*=([^:]+):([^:]+)(?::\s*([0-9]+)\s*)?")

Bracket: TypeAlias = tuple[float, float]
Enclosed: TypeAlias = tuple[float, float, bool]  # a bracket, and whether it is proved
MotionAt: TypeAlias = "Callable[[float], Motion | None]"
Distance: TypeAlias = "Callable[[float], float]"
"""From a value to how far its motion is from what is wanted, with proved sign; nan without one."""


def _per_weight(motion: Motion, power: int, factor: float) -> float | None:
    """Return a power of |p_ψ| over |gMR|, times a factor; None without weight."""
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
    """The result of `find`: all solutions in the range, in increasing order.

    Attributes
    ----------
    scene : mapping
        Its top and its start.
    vary, so_that : str
    solutions : tuple of mapping
        Of each the ``value``, the ``bracket`` of two values around it, whether it is ``proved`` to
        be between these, and the ``facts`` at it [SI].
    holds : tuple of (float, float)
        The ends of intervals in which a wish holds that is no equation [SI].
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
    holds, instead = list[Bracket](), ""
    if name == "kind":
        brackets = [*_find_zeros(motion_at, points, wanted)]
        if not brackets:
            brackets, holds = _find_ends(lambda x: (kind_of(motion_at(x)) == wanted) - 0.5, points)
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
        solutions.append({"value": x, "bracket": (low, high), "proved": proved, "facts": facts})
    ends = fact_quantity(key, ".6g").with_unit(points[0], points[-1], between=" and ")
    why = "" if brackets or holds else f"none between {ends}{instead}"
    return Found(
        scene=scene.problem(), vary=vary, so_that=so_that, solutions=solutions, holds=holds, why=why
    )


def motion_of(scene: Scene, key: str, x: float | Exact) -> Motion | None:
    """Return the motion of a scene with another value of a key; None if there is no such scene."""
    with warnings.catch_warnings(action="ignore"), suppress(BadScene, NotANumber):
        changed = scene.changed(key, x if abs(float(x)) > _LEAST else 0.0)
        return Motion(changed.top, changed.start)
    return None


def kind_of(motion: Motion | None) -> str | None:
    """Return the kind of a motion; None if there is no motion."""
    return None if motion is None else str(motion.kind)


def facts_of(motion: Motion | None, names: Iterable[str]) -> dict[str, float | None]:
    """Return facts of a motion by name; None where it has none, or none that is decided."""
    return {name: _fact(motion, name) for name in names}


def _fact(motion: Motion | None, name: str) -> float | None:
    """Return one fact of a motion, or None."""
    with suppress(NoClosedForm):
        return None if motion is None else FOUND_FACTS[name][0](motion)
    return None


# --- solutions -----------------------------------------------------------------------------------


def _distance(motion_at: MotionAt, name: str, wanted: float, x: float) -> float:
    """Return a fact less the wanted value; 0 within rounding, nan where there is no fact."""
    value = _fact(motion_at(x), name)
    if value is None or not math.isfinite(value):
        return math.nan
    off = value - wanted
    return off if abs(off) > _ROUNDINGS * max(abs(value), abs(wanted)) else 0.0


def _find_equal(
    distance: Distance, points: Sequence[float], name: str, wanted: float
) -> tuple[list[Enclosed], str]:
    """Return brackets in which a fact has the wanted value without a jump, and its range in words.

    The jumps of an angle are half turns, however large it is.
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
    """Return brackets of the ends of intervals in which `side` is at least 0, and the intervals."""
    found = [(*ends, {*map(side, ends)}) for ends in _brackets(side, points)]
    brackets = [(low, high, max(sides) > 0) for low, high, sides in found if min(sides) < 0]
    ends = [points[0], *(_middle(low, high) for low, high, _ in brackets), points[-1]]
    return brackets, [(a, b) for a, b in pairwise(ends) if side(a + (b - a) / 2) >= 0]


def _find_zeros(motion_at: MotionAt, points: Sequence[float], kind: str) -> Iterator[Enclosed]:
    """Yield brackets in which a kind is met whose numbers of `RULES` must vanish.

    There one of these changes its sign, and those that must be positive are. Where several numbers
    must vanish it is not proved that they do at the same value.
    """
    for rule in (rule for rule in RULES if rule.kind == kind):
        distances = [partial(_criterion, motion_at, number) for number in rule.zeros]
        factors = [partial(_criterion, motion_at, number) for number in rule.positive]
        moving = [each for each in distances if any(each(x) for x in points)]
        for low, high in _brackets(moving[0], _with_nearest(moving[0], points)) if moving else ():
            positive = all(math.prod(each(x) for each in factors) > 0 for x in (low, high))
            others = any(_same_side(each, low, high) for each in moving[1:])
            zeros = [x for x in (low, _middle(low, high), high) if moving[0](x) == 0]
            holds = any(kind_of(motion_at(x)) == kind for x in zeros)
            if not zeros:  # LOOPING is 0 too where waves only touch it
                ends = map(kind_of, map(motion_at, (low, high)))
                holds = kind != Kind.CUSPS or Kind.LOOPS in ends
            if holds and positive and not others:
                yield low, high, bool(zeros) or len(moving) == 1


def _middle(low: float, high: float) -> float:
    """Return the middle of two ends, or 0 if that is between them."""
    return 0.0 if low <= 0 <= high else low + (high - low) / 2


def _criterion(motion_at: MotionAt, number: Criterion, x: float) -> float:
    """Return a number that distinguishes kinds, with its proved sign; nan where there is none."""
    if (motion := motion_at(x)) is None:
        return math.nan
    signs = SceneSigns(motion.top, motion.start)
    with working(SIGN_BITS):
        side = signs.sign(number).number
        return math.nan if side is None else side * (abs(float(number.value(signs.balls))) or 1.0)


def _same_side(distance: Distance, a: float, b: float) -> bool:
    """Tell whether the distances of two values have the same sign, and neither is 0."""
    one, other = distance(a), distance(b)
    return (one > 0 and other > 0) or (one < 0 and other < 0)


def _brackets(distance: Distance, points: Sequence[float]) -> Iterator[Bracket]:
    """Yield neighbouring doubles between which a distance changes its sign, or ends of its zeros.

    nan are gaps, over which nothing is bracketed.
    """
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
    """Return the last double on the side of a, and the next one towards b."""
    while (middle := a + (b - a) / 2) not in (a, b):
        a, b = (middle, b) if _same_side(distance, a, middle) else (a, middle)
    a, b = (x if abs(x) > _LEAST else 0.0 for x in (a, b))  # as `motion_of` takes them
    return a, b


def _with_nearest(distance: Distance, points: Sequence[float]) -> list[float]:
    """Return points, and between them others where a distance of one sign has a local minimum.

    And between a nan and a number the last values on both sides.
    """
    more = list[float]()
    for pair in pairwise(points):
        if len({math.isnan(distance(x)) for x in pair}) > 1:
            more += _bisect(lambda x: math.isnan(distance(x)) - 0.5, *pair)
    for triple in zip(points, points[1:], points[2:], strict=False):
        alike = _same_side(distance, *triple[:2]) and _same_side(distance, *triple[1:])
        sizes = [abs(distance(x)) for x in triple]
        if alike and sizes[1] <= min(sizes) < max(sizes):
            more.append(_nearest(distance, triple[0], triple[2]))
    return sorted({*points, *more})


def _nearest(distance: Distance, a: float, b: float) -> float:
    """Return where a distance is least, by ternary search; or where it changes its sign."""
    first = a
    for _ in range(_THIRDS):
        x, y = a + (b - a) / 3, b - (b - a) / 3
        for other in (x, y):
            if not _same_side(distance, first, other):
                return other
        a, b = (a, y) if abs(distance(x)) < abs(distance(y)) else (x, b)
    return a


# --- reading the arguments -------------------------------------------------------------------


def read_range(text: Any) -> tuple[str, Exact, Exact, int]:
    """Read KEY=A:B, or KEY=A:B:N; return key, smaller end, larger end, and N, 0 if not given.

    >>> read_range("start.psidot = 3 : 1 : 4")
    ('start.psidot', Exact.of('1'), Exact.of('3'), 4)
    """
    parts = _RANGE.fullmatch(text) if isinstance(text, str) else None
    if parts is None:
        raise Refused("KEY=A:B or KEY=A:B:N of a number of top or start: start.psidot=10:400 rpm")
    table, name, *ends, number = parts.groups()
    homes = {key: home for home in ("top", "start") for key in TABLES[home]}
    keys = [key for key in homes if key in QUANTITY_READERS and table in (None, homes[key])]
    if name not in keys:
        raise Refused(f"a number of the {table or 'scene'}: {', '.join(keys)}", nearest(name, keys))
    first, last = sorted(map(QUANTITY_READERS[name], of_one_unit(*ends)), key=float)
    if len(number or "") > len(str(MOST_POINTS)) or not 1 <= int(number or 1) <= MOST_POINTS:
        raise Refused(f"1 to {MOST_POINTS} points")
    for end in (first, last) if name == "theta" else ():
        State(end)  # which warns of a tilt outside [0, π]
    return f"{homes[name]}.{name}", first, last, int(number or 0)


def _read_samples(text: Any) -> tuple[str, list[float]]:
    """Return the key of a range, and samples: N, or `SAMPLES` in each of two spacings; and 0."""
    key, first, last, count = read_range(text)
    low, high = float(first), float(last)
    points = {*even_values(first, last, count or SAMPLES + 1), 0.0, high}
    if low * high > 0 and not count:
        points |= {low * (high / low) ** (k / SAMPLES) for k in range(SAMPLES)}
    return key, sorted(x for x in points if low <= x <= high)


def _read_wish(text: Any) -> tuple[str, str, Any]:
    """Read FACT = X, FACT <= X, FACT >= X, or kind = KIND; return its three parts."""
    if not isinstance(text, str) or (parts := _WISH.fullmatch(text)) is None:
        raise Refused("FACT = X, <= X or >= X, such as round = 3.5 s; or kind = loops")
    name, relation, wanted = parts.groups()
    if name == "kind" and relation == "=":
        return name, relation, one_of({str(kind): str(kind) for kind in Kind})(wanted)
    if name not in FOUND_FACTS:
        raise Refused(f"a fact out of kind, {', '.join(FOUND_FACTS)}", nearest(name, FOUND_FACTS))
    return name, relation, float(Exact.of(wanted, UNITS_OF[_unit_of(name)]))
