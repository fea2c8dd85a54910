"""The built wheel, alone with what it requires: no extra, no test, nothing of the repository.

The environment holds the wheel and links to the distributions that it requires, theirs and so on:
what `pip install heavytop` would bring in these versions, without a network. Everything that
Python opens there is written down.
"""

import json
import os
import subprocess
import sys
import tempfile
import venv
import zipfile
from importlib import metadata
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from tools import main

from heavytop.claims import proof

ROOT = Path(__file__).resolve().parents[1]
NOT_REQUIRED = ("CyRK", "numba", "distributed", "mujoco", "exudyn", "sphinx", "pytest",
                "hypothesis", "ruff")  # fmt: skip

VERBS = """
doctor --json
scenes --json
classify sicm-kicked --json
plan sicm-kicked --json
run sicm-kicked --json
run sicm-kicked --json -o out
report out --json -o page
validate book-period --json
"""
FIND = """\
import json, sys
from importlib.util import find_spec
print(json.dumps([name for name in sys.argv[1:] if find_spec(name)]))
"""

# Run by every Python of the environment before anything else.
WATCH = """\
import os, sys
_log = os.open(os.environ["HEAVYTOP_OPENED"], os.O_WRONLY | os.O_APPEND | os.O_CREAT)
def _watch(event, arguments):
    if event == "open" and isinstance(arguments[0], str):
        os.write(_log, (os.path.abspath(arguments[0]) + "\\n").encode("utf-8", "replace"))
sys.addaudithook(_watch)
"""


def built(folder):
    """Return the wheel, built by the back end that pyproject.toml names."""
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    [wheel] = folder.glob("*.whl")
    return wheel


def needed(lines, extras):
    """Return what lines of requirements ask for on this machine: names, and their extras."""
    for asked in map(Requirement, lines or []):
        marked = [{"extra": extra} for extra in ("", *extras)]
        if asked.marker is None or any(map(asked.marker.evaluate, marked)):
            yield canonicalize_name(asked.name), frozenset(asked.extras)


def closure(lines):
    """Return the distributions that lines of requirements bring, and what those bring."""
    seen, waiting = {}, list(needed(lines, ()))
    while waiting:
        name, extras = asked = waiting.pop()
        if asked not in seen:
            seen[asked] = metadata.distribution(name)
            waiting += needed(seen[asked].requires, extras)
    return {each.name: each for each in seen.values()}.values()


def environment(folder, wheel):
    """Make the environment of a wheel; return its Python, its metadata, and how much came."""
    venv.create(folder, with_pip=False, symlinks=True)
    python = folder / "bin" / "python"
    [site] = folder.glob("lib/python*/site-packages")
    pip = f"-m pip --python {python} install --quiet --no-deps --no-index".split()
    subprocess.run([sys.executable, *pip, str(wheel)], check=True, capture_output=True)
    [ours] = site.glob("heavytop-*.dist-info")
    info = metadata.PathDistribution(ours)
    brought = closure(info.requires)
    for each in brought:
        for name in {file.parts[0] for file in each.files} - {"..", "__pycache__"}:
            if not (site / name).exists():
                (site / name).symlink_to(Path(each.locate_file(name)))
    (site / "sitecustomize.py").write_text(WATCH)
    return python, info, len(brought)


class Place:
    """The environment, an empty folder to work in, and what was opened."""

    def __init__(self, folder, python):
        self.python, self.folder, self.log = python, folder / "work", folder / "opened.txt"
        self.folder.mkdir()
        kept = {name: os.environ[name] for name in ("PATH", "LANG") if name in os.environ}
        self.settings = kept | {"HOME": str(folder), "HEAVYTOP_OPENED": str(self.log)}

    def run(self, program, *words):
        """Return the exit code and the JSON of a program that is there; a failure is shown."""
        how = {"cwd": self.folder, "env": self.settings, "capture_output": True, "text": True}
        done = subprocess.run([str(self.python.with_name(program)), *words], **how)
        if done.returncode:
            print(done.stderr)
        return done.returncode, json.loads(done.stdout) if done.stdout else {}


def hold_contents(wheel):
    """Compare what is in the wheel with what should be."""
    with zipfile.ZipFile(wheel) as archive:
        inside = archive.namelist()
    foreign = [n for n in inside if n.split("/")[0] != "heavytop" and ".dist-info/" not in n]
    yield "files of the wheel outside the package", len(foreign), 0
    shipped = {path.name for path in (ROOT / "src" / "heavytop" / "scenes").glob("*.toml")}
    packed = {Path(n).name for n in inside if n.startswith("heavytop/scenes/")}
    yield "scenes missing from the wheel", len(shipped - packed), 0


def hold_verbs(place, extras):
    """Run the verbs, and compare what they find."""
    found = {}
    for line in VERBS.strip().splitlines():
        code, found[line] = place.run("heavytop", *line.split())
        yield f"exit code of heavytop {line}", code, 0
    tops = [each for line, each in found.items() if line.startswith(("classify", "run"))]
    others = [each for each in tops if each.get("motion", {}).get("kind") != "loops"]
    yield "verdicts and runs that do not find loops", len(others), 0
    optional = found["doctor --json"].get("optional", {})
    lacking = {name for name, each in optional.items() if each["missing"]}
    yield "extras that doctor does not call missing", len(extras - lacking), 0


def hold_opened(place):
    """Compare what was opened with what may be: nothing of the repository."""
    opened = place.log.read_text("utf-8").splitlines()
    inside = f"{place.python.parents[1]}/"
    seen = [name for name in opened if name.startswith(inside) and "/heavytop/" in name]
    yield "watched in vain: no module of the wheel was seen", float(not seen), 0
    used = {n for n in opened if n.startswith(f"{ROOT}/") and not n.startswith(f"{ROOT}/.venv/")}
    print("".join(f"     {name}\n" for name in sorted(used)), end="")
    yield "files of the repository opened", len(used), 0


@proof
def clean_wheel():
    """Build, install, run, and look at what was opened."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary).resolve()
        wheel = built(folder)
        yield from hold_contents(wheel)
        python, info, brought = environment(folder / "clean", wheel)
        print(f"     {wheel.name}, {wheel.stat().st_size / 1e6:.2f} MB, brings {brought} packages")
        place = Place(folder, python)
        _, there = place.run("python", "-c", FIND, *NOT_REQUIRED)
        yield "packages of extras and tests that are there", len(there), 0
        yield from hold_verbs(place, set(info.metadata.get_all("Provides-Extra")))
        yield from hold_opened(place)


if __name__ == "__main__":
    main()
