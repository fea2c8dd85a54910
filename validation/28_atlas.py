"""The atlas: how many pixels a second, and a hundred million pixels.

The planes are about the book's top: kicks against spins. Arguments: pixels along an axis of the
large map, for a quick look; `write` puts the table into docs/atlas.md.
"""

import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from claim import claim, finish
from page import rewrite

import heavytop as ht

HUGE = next((int(x) for x in sys.argv[1:] if x.isdecimal()), 10_000)
KICKED = ht.load_scene("sicm-kicked")
ROOM = Path(tempfile.mkdtemp(prefix="atlas-"))


def plane(side):
    return f"phidot=-20:20:{side}", f"psidot=-150:150:{side}"


def timed(**asked):
    began = time.perf_counter()
    found = ht.atlas(KICKED, **asked)
    return found, time.perf_counter() - began


WORKER = """
import sys
import heavytop as ht
x, y, what = sys.argv[1:]
how = {"kind": {"only": "kind"}, "rows": {}}[what]
ht.atlas(ht.load_scene("sicm-kicked"), x, y, jobs=1, **how)
print(open("/proc/self/status").read())
"""
SIDES = {"kind": 1700, "rows": 420}  # of three tiles


def gigabytes(what):
    """The most memory of a process that computes tiles, as a worker does."""
    words = [sys.executable, "-c", WORKER, *plane(SIDES[what]), what]
    status = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    return int(re.search(r"VmHWM:\s+(\d+) kB", status)[1]) / 1e6


def size(folder):
    return sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())


table = ["| map | pixels | pixels a second, in the workers | whole time [s] |", "|---|--:|--:|--:|"]
try:
    rates = {}
    for name, side, options in (
        ("kinds alone", 4000, {"only": "kind"}),
        ("whole rows", 1500, {}),
    ):
        x, y = plane(side)
        both = (timed(x=x, y=y, jobs=2, **options) for _ in range(2))
        best = max(both, key=lambda f: f[0].pixels_per_s)
        rates[name] = best[0].pixels_per_s
        table.append(f"| {name} | {side**2:.3g} | {best[0].pixels_per_s:.3g} | {best[1]:.1f} |")
        claim(f"{name}: pixels that are not proved", best[0].uncertified, 0)
    claim("5e6 over kinds a second, two cores", 5e6 / rates["kinds alone"], 1)
    claim("2e5 over rows a second, two cores", 2e5 / rates["whole rows"], 1)

    x, y = plane(HUGE)
    found, spent = timed(x=x, y=y, only="kind", jobs=2, folder=ROOM / "huge")
    tiles = size(ROOM / "huge")
    began = time.perf_counter()
    found.save_map(ROOM / "huge.nc")
    stored = time.perf_counter() - began
    print(f"     {HUGE**2:.0e} pixels: {spent:.1f} s, and {stored:.1f} s to write atlas.nc")
    print(f"     tiles {tiles / 1e6:.1f} MB, map {(size(ROOM) - tiles) / 1e6:.1f} MB")
    claim(f"{HUGE**2} pixels: not proved", found.uncertified, 0)
    for what in SIDES:
        claim(f"memory of a worker, {what} [GB]", gigabytes(what), 0.5)
finally:
    shutil.rmtree(ROOM)
print("\n".join(table))
if "write" in sys.argv:
    rewrite("atlas.md", "atlas", "\n".join(table))
finish()
