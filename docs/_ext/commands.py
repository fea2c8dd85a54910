"""Every command that a page or the README shows is run, in an empty folder, a page at a time.

A command is an indented line, or a line of a ```sh block, that begins with `heavytop`. What takes
long on purpose is run with less to do (`LESS`): the same verb and options, smaller numbers. What
cannot be run here carries `<!-- not run: why -->` on the line before its block. Sessions in
```console blocks, with their files and mistakes, are replayed by
tests/docs/test_first_ten_minutes.py.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Self

from sphinx.util import logging

if TYPE_CHECKING:
    from sphinx.application import Sphinx
    from sphinx.environment import BuildEnvironment

ROOT = Path(__file__).parents[2]
HEAVYTOP = str(Path(sys.executable).with_name("heavytop"))
TIME_LIMIT_S = 120

COMMAND = re.compile(r"(?: {4})?(?:\.venv/bin/)?(heavytop [a-z]+.*)")
PIECE = re.compile(
    r"^(?:<!-- not run: (?P<why>[^\n]+) -->\n+)?"
    r"(?:```(?P<fence>\w*)\n(?P<inside>.*?)^```|(?P<indented>(?: {4}[^\n]*\n)+))",
    re.MULTILINE | re.DOTALL,
)

# (what a command says, what is run in its stead): hours and minutes become seconds.
LESS = (
    (r"--periods \S+", "--periods 30"),
    (r"--ensemble \S+", "--ensemble 2"),
    (r"^(heavytop drift(?!.*--methods).*)", r"\1 --methods taylor-axis,strang"),
    (r"(:[\d.]+):\d+(?![\d.])", r"\1:24"),  # the pixels of an atlas
    (r"^(heavytop workprec .*)", r"\1 --methods taylor-axis=1e-10,strang=100 --periods 5"),
    (r"^heavytop stress(?!.*--)", "heavytop stress --cases kick-1e-9"),
    (r"^(heavytop stress --cases.*)", r"\1 --methods auto,taylor-axis"),
    (r"^heavytop validate(?: --proofs)?$", "heavytop validate 39_flint"),
    (r"my-scene\.toml", "sicm-forward"),
    (r"--scheduler tcp://\S+", ""),  # there is none: the same work by this machine alone
)

# What a page takes for granted: the folders that it goes on from.
SHORT_DRIFT = "heavytop drift sicm-kicked --periods 30 --methods taylor-axis -q -o"
BEFORE = {
    "keeping": [f"{SHORT_DRIFT} DIR"],
    "report": [
        "heavytop run sicm-kicked -q --no-figures -o out/sicm-kicked",
        f"{SHORT_DRIFT} out/long",
    ],
}

logger = logging.getLogger(__name__)


def shown(text: str) -> Iterator[str]:
    """The commands of a page, in their order."""
    for piece in PIECE.finditer(text.replace("\\\n", "")):
        if piece["why"] is None and piece["fence"] in {None, "sh"}:
            lines = (piece["indented"] or piece["inside"]).splitlines()
            yield from (found[1] for line in lines if (found := COMMAND.fullmatch(line)))


def less(command: str) -> list[str]:
    """The words of what is run in a command's stead."""
    command = " ".join(shlex.join(shlex.split(command, comments=True)).split())
    for said, run in LESS:
        command = re.sub(said, run, command)
    return shlex.split(command)


def fault(words: list[str], folder: str) -> str | None:
    """What is wrong with a command, by its exit code."""
    command = [HEAVYTOP, *words[1:]]
    pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, cwd=folder, start_new_session=True, **pipes) as process:
        try:
            _, said = process.communicate(timeout=TIME_LIMIT_S)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)  # with what it started
            return f"took more than {TIME_LIMIT_S} s"
    return None if process.returncode == 0 else f"ended with {process.returncode}: {said.strip()}"


def faults(page: str, commands: list[list[str]]) -> list[str]:
    """What is wrong with the commands of one page, run one after the other."""
    before = [shlex.split(each) for each in BEFORE.get(page, ())]
    with tempfile.TemporaryDirectory() as folder:
        found = ((words, fault(words, folder)) for words in before + commands)
        return [f"{shlex.join(words)}\n{wrong}" for words, wrong in found if wrong]


@dataclass(frozen=True, slots=True)
class Run:
    """The commands of one page as they are run, and a name for them."""

    page: str
    commands: list[list[str]]

    @classmethod
    def of(cls, page: str, source: Path) -> Self:
        """Those that a page shows, each once."""
        commands = dict.fromkeys(shown(source.read_text("utf-8")))
        return cls(page, [less(each) for each in commands])

    @property
    def key(self) -> str:
        """The same for the same page and commands."""
        return sha256(repr((self.page, self.commands)).encode()).hexdigest()


def sources(env: BuildEnvironment) -> dict[str, Path]:
    """The pages and the README."""
    return {page: env.doc2path(page) for page in sorted(env.found_docs)} | {
        "README": ROOT / "README.md"
    }


def begin(app: Sphinx, env: BuildEnvironment, docnames: list[str]) -> None:
    """Start on the commands of every page that has not passed in this state of the code.

    They run while pages are executed; those of one page in their order.
    """
    path = Path(app.config.nb_execution_cache_path) / "commands.json"
    passed = set(json.loads(path.read_text())) if path.exists() else set()
    runs = [Run.of(page, source) for page, source in sources(env).items()]
    left = [run for run in runs if run.commands and run.key not in passed]
    pool = ThreadPoolExecutor(2)
    found = [(run, pool.submit(faults, run.page, run.commands)) for run in left]
    app.connect("env-check-consistency", lambda *_: finish(path, passed, found))


def finish(path: Path, passed: set[str], found: list[tuple[Run, Future[list[str]]]]) -> None:
    """Say which commands failed, and remember the pages all of whose commands did not."""
    for run, result in found:
        for each in result.result():
            logger.warning("%s shows a command that fails: %s", run.page, each)
        if not result.result():
            passed.add(run.key)
    path.write_text(json.dumps(sorted(passed)))


def setup(app: Sphinx) -> dict[str, object]:
    """Enter the extension."""
    app.connect("env-before-read-docs", begin)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
