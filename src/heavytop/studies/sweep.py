"""Sweep: facts of the motion over a range of one number of a scene, with fast-top formulas beside.

Nothing is integrated: each row is the closed form of one scene.
"""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from heavytop.analytic.find import FACTS, facts_of, motion_of, read_range, unit_of
from heavytop.errors import BadScene, Fault, NotANumber
from heavytop.files import write_document, write_text
from heavytop.scene.arguments import Refused, expect, one_of, parse_names, path_of, shown, text_of
from heavytop.scene.quantities import SI, Units, scaled
from heavytop.scene.scene import Scene
from heavytop.text import Shown

SCHEMA: Final = "heavytop/sweep/1"
_FEW: Final = 37  # rows, where no number is given


@dataclass(frozen=True)
class Sweep(Shown):
    """Facts of the motions of a scene over a range.

    Attributes
    ----------
    scene : Scene
    over : str
        The key that is varied.
    rows : tuple of dict
        By name the value of the key, the kind of motion and the facts [SI]; None where there is no
        such scene, or its motion has no such fact.
    """

    scene: Scene
    over: str
    rows: tuple[Mapping[str, Any], ...]

    def document(self) -> dict[str, Any]:
        """The document of the schema ``heavytop/sweep/1``."""
        rows = [dict(row) for row in self.rows]
        return {"schema": SCHEMA, "scene": self.scene.problem(), "over": self.over, "rows": rows}

    def to_csv(self, units: Units = SI) -> str:
        """The rows as comma-separated values, with a header that has the units.

        Parameters
        ----------
        units : mapping
            What `heavytop.scene.quantities.read_units` gives; by default SI.
        """
        text = io.StringIO()
        table = csv.writer(text, lineterminator="\n")
        columns = {name: scaled(unit_of(name), units) for name in self.rows[0]}
        table.writerow(f"{name} [{unit}]" if unit else name for name, (unit, _) in columns.items())
        for row in self.rows:
            values = (x * columns[n][1] if isinstance(x, float) else x for n, x in row.items())
            table.writerow("" if x is None else x for x in values)
        return text.getvalue()

    def save(self, path: str | os.PathLike[str], units: Units = SI) -> None:
        """Write the rows to a file whose name ends in ``.csv``, or to one of JSON.

        Parameters
        ----------
        path : path
        units : mapping
            As of `to_csv`; JSON stays in SI.
        """
        place = path_of("path", path)
        if place.suffix.lower() == ".csv":
            write_text(place, self.to_csv(units))
        else:
            write_document(place, self.document())


def sweep(scene: Scene, over: str, facts: Sequence[str]) -> Sweep:
    """Facts of the motion over a range of one number of a scene.

    Parameters
    ----------
    scene : Scene
        Its top and its start.
    over : str
        Which number, from where to where, and how many: ``"start.psidot = 50:400:36"``.
    facts : sequence of str
        Names of `heavytop.analytic.find.FACTS`: round, theta_max, round_estimate and others.

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
    expect("scene", scene, Scene, "load_scene gives one")
    names, faults = parse_names(scene.name, "facts", facts, one_of({name: name for name in FACTS}))
    try:
        key, points = read_range(text_of("over", over), _FEW)
    except (Refused, NotANumber) as wrong:
        faults.append(Fault(scene.name, None, "over", shown(over), str(wrong)))
    if faults:
        raise BadScene(tuple(faults))
    rows = tuple(_row(scene, key, x, names) for x in points)
    if all(row["kind"] is None for row in rows):
        scene.changed(key, points[0])  # which says why not
    return Sweep(scene, key, rows)


def _row(scene: Scene, key: str, x: float, names: Sequence[str]) -> dict[str, Any]:
    motion = motion_of(scene, key, x)
    return {key: x, "kind": motion and str(motion.kind)} | facts_of(motion, names)
