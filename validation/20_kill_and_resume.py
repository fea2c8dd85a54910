"""A study killed ten times, at random moments, ends in the files of one that was not."""

import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from claim import claim, finish

KILLS = 10
METHODS = ("taylor-axis", "taylor-axis-projected", "sofroniou-spaletta10", "dop853-cyrk")
ASKED = (
    *("sicm-kicked", "--periods", "1e6", "--ensemble", "2", "-q", "--no-figures"),
    *("--methods", ",".join(METHODS)),
)
draw = random.Random(1)


def heavytop(*arguments):
    return subprocess.Popen([sys.executable, "-m", "heavytop", *arguments], stdout=subprocess.PIPE)


def result_files(folder):
    files = (p for p in folder.rglob("*") if p.is_file() and p.name not in ("lock", "cost.json"))
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in files}


def moments():
    """Times at which to kill: soon, so that ten of them fit before the end."""
    return draw.uniform(2.0, 6.0)


with tempfile.TemporaryDirectory() as place:
    whole, killed = Path(place) / "whole", Path(place) / "killed"
    heavytop("drift", *ASKED, "-j", "2", "-o", str(whole)).communicate()
    process, kills = heavytop("drift", *ASKED, "-j", "2", "-o", str(killed)), 0
    while kills < KILLS:
        time.sleep(moments())
        if process.poll() is not None:
            break
        process.send_signal(signal.SIGKILL)
        process.communicate()
        kills += 1
        process = heavytop("resume", str(killed), "-j", str(draw.choice((1, 2))), "-q")
    process.communicate()
    one, other = result_files(whole), result_files(killed)
    print(f"     killed {kills} times; {len(one)} files, {sum(map(len, one.values()))} bytes")
    claim("kills that did not happen, of ten", KILLS - kills, 0)
    claim("exit code of the last process", process.returncode, 0)
    claim("files that differ", len({*one, *other}) - sum(other.get(n) == one[n] for n in one), 0)
finish()
