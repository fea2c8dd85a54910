"""Sweeps: facts of the motion over a range of one number of a scene, beside fast-top formulas.

Nothing is integrated: each row is the closed form of one scene.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, ClassVar, Final

from heavytop.errors import refuse
from heavytop.exact import Exact
from heavytop.results.base import Result
from heavytop.results.table import Table
from heavytop.scene.arguments import expect, one_of, parse_names, parse_options
from heavytop.scene.scene import Scene, expect_scene
from heavytop.studies import find

_N: Final = 37  # rows, where no number is given


class Sweep(Result):
    """Facts of the motions of a scene over a range.

    Attributes
    ----------
    scene : mapping
        Its top and its start.
    over : str
        The key that is varied.
    rows : tuple of mapping
        By name the value of the key, the kind of motion and the facts [SI]; None where there is no
        such scene, or its motion has no such fact.
    """

    schema: ClassVar = "heavytop/sweep/1"

    scene: Mapping[str, Any]
    over: str
    rows: tuple[Any, ...]

    def tables(self) -> Iterator[Table]:
        """A row for each value."""
        about = {name: find.fact_quantity(name, ".8g") for name in self.rows[0]}
        yield Table(self.rows, [*about], meanings=about, left=0)


def sweep(scene: Scene, over: str, facts: Sequence[str]) -> Sweep:
    """Facts of the motion over a range of one number of a scene.

    Parameters
    ----------
    scene : Scene
        Its top and its start.
    over : str
        Which number, from where to where, and how many: ``"start.psidot = 50:400:36"``.
    facts : sequence of str
        Of theta_min, theta_max, amplitude, period, round, precession, spin, ratio and
        round_estimate.

    Returns
    -------
    Sweep

    Raises
    ------
    BadScene
        There is no such number or fact, or no scene in the range; every fault is listed.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> rows = sweep(load_scene("sicm-dropped"), "start.psidot=100:300:3", ["theta_max"]).rows
    >>> [(row["start.psidot"], round(row["theta_max"], 4)) for row in rows]
    [(100.0, 1.1117), (200.0, 0.1233), (300.0, 0.1086)]
    """
    key, points, names = read_request(scene, over, facts)
    rows = tuple(_row(scene, key, x, names) for x in points)
    if all(row["kind"] is None for row in rows):
        scene.changed(key, points[0])  # which says why not
    return Sweep(scene=scene.problem(), over=key, rows=rows)


def read_request(scene: Scene, over: str, facts: object) -> tuple[str, list[Exact], list[str]]:
    """Return the key that is varied, its values, and the names of facts; raise as `sweep` does."""
    expect_scene(scene)
    known = one_of({name: name for name in find.FOUND_FACTS})
    names, faults = parse_names(scene.name, "facts", facts, known)
    given = {"over": expect("over", over, str)}
    values, wrong = parse_options(scene.name, given, {"over": _read_values})
    refuse(faults, wrong)
    return *values["over"], names


def _read_values(text: Any) -> tuple[str, list[Exact]]:
    """Return the key of a range, and exact values of it, each the only one of its double."""
    key, first, last, count = find.read_range(text)
    steps = max((count or _N) - 1, 1)
    values = (first + (last - first) * k / steps for k in range(steps + 1))
    return key, [*{float(x): x for x in values}.values()]


def _row(scene: Scene, key: str, x: Exact, names: Sequence[str]) -> dict[str, Any]:
    """Return the row of one value."""
    motion = find.motion_of(scene, key, x)
    return {key: float(x), "kind": find.kind_of(motion)} | find.facts_of(motion, names)
