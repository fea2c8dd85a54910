"""Small random errors in the code, and which share of them the quick tests catch.

    python validation/mutants.py run FILE [--tree DIR] [--count 200] [--seed 17] [--place DIR]
    python validation/mutants.py share FILE

Each is put into a copy of the tree, where the quick tests run until one fails. FILE has a line of
JSON for each, so that a run goes on where it was stopped; the first line is of no error at all.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import random
import re
import resource
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

CPU_S, MEMORY = 600, 8 * 2**30  # of one mutant; CPU time, since a busy machine is no endless loop
UNTESTED = ("cli", "claims", "ledger", "pages", "report", "stresses", "workprecs")  # here
TESTS = """
contract/test_bad_scenes contract/test_options contract/test_first_questions contract/test_scene
analytic/test_balls_published analytic/test_double_double analytic/test_cubic analytic/test_motion
analytic/test_fast_top analytic/test_constants analytic/test_balls_edges analytic/test_passes
analytic/test_attitude_of_motion analytic/test_solids analytic/test_intervals analytic/test_steady
analytic/test_sleeping analytic/test_top analytic/test_exact two_ways/test_lagrangian
two_ways/test_constants two_ways/test_quadrature_and_events analytic/test_exact_values
analytic/test_atlas_plane analytic/test_elliptic analytic/test_spin_and_tilt
analytic/test_exact_signs analytic/test_built_from_roots analytic/test_kinds two_ways/test_exercises
two_ways/test_monodromy two_ways/test_heyokas_own_derivations two_ways/test_attitude
two_ways/test_forms_beside_a_pole analytic/test_book analytic/test_potential analytic/test_facts
analytic/test_shipped_scenes contract/test_scenes_of_every_kind analytic/test_quadrature
analytic/test_balls_against_closed_form analytic/test_every_motion contract/test_classify
analytic/test_scene_accuracy analytic/test_rates two_ways/test_many_tops two_ways/test_folding
analytic/test_energy_momentum two_ways/test_rivals two_ways/test_drift analytic/test_kinds_many
analytic/test_double_form two_ways/test_sensitivity
"""  # the quickest files first
SLOW = """
two_ways/test_folding.py::test_four_hundred_digits
two_ways/test_folding.py::test_tops_drawn_at_random
two_ways/test_sensitivity.py::test_every_column_is_the_closed_forms
two_ways/test_sensitivity.py::test_a_small_nutation_keeps_its_digits
two_ways/test_rivals.py::test_the_table_can_be_read_without_any_library
analytic/test_exact_values.py::test_neither_flint_nor_mpmath_is_imported_for_rationals_and_pi
contract/test_classify.py::TestWhatItImports
contract/test_scene.py::test_reading_a_rational_scene_loads_no_heavy_library
"""  # and those that begin processes: left out

CHANGED = {
    ast.Lt: ("<", ">"), ast.LtE: ("<=", ">="), ast.Gt: (">", "<"), ast.GtE: (">=", "<="),
    ast.Eq: ("==", "!="), ast.NotEq: ("!=", "=="), ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in"), ast.Is: ("is", "is not"), ast.IsNot: ("is not", "is"),
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"),
    ast.And: ("and", "or"), ast.Or: ("or", "and"),
}  # fmt: skip
TEXTS = (str, ast.JoinedStr, ast.List, ast.Tuple, ast.Dict)
HINTS = ("Annotated", "Literal", "Callable", "Mapping")  # what stands behind them is a type
KEY = ("file", "line", "column", "old", "new")

Change = tuple[str, int, int, str]  # its kind, from where to where [bytes], and what is put there


class Source:
    """A file of the package, and the places in it where an error can be put."""

    def __init__(self, tree: Path, file: Path) -> None:
        self.file = str(file)
        self.bytes = (tree / file).read_bytes()
        self.lines = self.bytes.splitlines(keepends=True)
        self.begins = [sum(map(len, self.lines[:i])) for i in range(len(self.lines))]

    def mutants(self) -> Iterator[dict[str, Any]]:
        for node in code(ast.parse(self.bytes)):
            for kind, start, end, new in self.changes(node):
                row = max(i for i, begin in enumerate(self.begins) if begin <= start)
                place = {"column": start - self.begins[row], "start": start}
                words = {"old": self.bytes[start:end].decode(), "new": new, "kind": kind}
                yield {"file": self.file, "line": self.lines[row].decode(), **place, **words}

    def changes(self, node: ast.AST) -> Iterator[Change]:
        """The errors that one node can have."""
        match node:
            case ast.Compare(left=left, ops=ops, comparators=others):
                for a, op, b in zip((left, *others), ops, others, strict=False):
                    yield from self.operator("comparison", a, op, b)
            case ast.BinOp(left=a, op=op, right=b):
                yield from self.operator("arithmetic", a, op, b)
            case ast.AugAssign(target=a, op=op, value=b):
                yield from self.operator("arithmetic", a, op, b, "=")
            case ast.BoolOp(op=op, values=values):
                for a, b in pairwise(values):
                    yield from self.operator("and, or", a, op, b)
            case ast.UnaryOp(op=ast.Not() | ast.USub(), operand=operand):
                yield "not, minus", self.at(node)[0], self.at(node)[1], f"({self.text(operand)})"
            case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
                new = value + 1 if isinstance(value, int) else value * 1.1 if value else 1.0
                yield "number", *self.at(node), repr(new)
            case ast.If(test=test) | ast.IfExp(test=test) | ast.While(test=test):
                yield "condition", *self.at(test), f"not ({self.text(test)})"
            case ast.Return(value=ast.expr() as value) if self.text(value) != "None":
                yield "return", *self.at(value), "None"

    def operator(
        self, kind: str, left: ast.expr, op: ast.AST, right: ast.expr, tail: str = ""
    ) -> Iterator[Change]:
        """The operator between two nodes changed, where nothing but brackets stands beside it."""
        if type(op) not in CHANGED or (kind == "arithmetic" and is_text(left, right)):
            return
        old, new = CHANGED[type(op)]
        start, end = self.at(left)[1], self.at(right)[0]
        pattern = rf"[\s)]*({re.escape(old + tail)})[\s(]*"
        if found := re.fullmatch(pattern.encode(), self.bytes[start:end]):
            yield kind, start + found.start(1), start + found.end(1), new + tail

    def at(self, node: ast.expr) -> tuple[int, int]:
        """From where to where a node stands [bytes]."""
        start = self.begins[node.lineno - 1] + node.col_offset
        return start, self.begins[node.end_lineno - 1] + node.end_col_offset

    def text(self, node: ast.expr) -> str:
        start, end = self.at(node)
        return self.bytes[start:end].decode()


def is_text(*nodes: ast.expr) -> bool:
    """Whether one is a text or a list: what cannot be subtracted is no small error."""
    return any(isinstance(getattr(each, "value", each), TEXTS) for each in nodes)


def code(node: ast.AST) -> Iterator[ast.AST]:
    """All nodes that are run: no types, and no f-strings, whose parts Python 3.11 misplaces."""
    match node:
        case ast.JoinedStr() | ast.If(test=ast.Name(id="TYPE_CHECKING")):
            return
        case ast.Subscript(value=ast.Name(id=name)) if name in HINTS:
            return
        case ast.AnnAssign(annotation=ast.Name(id="TypeAlias")):
            return
    yield node
    for name, value in ast.iter_fields(node):
        if name not in ("annotation", "returns"):
            for each in value if isinstance(value, list) else [value]:
                if isinstance(each, ast.AST):
                    yield from code(each)


def limited() -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_S, CPU_S + 10))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def tested(copy: Path) -> dict[str, Any]:
    """What the quick tests say of the copy as it is, and the CPU time they take [s]."""
    shutil.rmtree(copy / ".hypothesis", ignore_errors=True)
    words = "-m pytest -x -q -p no:cacheprovider -p no:xdist --no-header --hypothesis-seed=0".split
    files = [f"tests/{name}.py" for name in TESTS.split()]
    command = [sys.executable, *words(), *(name for name in files if (copy / name).exists())]
    command += [word for name in SLOW.split() for word in ("--deselect", f"tests/{name}")]
    here = os.environ | {"PYTHONPATH": str(copy / "src")}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    ended = subprocess.run(
        command, cwd=copy, env=here, capture_output=True, text=True, preexec_fn=limited
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    other = "time out" if ended.returncode < 0 else "import error"  # SIGXCPU, or a crash
    outcome = {0: "survived", 1: "failed"}.get(ended.returncode, other)
    by = re.search(r"^(?:FAILED|ERROR) (\S+)", ended.stdout, re.MULTILINE)
    last = by[1] if by else ended.stdout[-100:]
    return {"outcome": outcome, "code": ended.returncode, "by": last, "cpu_s": round(cpu, 1)}


def run(file: Path, tree: Path, count: int, seed: int, place: Path) -> None:
    """Test the mutants that FILE does not have yet."""
    rows = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    done = {tuple(row[name] for name in KEY) for row in rows}
    copy = place / f"mut-{seed}"
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(tree, copy, ignore=shutil.ignore_patterns(".*", "out", "__pycache__"))
    sources = sorted(path.relative_to(tree) for path in (tree / "src/heavytop").rglob("*.py"))
    drawn = [each for source in sources for each in Source(tree, source).mutants()]
    random.Random(seed).shuffle(drawn)
    nothing = dict.fromkeys(KEY, "") | {"file": "README.md", "kind": "none", "start": 0}
    for mutant in [nothing, *drawn[:count]]:
        if tuple(mutant[name] for name in KEY) in done:
            continue
        path = copy / mutant["file"]
        text = path.read_bytes()
        end = mutant["start"] + len(mutant["old"].encode())
        path.write_bytes(text[: mutant["start"]] + mutant["new"].encode() + text[end:])
        row = mutant | tested(copy)
        path.write_bytes(text)
        for stale in path.parent.glob(f"__pycache__/{path.stem}.*.pyc"):
            stale.unlink()
        if mutant is nothing and row["outcome"] != "survived":
            sys.exit(f"the tests fail without an error: {row}")
        with file.open("a", encoding="utf-8") as out:
            out.write(json.dumps(row, ensure_ascii=False) + "\n")


def share(file: Path) -> None:
    """Print which share is caught, and what survived."""
    rows = [json.loads(line) for line in file.read_text().splitlines()][1:]
    for row in rows:
        folder = Path(row["file"]).parts[2]
        row |= {"all": "all", "part": "untested" if folder in UNTESTED else "tested"}
        row["folder"] = folder.removesuffix(".py")
    survived = [row for row in rows if row["outcome"] == "survived"]
    for name in ("all", "part", "kind"):
        total, lost = (Counter(row[name] for row in some) for some in (rows, survived))
        for each, n in sorted(total.items()):
            print(f"{n - lost[each]:4} of {n:4} caught, {1 - lost[each] / n:6.1%}: {each}")
    for row in survived:
        print(f"{row['file']}: {row['line'].strip()}  [{row['old']} -> {row['new']}]")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("what", choices=("run", "share"))
    parser.add_argument("file", type=Path)
    parser.add_argument("--tree", type=Path, default=Path(__file__).parent.parent)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=17)
    parser.add_argument("--place", type=Path, default=Path("/work"))
    asked = parser.parse_args()
    if asked.what == "share":
        share(asked.file)
    else:
        file, tree = asked.file.resolve(), asked.tree.resolve()
        run(file, tree, asked.count, asked.seed, asked.place)


if __name__ == "__main__":
    main()
