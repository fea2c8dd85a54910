"""The package beside its frozen version: every difference between their answers, a line each.

    python validation/compare.py [--old COMMIT] [--scenes 200] [--only run,motion,study,exit]

The old version is built from the history, once, in .cache/. A process of each version answers the
same cases at the same time, by this Python with its packages. Doubles travel as JSON, which keeps
every bit.
"""

import argparse
import contextlib
import io
import json
import os
import re
import runpy
import shlex
import subprocess
import sys
from collections import Counter, defaultdict
from fractions import Fraction
from importlib import import_module
from itertools import cycle, product
from pathlib import Path
from tempfile import TemporaryDirectory

from mpmath import nstr

FROZEN = "996b475d4f3725c3c443482327b9f2e5f64d6577"
EXPLAINED = {  # pattern of a line of the list -> why it may stand there
    r"\bsteps: \d+ -> ": "steps behind the end of a short run are guessed otherwise, and counted",
    r"document\.(points\[\d+\]\.family|sent|jobs): ": "keys that nothing read are gone",
    r"scene\.source: .* 2.10|\.sicm-second-edition: ": "editions of SICM have different tops",
    r"document\.(rules\.|phase: )": "other words of rules; workprec looks where drift looks",
    r"plan\.cost_s: ": "quadratures of angles are counted in every form that has them",
    r"warnings\[\d+\]: .* moves theta from ": "a kick that holds omega3 in fewer words",
    r"\bwhy: .*(θ is constant|stays on the ver)": "other facts of steady tops are facts alone",
    r"(samples\.(\w+dot|omega|quaternion)|document\.top): .gone. -> ": "a run has all its columns",
    r"document\.final\.psi_mod: ": "psi, itself held to 1e-14, takes no turns of a rounded phi",
    r"((planar|pole-start)-17-(\d*[27]|150)|top --digits).*events\..*phi": "a pole, at later times",
    r"check data.csv .*method\.(sentence|rounding): ": "what the rounding of a table does is told",
    r"(exponent|stderr\.\w+|growth\.\w+|orders\.[\w-]+): [\d.]+ ": "powers are fitted by numpy",
}
REPLANNED = re.compile(r"plan\.(formulation|projected|precision)$")
PLANNED = "auto takes the axis form beside one pole, and projects less: the same digits are met"
HELD = re.compile(r"missed_\w+|motion\.|events\.\w+$")  # also of a run by another plan

ROOT = Path(__file__).resolve().parents[1]
SEED, GOLDEN = 17, 0.6180339887498949
DROPPED = re.compile(  # by the clock, the machine, and the words of the command
    r"(derive|compile|integrate|setup)_s|us_\w+|\w+_per_s|runs|(front|cheapest)(_theta)?"
    r"|versions|files|command|schema"
)
# Errors are sums of roundings: as good within a factor, or where both are a few ulps.
ERRORS = re.compile(
    r"\b\w*error(s|_spread)?\b|\b(bound|observed|rounding|residual|condition)\b"
    r"|methods\[.*\b(energy|p_phi|p_psi|phase_s|axis|invariants)\b|curves\.\w+|missed_digits\.\w+"
)
FACTOR, FLOOR = 4, 2e-15
# What is computed from the states of a run, which have to be the same: in another order of its sums
TOLD = re.compile(
    r"\.(document\.(final|events\.table)|read back\.(samples|events|between))\b"
    r".*\.(theta|phi|psi|thetadot|phidot|psidot|axis|omega|quaternion|residual)\b"
)
LAST_BITS = 1e-14  # of them, relative to max(1, |x|)
LAST_DIGIT = Fraction(2, 10**50)
PROMISED = 1e-12  # of arrays of the closed form, relative to max(1, |x|), of vectors to the largest
NARROW = Fraction(1, 10**18)  # a ball that is no wider, relative to max(1, |x|), may be another

# --- the cases -----------------------------------------------------------------------------------

OPTIONS = (  # of random scenes, which take turns
    *("", "--formulation axis", "--digits 25", "--formulation attitude"),
    "--digits 6 --set 'want.quantities=[\"theta\"]'",
)
STUDIES = """
plan sicm-kicked
run sicm-kicked --digits 40
run through-top --digits 30
run sicm-kicked --formulation lagrange
run sicm-kicked --formulation routh
run sicm-kicked --formulation cubic --set 'want.quantities=["theta"]'
run sicm-kicked --set span.time=200
drift sicm-kicked --periods 300 --ensemble 2 --methods taylor-axis,taylor-axis-projected,gauss8=32
drift through-top --periods 20 --methods auto,dop853-cyrk
workprec sicm-kicked --periods 10 --methods taylor-axis,sofroniou-spaletta10 --budget 900
stress --cases through-top,start-at-top,cusp --methods auto,dop853-cyrk,gauss8 --time-limit 90
atlas sicm-kicked --x phidot=-20:20:40 --y psidot=10:300:40 --jobs 1
atlas sleeping --x theta=0:1:20 --y psidot=1:300:20:log --jobs 1 --only kind
certify sicm-kicked
certify through-top --set span.time=1
reference sicm-kicked --times 0:2:0.25 --digits 50 --quantities theta,phi,psi,rates,axis,attitude
reference through-top --times 0:2:0.25 --digits 30
reference sicm-kicked --times 0:2:0.01 --digits 9 -o data.csv
check data.csv --scene sicm-kicked
check data.csv --scene sicm-kicked --set start.phidot=-15.001
derive
scenes
"""
EXITS = {  # by first words, what follows them
    "": "--version | --help | nosuch | run | run --nosuch | reference | atlas | report nosuch",
    "run": "nosuch | . | bad.toml | empty.toml | unknown.toml | half.toml | top.toml | good.toml",
    "run sicm-kicked": "--digits 0 | --digits 1.5 | --digits 20000 | --formulation nosuch"
    " | --formulation cubic | -o good.toml | -o made --no-figures",
    "run good.toml -o made --no-figures": "| --force",  # where another run is
    "run sicm-kicked --set": "start.theta=4 | start.theta=nan | start.nosuch=1 | theta=1 | top.A=0"
    " | top.A=-1 | top.C=-1 | top.C=0 | top.C=1e-3 | top.gMR=0 | top.gMR=inf | span.time=0"
    " | span.time=1e400 | want.samples=1 | want.quantities=[] | start.omega3=1",
    "run through-top --formulation": "lagrange | routh",
    "resume": "made | nosuch | .",
    "classify": "nosuch | good.toml | sicm-kicked --set top.C=-1",
    "drift": "at-rest --periods 10 | good.toml --periods 5 --methods gauss8 --no-figures",
    "drift sicm-kicked": "--periods 0 | --methods x | --methods gauss8=0 | --methods x.py:f | -j 0",
    "workprec": "sicm-kicked --methods nosuch | sicm-kicked --budget -1 | at-rest",
    "stress": "--cases nosuch | --methods nosuch | --time-limit 0 | --list",
    "atlas sicm-kicked": "--x phidot=0:9:4 | --x nosuch=0:1:4 --y psidot=1:2:3"
    " | --x phidot=0:1:0 --y psidot=1:2:3 | --x phidot=0:1:4:log --y psidot=1:2:3",
    "certify": "nosuch | made | sicm-kicked --formulation routh",
    "reference sicm-kicked": "| --times 0:1 | --times 0:1:0 | --times 0:1:0.5 --digits 0"
    " | --times 0:1:0.5 --quantities x | --times 0:1:0.5 -o x.txt",
    "reference sicm-kicked --times": "0:2:0.01 --digits 9 -o data.csv",
    "check": "nosuch.csv | data.csv | text.csv --scene top.toml | data.xyz --scene top.toml",
    "check data.csv --scene": "nosuch | top.toml | sicm-kicked | sicm-kicked --digits 12"
    " | sicm-kicked --columns t=u",
    "film": "nosuch -o x.gif | sicm-kicked -o x.nosuch | sicm-kicked -o x.gif --seconds 0",
    "explore": "nosuch -o x.html | sicm-kicked -o x.html",
}
BEGUN = "format = 1\n[start]\ntheta = 1\n[span]\ntime = 1\n[top]\nA = 1\n"
FILES = {
    **{"bad.toml": "[top\nA = 1\n", "empty.toml": "", "half.toml": BEGUN},
    **{"good.toml": f"{BEGUN}C = 1\ngMR = 1\n", "unknown.toml": f"{BEGUN}C = 1\ngMR = 1\nx = 3\n"},
    "top.toml": "[top]\nA = 3.28e-4\nC = 6.60e-5\ngMR = 0.0456\n",
    **{"text.csv": "t,theta\n0,one\n1,two\n", "data.xyz": "t theta\n0 1\n"},
}


def cases(scenes):
    """Every case: its kind, its name and what is asked."""
    for kind, (scene, options) in product(("run", "motion"), scenes.items()):
        yield kind, scene, {"scene": scene, "options": options}
    for words in STUDIES.strip().splitlines():
        yield "study", words, {"words": f"{words} --json"}
    for first, ends in EXITS.items():
        for words in (f"{first} {end.strip()}".strip() for end in ends.split("|")):
            yield "exit", words, {"words": words}


# --- what a version is asked: public names and documents, and all of them here -------------------

RECORD = ("t", "theta", "phi", "psi", "thetadot", "phidot", "psidot", "axis", "omega", "quaternion")
EVENTS = ("kind", "t", "t_low", "theta", "phi", "phidot", "axis")
PLAN = ("formulation", "precision", "tolerance", "projected")
MOTION = ("tags", "certified", "period", "precession", "spin", "theta_min", "theta_max")


def columns(thing, names):
    return {name: plain(getattr(thing, name)) for name in names if hasattr(thing, name)}


def plain(value):
    """A value as JSON has it; a number of many digits as a text of 50."""
    if isinstance(value, tuple):
        return [plain(each) for each in value]
    if hasattr(value, "_mpf_"):
        return nstr(value, 50, strip_zeros=False)
    return value.tolist() if hasattr(value, "tolist") else value


def run(case):
    """A run's document, and its trajectory read back."""
    words = f"run {case['scene']} {case['options']} -o {case['scene']}.run --no-figures --json"
    answer = study({"words": words})
    file = Path(f"{case['scene']}.run", "trajectory.nc")
    return answer | ({"read back": tried(read_back, file)} if file.exists() else {})


def read_back(file):
    import heavytop as ht

    found = ht.load_trajectory(file)
    between = found(GOLDEN * float(found.t[-1]))
    answer = {"plan": columns(found.plan, PLAN), "samples": columns(found, RECORD)}
    return answer | {"events": columns(found.events, EVENTS), "between": columns(between, RECORD)}


def tried(question, asked):
    try:
        return question(asked)
    except Exception as error:
        return {"raised": type(error).__name__}


def motion(case):
    """The closed form at 50 digits and in arrays, and the proved kind."""
    import heavytop as ht

    scene = ht.load_scene(case["scene"])
    found = ht.Motion(scene.top, scene.start)
    unit = found.period or 1.0 if scene.time is None else float(scene.time)
    exact = [found.at(t, digits=50) for t in (unit, GOLDEN * unit)]
    answer = {"kind": str(found.kind), **columns(found, MOTION)}
    answer["exact"] = [columns(each, (*RECORD, "energy")) for each in exact]
    answer["arrays"] = columns(found.at([i / 16 * unit for i in range(17)]), RECORD)
    return answer | {"classify": study({"words": f"classify {case['scene']} --json"})}


def study(case):
    """The exit code of a command, and its document or text."""
    sys.argv, out, code = ["heavytop", *shlex.split(case["words"])], io.StringIO(), 0
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
        try:
            runpy.run_module("heavytop", run_name="__main__")
        except SystemExit as end:
            code = int(end.code or 0)
    if code == 130:  # a command ends well when it is stopped: that is no answer
        raise KeyboardInterrupt
    with contextlib.suppress(ValueError):
        return {"exit": code, "document": json.loads(out.getvalue())}
    return {"exit": code, "document": out.getvalue()}


def draw(case):
    """Random scenes, by the script that draws them in the version that is asked."""
    drawn = import_module("43_fuzz").scenes(SEED, case["n"])
    return {f"{x.name}.toml": x.to_toml() for x in drawn}


def work(tree):
    """Answer cases, JSON lines in and out, with the version in a tree."""
    sys.path[0] = str(tree / "validation")
    import heavytop

    assert Path(heavytop.__file__).is_relative_to(tree), heavytop.__file__
    asked = {
        **{"run": run, "motion": motion, "study": study},
        "exit": lambda case: {"exit": study(case)["exit"]},
        "draw": draw,
    }
    answers, sys.stdout = sys.stdout, sys.stderr
    for line in sys.stdin:
        kind, case = json.loads(line)
        answer = tried(asked[kind], case)
        print(json.dumps(answer), file=answers, flush=True)


# --- both asked, and compared --------------------------------------------------------------------


def frozen(commit):
    """The folder of an old version, made from the history when it is not there."""
    tree = ROOT / ".cache" / f"frozen-{git(ROOT, 'rev-parse', commit)}"
    if not tree.exists():
        git(ROOT, "worktree", "add", "--force", "--detach", str(tree), commit)
    git(tree, "diff", "--exit-code", "HEAD")  # nobody has changed it
    return tree


def git(folder, *words):
    return subprocess.check_output(["git", "-C", str(folder), *words], text=True).strip()


def begin(tree, folder):
    """A process that answers with the version in a tree, in a folder of its own."""
    folder.mkdir()
    words = [sys.executable, str(Path(__file__).resolve()), "--work", str(tree)]
    cache = os.environ.get("HEYOKA_CACHE_DIR", str(ROOT / ".cache/heyoka"))
    env = os.environ | {"PYTHONPATH": str(tree / "src"), "HEYOKA_CACHE_DIR": cache}
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    return subprocess.Popen(words, cwd=folder, env=env, text=True, **pipes)


def ask(workers, kind, case):
    """What each answers, all at the same time."""
    for worker in workers:
        worker.stdin.write(json.dumps([kind, case]) + "\n")
        worker.stdin.flush()
    return [json.loads(worker.stdout.readline()) for worker in workers]


def differences(old, new, key="", *, exactly=True):
    """Every key where two answers differ, with both values; of a column of numbers the first.

    Where it need not be exactly, the closed form and what runs tell may differ in their last bits.
    """
    if isinstance(old, dict) and isinstance(new, dict):
        for name in (each for each in {**old, **new} if not DROPPED.fullmatch(each)):
            both = (each.get(name, "gone") for each in (old, new))
            yield from differences(*both, f"{key}.{name}", exactly=exactly)
    elif same(old, new, key) or (not exactly and near(old, new, key)):
        return
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        found = []
        for i, pair in enumerate(zip(old, new, strict=True)):
            found += differences(*pair, f"{key}[{i}]", exactly=exactly)
        if len(found) > 1 and not isinstance(old[0], dict):
            found = [(*found[0][:2], f"{found[0][2]} ({len(found)} such)")]
        yield from found
    else:
        yield key, short(old), short(new)


def same(old, new, key):
    if json.dumps(old) == json.dumps(new):  # so −0 is not 0, and nan is nan
        return True
    if key.startswith(".exact") and isinstance(old, str) and isinstance(new, str):
        first, second = Fraction(old), Fraction(new)
        return abs(first - second) <= LAST_DIGIT * max(1, abs(first))
    if ERRORS.search(key) and isinstance(old, float) and isinstance(new, float):
        low, high = sorted((abs(old), abs(new)))
        return high <= max(FLOOR, FACTOR * low)
    return False


def near(old, new, key):
    """Whether the closed form, or what a run tells, is as near as is promised."""
    ends = isinstance(old, list) and old and isinstance(old[0], str)
    if ends and re.search(r"enclosure\.\w+(\[\d\])?$", key):
        return as_narrow(*(list(map(Fraction, each)) for each in (old, new)))
    if re.fullmatch(r"\.arrays\.(axis|omega|quaternion)\[\d+\]", key):
        off = max(abs(a - b) for a, b in zip(old, new, strict=True))
        return bool(off <= PROMISED * max(1, *map(abs, old)))
    bound = PROMISED if key.startswith(".arrays.") else LAST_BITS if TOLD.match(key) else 0.0
    numbers = isinstance(old, float) and isinstance(new, float)
    return bool(numbers and bound and abs(old - new) <= bound * max(1, abs(old)))


def as_narrow(old, new):
    """Whether an interval meets the old one, and is not much wider."""
    (low, high), (least, most) = old, new
    wide = max(FACTOR * (high - low), NARROW * max(1, abs(low)))
    return least <= high and low <= most and most - least <= wide


def short(value):
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 100 else f"{text[:99]}…"


def compared(pair, asked):
    """Ask both every case, print what differs, and count cases, differences and explained ones."""
    counts = defaultdict(Counter)
    for kind, name, case in asked:
        counts["cases"][kind] += 1
        found = [*differences(*ask(pair, kind, case), exactly=False)]
        if any(REPLANNED.search(key) for key, *_ in found):
            counts["explained"][PLANNED] += 1
            found = [each for each in found if HELD.search(each[0])]
        for key, old, new in found:
            line = f"{kind} {name} {key.removeprefix('.')}: {old} -> {new}"
            why = next((why for each, why in EXPLAINED.items() if re.search(each, line)), None)
            if why is None:
                print(line, flush=True)
            counts["explained" if why else "differences"][why or kind] += 1
    return counts


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--old", default=FROZEN, help="a commit")
    parser.add_argument("--scenes", type=int, default=200)
    parser.add_argument("--only", default="run,motion,study,exit")
    parser.add_argument("--work", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    os.environ.pop("COLUMNS", None)  # the width of a terminal is in no answer
    if given.work:
        work(given.work)
        return
    tree = frozen(given.old)
    with TemporaryDirectory() as folder:
        folders = [Path(folder, name) for name in ("old", "new")]
        pair = [*map(begin, (tree, ROOT), folders)]
        shipped = sorted(each.stem for each in (tree / "src/heavytop/scenes").glob("*.toml"))
        (drawn,) = ask(pair[:1], "draw", {"n": given.scenes - len(shipped)})
        for place, (name, text) in product(folders, (FILES | drawn).items()):
            (place / name).write_text(text, "utf-8")
        scenes = dict.fromkeys(shipped[: given.scenes], "")
        scenes |= dict(zip(drawn, cycle(OPTIONS), strict=False))
        some = (case for case in cases(scenes) if case[0] in given.only.split(","))
        counts = compared(pair, some)
        for worker in pair:
            worker.communicate()
    for kind, count in counts["cases"].items():
        print(f"{kind}: {count} cases, {counts['differences'][kind]} differences")
    for why, count in counts["explained"].items():
        print(f"explained, {count} times: {why}")
    sys.exit(1 if counts["differences"] else 0)


if __name__ == "__main__":
    main()
