"""Documents of the command line, kept to see whether a change of the code changes them.

    python validation/goldens.py take FILE
    python validation/goldens.py compare FILE [--tolerance 1e-15]

The package that is tested is the one that Python finds: another tree is named by PYTHONPATH.
FILE is a .json.xz. It holds the texts of the random scenes too, so that `compare` draws none.
What depends on the clock or on the machine is left out.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import lzma
import os
import re
import runpy
import sys
import time
from collections.abc import Iterator, Mapping
from fractions import Fraction
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

SEED, COUNT = 17, 40
VERBS = ("run", "classify", "plan")
# Some scenes need many digits; and one small study of each kind.
OTHERS = (
    "scenes",
    "derive",
    "run sicm-kicked --digits 40",
    "run through-top --digits 30",
    "run sicm-kicked --set span.periods=1e12",  # by the closed form
    "run sicm-kicked --formulation lagrange",
    "run no-such-scene",
    "run sicm-kicked --set start.theta=4",
    "classify sicm-kicked --set top.C=-1",
    "plan sicm-kicked --formulation no-such-form",
    "drift sicm-kicked --periods 300 --ensemble 2",
    "atlas sicm-kicked --x phidot=-20:20:40 --y psidot=10:300:40 --jobs 1",
    "stress --cases through-top,planar-rotating,start-at-top"
    " --methods auto,taylor-axis,dop853-cyrk,gauss8 --time-limit 60",
    "workprec sicm-kicked --periods 20 --methods taylor-axis,sofroniou-spaletta10 --budget 600",
)
INTERRUPTED = 130
LOUD = ("scenes", "derive")  # verbs without --quiet
TIMES = {"derive_s", "compile_s", "integrate_s", "setup_s", "us_per_period", "us_spread"}
RATES = {"kinds_per_s", "rows_per_s"}
CHOSEN_BY_TIME = {"runs", "front", "front_theta", "cheapest", "cheapest_theta"}  # of workprec
DROPPED = TIMES | RATES | CHOSEN_BY_TIME | {"versions", "files", "command"}
DECIMAL = re.compile(r"[-+]?[0-9]+(\.[0-9]*)?([eE][-+]?[0-9]{1,4})?")


def random_scenes() -> dict[str, str]:
    """Random scenes as TOML, by file name."""
    import fuzz

    return {f"{each.name}.toml": each.to_toml() for each in fuzz.scenes(SEED, COUNT)}


def commands(scenes: Mapping[str, str]) -> list[str]:
    """The commands whose documents are kept."""
    shipped = answer("scenes")["document"]["scenes"]
    return [f"{verb} {name}" for name in (*shipped, *scenes) for verb in VERBS] + [*OTHERS]


def answer(command: str) -> dict[str, Any]:
    """The exit code of a command, its document or text, and what it says on stderr."""
    words = command.split()
    quiet = [] if words[0] in LOUD else ["-q"]
    sys.argv = ["heavytop", *words, "--json", *quiet]
    out, err, code = io.StringIO(), io.StringIO(), 0
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            runpy.run_module("heavytop", run_name="__main__")
        except SystemExit as end:
            code = int(end.code or 0)
    if code == INTERRUPTED:  # a verb ends well when it is stopped: that is no document to keep
        raise KeyboardInterrupt
    text = out.getvalue()
    try:
        document = stripped(json.loads(text))
    except ValueError:
        document = text
    return {"exit": code, "stderr": err.getvalue(), "document": document}


def stripped(value: Any) -> Any:
    """A document without what depends on the clock or on the machine."""
    if isinstance(value, dict):
        return {key: stripped(each) for key, each in value.items() if key not in DROPPED}
    return [stripped(each) for each in value] if isinstance(value, list) else value


def made(scenes: Mapping[str, str], asked: list[str] | None = None) -> dict[str, Any]:
    """The answers to commands, in a folder that holds the random scenes."""
    found, began = {}, time.perf_counter()
    with TemporaryDirectory() as folder, contextlib.chdir(folder):
        for name, text in scenes.items():
            Path(name).write_text(text, "utf-8")
        for command in asked or commands(scenes):
            found[command] = answer(command)
    seconds = time.perf_counter() - began
    print(f"{len(found)} documents of {sys.modules['heavytop'].__file__} in {seconds:.0f} s")
    return found


def differences(old: Any, new: Any, tolerance: Fraction, place: str = "") -> Iterator[str]:
    """Every place where two documents differ, and how."""
    numbers = number(old), number(new)
    if None not in numbers and not (type(old) is type(new) is int):
        off = abs(numbers[1] - numbers[0])
        if type(old) is not type(new) or off > tolerance * max(1, abs(numbers[0])):
            yield f"{place}: {old!r} became {new!r}, by {float(off):.2g}"
    elif type(old) is not type(new):
        yield f"{place}: {short(old)} became {short(new)}"
    elif isinstance(old, dict):
        for key in [*old, *(key for key in new if key not in old)]:
            if key not in new or key not in old:
                yield f"{place}.{key}: {'is gone' if key in old else 'is new'}"
            else:
                yield from differences(old[key], new[key], tolerance, f"{place}.{key}")
    elif isinstance(old, list):
        if len(old) != len(new):
            yield f"{place}: {len(old)} items became {len(new)}"
            return
        for i, pair in enumerate(zip(old, new, strict=True)):
            yield from differences(*pair, tolerance, f"{place}[{i}]")
    elif old != new:
        yield f"{place}: {short(old)} became {short(new)}"


def number(value: Any) -> Fraction | None:
    """The number that a value or a decimal text stands for, if it is one."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return Fraction(value)
    return Fraction(value) if isinstance(value, str) and DECIMAL.fullmatch(value) else None


def short(value: Any) -> str:
    """A value as it stands in the list of differences."""
    text = repr(value)
    return text if len(text) <= 200 else text[:197] + "..."


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("what", choices=("take", "compare"))
    parser.add_argument("file", type=Path)
    parser.add_argument("--tolerance", type=Fraction, default=Fraction("1e-15"))
    asked = parser.parse_args()
    os.environ.pop("COLUMNS", None)  # the width of a terminal is in no message
    file = asked.file.resolve()
    if asked.what == "take":
        scenes = random_scenes()
        kept = {"scenes": scenes, "documents": made(scenes)}
        file.parent.mkdir(parents=True, exist_ok=True)
        new = file.with_name(f"{file.name}.{os.getpid()}")
        new.write_bytes(lzma.compress(json.dumps(kept).encode()))
        new.replace(file)
        return
    kept = json.loads(lzma.decompress(file.read_bytes()))
    found = made(kept["scenes"], [*kept["documents"]])
    count = 0
    for command, old in kept["documents"].items():
        for line in differences(old, found[command], asked.tolerance):
            print(f"{command} {line}")
            count += 1
    print(f"{len(found)} documents, {count} differences")
    sys.exit(1 if count else 0)


if __name__ == "__main__":
    main()
