"""The explorer: one page on which a person changes the numbers of a top and sees its motion.

The page computes by itself, with `templates/top.js`; the rules of the kinds, their order, reasons,
colours and names are data from this package.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from heavytop.classification import kinds
from heavytop.classification.classify import general_reason
from heavytop.classification.kinds import KIND_DETAILS, RULES, Criterion, Kind
from heavytop.errors import Fault, NotANumber, refuse
from heavytop.exact import Exact
from heavytop.exact.parse import UNITS_OF
from heavytop.files import write_text
from heavytop.plots.drawn_run import BLURRED, PERIODS, SHOWN_SPIN
from heavytop.plots.sphere import PUSH, STILL_KINDS
from heavytop.plots.style import KIND_STYLES
from heavytop.report.page import render
from heavytop.report.player import FRAMES, LONGEST_S, tops
from heavytop.scene.arguments import path_of
from heavytop.scene.quantities import QUANTITIES, RATES, SI, UNIT_OF, show_units
from heavytop.scene.scene import Scene, expect_scene, load_scene
from heavytop.scene.scene_file import shipped_names

FIRST_SCENE: Final = "sicm-kicked"
EXPLORER_SCRIPTS: Final = ("top.js", "player.js", "explorer.js")
START_INPUTS: Final = ("theta", "phi", "psi", "thetadot", "phidot")
NUMBER_NAMES: Final = {id(x): name for name, x in vars(kinds).items() if isinstance(x, Criterion)}

INPUT_LIMITS: Final = dict.fromkeys((*RATES, "omega3"), (-1e6, 1e6)) | {
    "theta": (0.0, math.pi), "phi": (-1e6, 1e6), "psi": (-1e6, 1e6),
    "A": (1e-15, 1e15), "C/A": (1e-6, 2.0), "gMR/A": (-1e9, 1e9), "mass": (0.0, 1e15),
    "gravity": (1e-9, 1e9),
}  # fmt: skip
"""The bounds of each number that the page takes, in SI."""

BOXES: Final = {
    name.replace("psidot", "spin"): {unit: float(x) for unit, x in UNITS_OF[UNIT_OF[name]].items()}
    for name in ("theta", "phidot", "thetadot", "psidot", "A", "mass", "distance")
}
"""The units that each input box takes, with their sizes in SI; the spin has those of ψ̇."""

PLAIN_LIMITS: Final = {
    Kind.AT_REST: "Nothing moves.",
    Kind.FORCE_FREE: "Without weight the axis circles a fixed direction at a constant rate.",
    Kind.SLEEPING: "The axis stands on the vertical, with its weight at the highest point.",
    Kind.HANGING: "The axis hangs along the vertical, with its weight at the lowest point.",
    Kind.PLANAR_PENDULUM: "Without spin the axis moves in one vertical plane, as a pendulum.",
    Kind.SEPARATRIX: "The axis creeps towards the vertical for ever and never arrives.",
    Kind.THROUGH_TOP: "In every nod the axis goes exactly through the upward vertical.",
    Kind.THROUGH_BOTTOM: "In every nod the axis goes exactly through the downward vertical.",
    Kind.UNIFORM_PRECESSION: "The tilt is constant, and the axis precesses at a constant rate.",
    Kind.LOOPS: "In every nod the axis runs backwards for a while: its path has loops.",
    Kind.CUSPS: "In every nod the axis stops for an instant: its path has cusps.",
    Kind.WAVES: "The axis nods and precesses in one direction only: its path is a wave.",
}
"""A sentence about each kind for readers who do not know it."""

POLAR: Final = (Kind.PLANAR_PENDULUM, Kind.THROUGH_TOP, Kind.THROUGH_BOTTOM)
"""Kinds whose axis does not go round the vertical but through it."""

NUMBERED: Final = ("A", "C", "gMR", "E_prime", "p_phi", "p_psi")
"""The quantities that the page shows as numbers, with symbol and unit."""


def explore(scene: Scene | None = None, path: str | os.PathLike[str] = "explore.html") -> Path:
    """Write the explorer: a page that needs no network, to try out what a top does.

    On it a person drags tilt, kick, spin, C/A and gravity and sees at once the kind of motion with
    its reason, the top moving, θ over time, the effective potential, and the place in the plane of
    kicks. Every state has a link, and is a scene to copy.

    Parameters
    ----------
    scene : Scene, optional
        What it begins with; without one, the book's kicked top.
    path : path
        The page. One that is there is replaced.

    Returns
    -------
    Path
        Where it was written, whole or not at all.

    Raises
    ------
    BadScene
        The path does not end in ``.html``; a number is beyond what the page takes. All of them
        are named.
    OSError
        It cannot be written.
    WrongType
        `scene` is no Scene, or `path` no path.

    Notes
    -----
    Accuracy: ``tests/report/test_explorer.py`` holds what the page computes, in a browser, to
    `classify` and to `Motion`: kinds, and θ, φ and ψ over three periods to 1e-9 rad.

    Examples
    --------
    >>> import heavytop as ht, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     page = ht.explore(ht.load_scene("sicm-dropped"), f"{folder}/top.html")
    ...     page.stat().st_size < 1_000_000
    True
    """
    begin = load_scene(FIRST_SCENE) if scene is None else scene
    place = path_of("path", path)
    faults = [*_unsupported(expect_scene(begin))]
    if place.suffix.lower() != ".html":
        rule = "the name of a page ends in .html"
        faults.append(Fault("explore", None, "path", str(place), rule))
    refuse(faults)
    with show_units(SI):  # the page has its own units
        page = render("explorer.html", EXPLORER_SCRIPTS, data=_data(begin), tops=tops([]))
    write_text(place, page)
    return place


def _data(scene: Scene) -> dict[str, Any]:
    """The data of the page: rules and words of the kinds, scenes, limits and constants."""
    rules = [
        {"kind": rule.kind, "zeros": _names(rule.zeros), "positive": _names(rule.positive),
         "why": general_reason(rule)}
        for rule in RULES
    ]  # fmt: skip
    details = {k: {"names": x.names, "product": _names(x.product)} for k, x in KIND_DETAILS.items()}
    looks = {kind: KIND_STYLES[kind]._asdict() | {"plain": x} for kind, x in PLAIN_LIMITS.items()}
    shipped = [load_scene(name) for name in shipped_names()]
    others = [_start(each) for each in shipped if each.name != scene.name]
    return {
        "rules": rules, "details": details, "kinds": looks, "scenes": [_start(scene), *others],
        "quantities": {name: {"symbol": QUANTITIES[name].symbol, "unit": QUANTITIES[name].unit}
                       for name in NUMBERED},
        "limits": INPUT_LIMITS, "units": BOXES, "still": STILL_KINDS, "push": PUSH,
        "polar": POLAR, "frames": FRAMES,
        "turn": SHOWN_SPIN * LONGEST_S, "periods": PERIODS, "blur": BLURRED,
    }  # fmt: skip


def _unsupported(scene: Scene) -> Iterator[Fault]:
    """Yield the numbers of a scene that are beyond the limits of the page."""
    start = _start(scene)["numbers"]
    start |= {"C/A": start["C"] / start["A"], "gMR/A": start["gMR"] / start["A"]}
    for name, (low, high) in INPUT_LIMITS.items():
        if name in start and not low <= start[name] <= high:
            rule = f"explore takes it from {low:g} to {high:g}"
            yield Fault(scene.name, None, name, f"{start[name]:g}", rule)


def _names(numbers: tuple[Criterion, ...]) -> list[str]:
    """The names of criteria in the module of kinds."""
    return [NUMBER_NAMES[id(number)] for number in numbers]


def _start(scene: Scene) -> dict[str, Any]:
    """A scene in doubles, with the exact texts of those that are rounded."""
    top, start = scene.top, scene.start
    exact = {name: getattr(top, name) for name in ("A", "C", "gMR")}
    exact |= {name: getattr(start, name) for name in START_INPUTS} | {start.held: start.spin}
    if top.mass is not None and top.distance is not None and top.distance.sign():
        exact |= {"mass": top.mass, "gravity": top.gMR / (top.mass * top.distance)}
    return {
        "name": scene.name, "title": scene.title or scene.name, "held": start.held,
        "numbers": {name: float(x) for name, x in exact.items()},
        "texts": {name: str(x) for name, x in exact.items() if _needs_text(x)},
    }  # fmt: skip


def _needs_text(x: Exact) -> bool:
    """Whether a number is not a double, and has a text that a scene file can hold."""
    try:
        return x != float(x) and Exact.of(str(x)) == x
    except NotANumber:  # a scene file has no acos of a computed number
        return False
