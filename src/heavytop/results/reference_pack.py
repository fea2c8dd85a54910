"""A folder of exact values for people of other languages: every shipped scene, and how to score."""

from __future__ import annotations

from decimal import Decimal
from math import copysign, inf
from pathlib import Path
from typing import Final

from heavytop.analytic.enclosure import EVENTS
from heavytop.analytic.motion import Motion
from heavytop.analytic.reference import Reference, reference
from heavytop.files import make_folder, write_text
from heavytop.scene.scene import Scene, load_scene, shipped_scenes

TIMES: Final = 200
DIGITS: Final = 20
PERIODS: Final = 10  # of the nutation, at most
QUANTITIES: Final = ("theta", "phi", "psi", "axis", "attitude", "omega")
SCORE: Final = Path(__file__).with_name("score.py")

README: Final = """\
# Exact values of the heavy top

For each scene: `NAME.toml` says the top and its start. `NAME.csv` has {times} times with the
angles, the symmetry axis, the attitude (a quaternion from body to space, scalar first) and the
angular velocity in space. `NAME.events.csv` has the turning points, reversals of precession and
cusps between the first time and the last.

Every number has {digits} digits (in front of the point and behind it; behind it alone below 1). It
is proved, by interval arithmetic, to be within one unit of its last digit. The times are exact.
Lengths are in metres, masses in kilograms, times in seconds, angles in radians. z points up; the
axis is (sin theta sin phi, -sin theta cos phi, cos theta); phi and psi are counted from the start
and never reduced; at an exact pass through a pole phi jumps by pi, and psi makes up for it.

Integrate a scene with your program, write the axis (or theta and phi) at the same times to a
file, and

    python score.py sicm-kicked mine.csv

says how far it is off: the largest error of the axis and when, the phase error in seconds, and the
digits that are right. `score.py` needs nothing but Python.

| scene | what it is |
|---|---|
{scenes}

Made by heavytop {version}: `heavytop reference --pack DIR`.
"""


def write_pack(folder: Path) -> tuple[str, ...]:
    """Write the pack into a folder; the names of its files.

    Raises
    ------
    OSError
        The folder cannot be written.
    """
    from heavytop import __version__

    make_folder(folder)
    scenes = [load_scene(name) for name in shipped_scenes()]
    files = {"score.py": SCORE.read_text("utf-8")}
    for scene in scenes:
        found = packed(scene)
        events = "".join(f"{kind},{t}\n" for kind, t in found.events)
        files[f"{scene.name}.toml"] = scene.to_toml()
        files[f"{scene.name}.csv"] = found.to_csv()
        files[f"{scene.name}.events.csv"] = f"kind,t\n{events}"
    rows = "\n".join(f"| `{scene.name}` | {scene.title} |" for scene in scenes)
    files["README.md"] = README.format(times=TIMES, digits=DIGITS, scenes=rows, version=__version__)
    for name, text in files.items():
        write_text(folder / name, text)
    return tuple(files)


def packed(scene: Scene) -> Reference:
    """The exact values of a scene that the pack has."""
    from heavytop.run.planning import span

    motion = Motion(scene.top, scene.start)
    whole = span(scene, motion)
    length = min(abs(whole), PERIODS * (motion.period or inf))
    step = Decimal(f"{copysign(length, whole) / (TIMES - 1):.2e}")
    times = [k * step for k in range(TIMES)]
    return reference(scene, times, QUANTITIES, DIGITS, EVENTS)
