"""What the package does on every system, with what pip installs: commands, and calls from Python.

``python everywhere.py FOLDER`` does all of it in that folder, and prints what was said as JSON.
"""

from __future__ import annotations

import json
import os
import re
import sys
from base64 import b64decode
from hashlib import sha256
from pathlib import Path

PLANE = "sicm-kicked --x phidot=-20:20:21 --y psidot=-150:150:21"
STUDY = "sicm-kicked --periods 3 --methods taylor-axis"
CLOSED = (
    "classify sicm-kicked",
    "reference sicm-kicked --times 0:2:0.5 --events turning --json",
    "reference sicm-dropped --times 0:1:0.05 -o exact.csv",
    "check exact.csv --scene sicm-dropped -o checked",
    "film sicm-kicked --seconds 0.2 --fps 10 --size 96x72 -o film.gif",
    "explore -o explore.html",
    f"atlas {PLANE} -j 2",
    f"atlas {PLANE} --only kind -j 1",
    "report checked -o reported",
    "scenes",
    "scenes sicm-kicked",
    "--version",
    "--help",
    *(
        f"{verb} --help"
        for verb in ("run", "classify", "film", "report", "drift", "stress", "atlas")
    ),
)
DERIVED = (
    "plan sicm-kicked",
    "plan sicm-kicked --set span.periods=1e5",
    "plan sicm-kicked --digits 6 --set span.periods=1000 --set want.events=[]",
    "derive",
)
KEPT = ("run sicm-kicked -o kept", f"atlas {PLANE} -j 1 -o kept")  # in folders
INTEGRATED = (
    "run sicm-kicked",
    f"drift {STUDY} -o drift",
    f"workprec {STUDY} -o workprec",
    "stress --cases cusp --methods auto -o stress",
)


def commands(lines):
    """How commands end, and what they say."""
    from click.testing import CliRunner

    from heavytop.cli import app

    found = {}
    for line in lines:
        done = CliRunner().invoke(app, line.split(), env={"COLUMNS": "100"})
        found[line] = [done.exit_code, untimed(done.stdout), done.stderr]
    return found


def untimed(said):
    """What was said, but for what the clock says and the names that matplotlib gives to clips."""
    picture = re.compile(r"(?<=image/svg\+xml;base64,)[\w+/=]+")
    said = picture.sub(lambda found: b64decode(found[0]).decode(), said)
    said = re.sub(r"\bp[0-9a-f]{10}\b", "clip", said)
    return re.sub(r"(pixels per second.*?)\d[\d.e+]*", r"\1", said)


def calls():
    """What Python gives, as texts of every bit."""
    import numpy as np

    import heavytop as ht
    from heavytop.plots.sphere import motion_figure
    from heavytop.plots.style import svg

    scene = ht.load_scene("sicm-kicked")
    top, start = scene.top, scene.start
    motion, times = ht.Motion(top, start), np.linspace(0.0, 2.0, 99)
    at = motion.at(times)
    many = ht.motions_many(A=1, C=0.5, gMR=1, theta=0.3, phidot=times, psidot=4.0)
    told = {name: getattr(at, name) for name in ("theta", "phi", "psi")}
    judged = ht.check({"t": times} | told, scene)
    plane = ht.atlas(scene, "phidot=-20:20:11", "psidot=-150:150:11", jobs=1)
    shown = (top, start, scene, motion, motion.verdict, judged, plane, motion.play())
    ht.film(scene, "python.webp", seconds=0.2, fps=10, size=(96, 72))
    ht.explore(scene, "python.html")
    return {
        "motion": {name: x.tobytes().hex() for name, x in told.items()},
        "digits": str(motion.at("0.7", digits=40).psi),
        "many": many.period.tobytes().hex(),
        "enclosed": f"{motion.interval('period')} {motion.interval('phi', '0.7')}",
        "facts": str(ht.facts(motion)),
        "verdict": str(ht.classify(top, start)),
        "check": judged.digits,
        "plane": plane["period"].tobytes().hex(),
        "cells": [untimed(each._repr_html_()) for each in shown],
        "figure": untimed(svg(motion_figure(motion))),
    }


def files():
    """The files in this folder, by their digests; but those that name a process, or clips."""
    found = (each for each in Path().rglob("*") if each.is_file())
    same = sorted(x for x in found if x.suffix != ".svg" and x.name not in {"lock", "report.html"})
    return {each.as_posix(): sha256(each.read_bytes()).hexdigest() for each in same}


if __name__ == "__main__":
    os.chdir(sys.argv[1])
    sys.modules["sympy"] = None  # it is there, and slow: only what derives may ask for it
    done = commands(CLOSED) | {"calls": calls()}
    del sys.modules["sympy"]
    done |= commands(DERIVED) | {"files": files()}
    done |= commands(INTEGRATED) | commands(KEPT) | {"left": files()}
    json.dump(done, sys.stdout)
