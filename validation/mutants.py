"""Small random errors in the code, and which share of them the tests catch.

    python validation/mutants.py map MAP
    python validation/mutants.py run FILE --map MAP [--count 200] [--seed 17]
    python validation/mutants.py share FILE

First every test says which functions it enters. Each error is then put into a copy of the tree,
where the quickest tests that enter its function run, and some others, for BUDGET_S, until one
fails; it counts as caught where that test passes without the error. FILE has a line of JSON for
each, so that a run goes on where it was stopped. Processes that tests begin are not followed, and
longer tests are left out, so that the share is a lower bound.
"""

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
import tempfile
import threading
import time
from collections import Counter
from itertools import pairwise
from pathlib import Path

import pytest

BUDGET_S = 25  # the tests of one error
CPU_S, WALL_S, MEMORY = 100, 3600, 8 * 2**30  # of one error; a busy machine is no endless loop
PYTEST = ["-m", "pytest", "-q", "-p", "no:cacheprovider", "--no-header", "--hypothesis-seed=0"]
CALLS = "MUTANTS_CALLS"  # where the tests of a map put what they enter

CHANGED = {
    ast.Lt: ("<", ">"), ast.LtE: ("<=", ">="), ast.Gt: (">", "<"), ast.GtE: (">=", "<="),
    ast.Eq: ("==", "!="), ast.NotEq: ("!=", "=="), ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in"), ast.Is: ("is", "is not"), ast.IsNot: ("is not", "is"),
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"),
    ast.And: ("and", "or"), ast.Or: ("or", "and"),
}  # fmt: skip
TEXTS = (str, ast.JoinedStr, ast.List, ast.Tuple, ast.Dict)
HINTS = ("Annotated", "Literal", "Callable", "Mapping")  # what stands behind them is a type
PACKAGE = "src/heavytop/"
TREE = Path(__file__).resolve().parents[1]
KEY = ("file", "line", "column", "old", "new")


class Source:
    """A file of the package, and the places in it where an error can be put."""

    def __init__(self, file):
        self.file = str(file.relative_to(TREE))
        self.bytes = file.read_bytes()
        self.lines = self.bytes.splitlines(keepends=True)
        self.begins = [sum(map(len, self.lines[:i])) for i in range(len(self.lines))]

    def mutants(self):
        for node in code(ast.parse(self.bytes)):
            for kind, start, end, new in self.changes(node):
                row = max(i for i, begin in enumerate(self.begins) if begin <= start)
                place = {"column": start - self.begins[row], "start": start}
                words = {"old": self.bytes[start:end].decode(), "new": new, "kind": kind}
                yield {"file": self.file, "line": self.lines[row].decode(), **place, **words}

    def changes(self, node):
        """The errors of a node: kind, from where to where [bytes], and what is put there."""
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

    def operator(self, kind, left, op, right, tail=""):
        """The operator between two nodes changed, where nothing but brackets stands beside it."""
        if type(op) not in CHANGED or (kind == "arithmetic" and is_text(left, right)):
            return
        old, new = CHANGED[type(op)]
        start, end = self.at(left)[1], self.at(right)[0]
        pattern = rf"[\s)]*({re.escape(old + tail)})[\s(]*"
        if found := re.fullmatch(pattern.encode(), self.bytes[start:end]):
            yield kind, start + found.start(1), start + found.end(1), new + tail

    def at(self, node):
        """From where to where a node stands [bytes]."""
        start = self.begins[node.lineno - 1] + node.col_offset
        return start, self.begins[node.end_lineno - 1] + node.end_col_offset

    def text(self, node):
        start, end = self.at(node)
        return self.bytes[start:end].decode()


def is_text(*nodes):
    """Whether one is a text or a list: what cannot be subtracted is no small error."""
    return any(isinstance(getattr(each, "value", each), TEXTS) for each in nodes)


def code(node):
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


def function_of(source, start):
    """The first line, decorators too, of the innermost function around a place; 0 of none."""
    found = 0
    for node in ast.walk(ast.parse(source.bytes)):
        if isinstance(node, ast.FunctionDef) and source.at(node)[0] <= start < source.at(node)[1]:
            found = max(found, min([node.lineno, *(each.lineno for each in node.decorator_list)]))
    return found


# --- the functions that each test enters: hooks of pytest, in whose process they are ------------


class Entered:
    """What the running test has entered: `package/file.py:line` of functions."""

    def __init__(self):
        self.codes = set()

    def __call__(self, frame, event, arg):
        self.codes.add(frame.f_code)

    def taken(self):
        """All since the last time."""
        codes, self.codes = self.codes, set()
        split = ((code.co_filename.partition("/src/heavytop/")[2], code) for code in codes)
        return sorted(f"{file}:{code.co_firstlineno}" for file, code in split if file)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    """Follow one test, with its fixtures."""
    if CALLS not in os.environ:
        return (yield)
    entered, began = Entered(), time.process_time()
    sys.settrace(entered)
    threading.settrace(entered)
    try:
        return (yield)
    finally:
        sys.settrace(None)
        threading.settrace(None)
        row = {"test": item.nodeid, "s": time.process_time() - began, "calls": entered.taken()}
        append(f"{os.environ[CALLS]}.{os.getpid()}", row)


def map_tests(file):
    """Let every test say what it enters; tests that fail are left out."""
    here = os.environ | {CALLS: str(file)} | paths(TREE)
    command = [sys.executable, *PYTEST, "-rfE", "-p", "mutants", "-n2", "--dist=loadfile"]
    said = subprocess.run(command, cwd=TREE, env=here, capture_output=True, text=True).stdout
    print(*said.splitlines()[-20:], sep="\n")
    failed = set(re.findall(r"^(?:FAILED|ERROR) (.+?)(?: - |$)", said, re.MULTILINE))
    file.unlink(missing_ok=True)
    for part in file.parent.glob(f"{file.name}.*"):
        append(file, *(row for row in rows_of(part) if row["test"] not in failed))
        part.unlink()


def rows_of(file):
    """The lines of JSON of a file, if it is there."""
    return [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []


def append(file, *rows):
    """Put lines of JSON at the end of a file."""
    with Path(file).open("a", encoding="utf-8") as out:
        out.writelines(json.dumps(row, ensure_ascii=False) + "\n" for row in rows)


def paths(tree):
    """The tree's package, and this file as a plugin."""
    return {"PYTHONPATH": f"{tree / 'src'}:{Path(__file__).parent}"}


# --- the errors, one after another --------------------------------------------------------------


class Tests:
    """Which tests enter a function, and what they say of a copy of the tree."""

    def __init__(self, file):
        self.rows = sorted(rows_of(file), key=lambda row: row["s"])
        for row in self.rows:
            files = {call.partition(":")[0] for call in row["calls"]}
            row["calls"] = {*row["calls"], *(f"{each}:0" for each in files)}
        self.unsteady = set()

    def of(self, function):
        """The quickest that enter it, or its file, and others drawn at random, for BUDGET_S in all.

        What is computed once in a process, and kept, is entered by the first test alone, or by
        none, where it is computed as tests are collected.
        """
        others = random.Random(function).sample(self.rows, len(self.rows))
        file = f"{function.partition(':')[0]}:0"
        near = [row for name in (function, file) for row in self.rows if name in row["calls"]]
        found = {}
        spent = 0.0
        for row in (*near, *others):
            if row["test"] not in self.unsteady and row["test"] not in found:
                spent += row["s"]
                if spent > BUDGET_S:
                    break
                found[row["test"]] = None
        # a file's tests together, for the sake of its fixtures
        return sorted(found, key=lambda test: test.partition("::")[0])

    def failing(self, copy, tests):
        """How the tests end, and the first that fails."""
        shutil.rmtree(copy / ".hypothesis", ignore_errors=True)
        (copy / "tests.txt").write_text("\n".join(tests))
        command = [sys.executable, *PYTEST, "-x", "-p", "no:xdist", "@tests.txt"]
        try:
            ended = subprocess.run(
                command, cwd=copy, env=os.environ | paths(copy), capture_output=True, text=True,
                preexec_fn=limited, timeout=WALL_S,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            return "time out", ""
        gone = re.findall(r"^ERROR: not found: .*?(tests/.+)$", ended.stderr, re.MULTILINE)
        if gone:  # by other names: the error is in what tests are named by
            rest = [test for test in tests if test.partition("[")[0] not in gone]
            return self.failing(copy, rest) if rest else ("survived", "")
        by = re.search(r"^(?:FAILED|ERROR) (.+?)(?: - |$)", ended.stdout, re.MULTILINE)
        outcome = {0: "survived", 1: "failed"}.get(ended.returncode, "crash")  # or SIGXCPU
        return outcome, by[1] if by else ended.stdout[-300:]


def limited():
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_S, CPU_S + 10))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def run(file, tests, count, seed):
    """Test the mutants that FILE does not have yet."""
    done = {tuple(row[name] for name in KEY) for row in rows_of(file)}
    sources = map(Source, sorted((TREE / PACKAGE).rglob("*.py")))
    drawn = [(source, each) for source in sources for each in source.mutants()]
    random.Random(seed).shuffle(drawn)
    with tempfile.TemporaryDirectory() as place:
        copy = Path(place) / "tree"
        shutil.copytree(TREE, copy, ignore=shutil.ignore_patterns(".*", "out", "__pycache__"))
        for source, mutant in drawn[:count]:
            if tuple(mutant[name] for name in KEY) not in done:
                line = function_of(source, mutant["start"])
                where = f"{source.file[len(PACKAGE) :]}:{line}"
                append(file, mutant | tested(tests, copy, mutant, where))


def tested(tests, copy, mutant, function):
    """What the tests say of the copy with an error in it, which is then taken out."""
    while True:
        some = tests.of(function)
        path = copy / mutant["file"]
        text = path.read_bytes()
        end = mutant["start"] + len(mutant["old"].encode())
        path.write_bytes(text[: mutant["start"]] + mutant["new"].encode() + text[end:])
        outcome, by = tests.failing(copy, some)
        path.write_bytes(text)
        for stale in path.parent.glob(f"__pycache__/{path.stem}.*.pyc"):
            stale.unlink()
        if outcome == "failed" and tests.failing(copy, [by])[0] != "survived":
            tests.unsteady.add(by)  # it fails without the error
            continue
        return {"outcome": outcome, "tests": len(some), "by": by}


def share(file):
    """Print which share is caught, and what survived."""
    rows = rows_of(file)
    for row in rows:
        row |= {"all": "all", "folder": Path(row["file"]).parts[2].removesuffix(".py")}
    survived = [row for row in rows if row["outcome"] == "survived"]
    for name in ("all", "kind", "folder"):
        total, lost = (Counter(row[name] for row in some) for some in (rows, survived))
        for each, n in sorted(total.items()):
            print(f"{n - lost[each]:4} of {n:4} caught, {1 - lost[each] / n:6.1%}: {each}")
    for row in survived:
        print(f"{row['file']}: {row['line'].strip()}  [{row['old']} -> {row['new']}]")


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("what", choices=("map", "run", "share"))
    parser.add_argument("file", type=lambda text: Path(text).resolve())
    parser.add_argument("--map", type=Path)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=17)
    asked = parser.parse_args()
    if asked.what == "share":
        share(asked.file)
    elif asked.what == "map":
        map_tests(asked.file)
    else:
        run(asked.file, Tests(asked.map), asked.count, asked.seed)


if __name__ == "__main__":
    main()
