"""Measuring claims: their scripts are run, and what they measure is held to the register.

Each script runs in a process of its own under a limit of time, a few at a time. It is told by its
environment which claims to measure and where to tell what it found, as ``validation/claim.py``
does; no script judges itself.
"""

from __future__ import annotations

import json
import math
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from heavytop.claims.register import (
    NAME,
    PACKAGE,
    PACKED,
    Claim,
    Register,
    load_register,
    stem,
)
from heavytop.doctor import versions
from heavytop.errors import Exit, ForeignFile, HeavyTopError
from heavytop.results.base import Row
from heavytop.results.validation import OURS, Validation, counts
from heavytop.scene.arguments import wrong_type
from heavytop.text import LONGEST, nearest

LIMIT: Final = 120.0  # s for a script of registered claims
PROOF_LIMIT: Final = 7200.0  # s for any other: some of them time what takes minutes
LOOK: Final = 0.05  # s between two looks at what is running
GRACE: Final = 2.0  # s from SIGTERM to SIGKILL
TAIL: Final = 65536  # bytes of what a script said: its last line is in them
FAILED: Final = 5  # the code of a script one of whose claims does not hold
ASKED, TOLD, OF = (f"HEAVYTOP_CLAIMS_{name}" for name in ("ASKED", "TOLD", "OF"))
FOREIGN: Final = (ASKED, TOLD, OF, "PYTHONSAFEPATH")  # with the last, no script finds its helpers


LETTERS: Final = {"PYTHONUTF8": "1", "PYTHONIOENCODING": "utf-8"}
"""Of an environment: what is printed in it is UTF-8, wherever the person happens to be."""


class UnknownClaim(HeavyTopError, ValueError):
    """A name that is neither a claim nor a script; the message gives the nearest."""

    exit = Exit.USAGE


def validate(
    names: Sequence[str] = (),
    *,
    proofs: bool = False,
    jobs: int = 2,
    progress: Callable[[float], None] | None = None,
    note: Callable[[str], None] | None = None,
    register: Register | None = None,
) -> Validation:
    """What is claimed of the package, measured and held to its bounds.

    Each script of claims runs in a group of processes of its own, which does not outlive this one,
    however it ends; only what leaves for a session of its own may. None of the claims of a script
    holds that ends otherwise than by code 0 or 5, that is not done in its time (two minutes; two
    hours for those of `proofs`). What an interrupt leaves is nothing: scripts are asked to end, and
    after two seconds killed.

    Parameters
    ----------
    names : sequence of str
        Claims, or scripts without their ending; all registered claims when empty.
    proofs : bool
        Whether every other validation script is run as well.
    jobs : int
        Scripts at a time. Those of `proofs` have clocks to read, and run one at a time.
    progress : callable, optional
        It is told the part of the scripts that has ended, from 0 to 1.
    note : callable, optional
        It is told, in a line, of each script that begins or ends.
    register : Register, optional
        By default that of the package.

    Returns
    -------
    Validation
        In the order of the register, whatever the order of `names`.

    Raises
    ------
    UnknownClaim
        A name that is neither a claim nor a script.
    WrongType
        `names` is a single text, or no sequence.
    ValueError
        ``jobs`` < 1.
    ForeignFile
        The register is damaged, or has no claims.
    HeavyTopError
        The package was installed without its claims.

    Examples
    --------
    >>> import heavytop as ht
    >>> found = ht.validate(["betsch-cone"])
    >>> found.counts, found.failed
    ({'passed': 1, 'failed': 0, 'skipped': 0}, ())
    """
    if jobs < 1:
        raise ValueError(f"jobs = {jobs}: at least 1")
    known = register or load_register()
    asked = _asked(names, known)
    tell, show = note or (lambda _: None), progress or (lambda _: None)
    claims = _scripts(known, asked, proofs=proofs)
    if not claims:
        raise ForeignFile(f"{known.folder / NAME}: no claims")
    found: dict[str, tuple[Row, ...]] = {}

    # What a script that is killed leaves in the folder for what is temporary goes with ours; what
    # dies may still write in it.
    with TemporaryDirectory(prefix="heavytop-", ignore_cleanup_errors=True) as place:
        folder = _runnable(known.folder, Path(place))

        def started(name: str) -> _Script:
            tell(f"running {name}")
            return _Script(folder / name, claims[name], Path(place))

        def ended(script: _Script) -> None:
            results = found[script.path.name] = _verdicts(script)
            said = ", ".join(f"{n} {word}" for word, n in counts(results).items() if n)
            tell(f"{script.path.name}: {said} in {time.monotonic() - script.began:.1f} s")
            show(len(found) / len(claims))

        for slow, at_once in ((False, jobs), (True, 1)):
            _run([n for n in claims if (n in known.proofs) is slow], at_once, started, ended)
    return Validation(
        asked=asked,
        proofs=proofs,
        claims=tuple(each for name in claims for each in found[name]),
        versions=versions(),
    )


def _asked(names: Sequence[str], known: Register) -> tuple[str, ...]:
    """The names, if all are known; none of them twice."""
    if isinstance(names, str) or not isinstance(names, Sequence):
        raise wrong_type("names", "a list of names", names)
    for name in names:
        if name not in known.names:
            hint = nearest(name, known.names)
            shown = f"{name!r:.{LONGEST + 2}}"
            raise UnknownClaim(f"{shown} is neither a claim nor a script{hint and f'; {hint}'}")
    return tuple(dict.fromkeys(names))


def _scripts(
    known: Register, names: tuple[str, ...], *, proofs: bool
) -> dict[str, tuple[Claim, ...]]:
    """The scripts to run, with the registered claims that each is asked for."""
    found = {}
    for script, claims in known.scripts.items():
        whole = stem(script) in names or (proofs if script in known.proofs else not names)
        some = tuple(claim for claim in claims if whole or claim.id in names)
        if some or (whole and script in known.proofs):
            found[script] = some
    return found


def _runnable(folder: Path, place: Path) -> Path:
    """The folder to run scripts in: some write beside themselves, which installed ones must not."""
    if folder != PACKED:
        return folder
    copy = place / "validation"
    shutil.copytree(folder, copy, copy_function=shutil.copyfile)
    for path in (copy, *copy.rglob("*/")):
        path.chmod(0o700)  # a package may be installed read-only
    return copy


# --- running: what a script begins goes with it, unless that leaves for a session of its own -----


class _Script:
    """A script that runs, for registered claims or for its own, and how it ended."""

    def __init__(self, path: Path, claims: tuple[Claim, ...], place: Path) -> None:
        self.path, self.claims = path, claims
        self.limit = LIMIT if claims else PROOF_LIMIT
        self.folder = place / path.stem
        self.folder.mkdir()
        here = {name: value for name, value in os.environ.items() if name not in FOREIGN} | LETTERS
        here |= {TOLD: str(self.folder / "told"), OF: str(PACKAGE), "TMPDIR": str(place)}
        if claims:
            here[ASKED] = ",".join(claim.id for claim in claims)
        self.began = time.monotonic()
        self.code: int | None = None
        self.process = begin([str(path)], self.folder / "said", here, Path.cwd())

    def over(self) -> bool:
        """Whether it has ended, or has no time left; then what it began is ended too."""
        self.code = self.process.poll()
        if self.code is None and time.monotonic() - self.began < self.limit:
            return False
        end([self.process], GRACE)
        return True

    @property
    def trouble(self) -> str:
        """Why it did not come to its end; empty where it did."""
        if self.code is None:
            return f"not done in {self.limit:g} s"
        if self.code in (0, FAILED):
            return ""
        by = -self.code in list(signal.Signals)
        how = f"by {signal.Signals(-self.code).name}" if by else f"with code {self.code}"
        said = [line.strip() for line in tail(self.folder / "said", TAIL).split("\n")]
        return f"ended {how}: {next(filter(None, reversed(said)), 'it said nothing')}"

    def told(self) -> tuple[dict[str, Mapping[str, Any]], str]:
        """What it told of each claim by its name, or the number of its line; and a fault."""
        path, found, fault = self.folder / "told", {}, ""
        text = path.read_text("utf-8", "replace") if path.is_file() else ""
        for n, line in enumerate(text.splitlines(), 1):
            try:
                table = json.loads(line)
                found[str(table.get("id") or n)] = table
            except (ValueError, AttributeError):
                fault = f"line {n} of its output is not a JSON object"
        return found, fault


def _run(
    waiting: list[str],
    at_once: int,
    started: Callable[[str], _Script],
    ended: Callable[[_Script], None],
) -> None:
    """Run scripts, some at once; what still runs when this is left is ended."""
    running: list[_Script] = []
    try:
        while waiting or running:
            while waiting and len(running) < at_once:
                running.append(started(waiting.pop(0)))
            time.sleep(LOOK)
            for script in [each for each in running if each.over()]:
                running.remove(script)
                ended(script)
    finally:
        end([each.process for each in running], GRACE)


# --- verdicts: what a script measured beside what is claimed -------------------------------------


def _verdicts(script: _Script) -> tuple[Row, ...]:
    """What came of the claims of a script, registered or its own.

    Where it did not come to its end, none of them holds; what it measured is kept.
    """
    told, fault = script.told()
    trouble = script.trouble or fault
    if not (script.claims or told):
        trouble = trouble or "it claims nothing"
    if script.code == FAILED and all(line.get("passed") is not False for line in told.values()):
        trouble = trouble or f"ended with code {FAILED}, but none of its claims fails"
    if script.claims:
        return tuple(_judged(claim, told.get(claim.id), trouble) for claim in script.claims)
    own = told | ({"end": {}} if trouble else {})
    return tuple(_judged(_own(script, n, line), line or None, trouble) for n, line in own.items())


def _judged(claim: Claim, line: Mapping[str, Any] | None, trouble: str) -> Row:
    """Hold what was measured to the bound, whatever the script has made of it."""
    unknown = dict.fromkeys(("measured", "passed", "skipped", "failure"))
    row = Row(**claim.model_dump(), **unknown)
    if line is None:
        return Row(row, passed=False, failure=trouble or "nothing was measured")
    if "skipped" in line:
        if claim.needs is None or find_spec(claim.needs.partition(".")[0]) is not None:
            trouble = "skipped, although the packages it needs are installed"
        if not trouble:
            return Row(row, skipped=str(line["skipped"]))
        return Row(row, passed=False, failure=trouble)
    measured, failure = line.get("measured"), line.get("failure")
    if not isinstance(measured, float | int) or not math.isfinite(measured):
        measured, failure = None, failure or "no finite number"
    elif measured < 0 and claim.authority != OURS:  # of registered claims
        failure = failure or "negative, although it is a distance"
    failure = failure or trouble or None
    holds = measured is not None and measured <= claim.bound and failure is None
    return Row(row, measured=measured, passed=holds, failure=failure)


def _own(script: _Script, name: str, line: Mapping[str, Any]) -> Claim:
    """The claim that a script states of itself."""
    return Claim.model_construct(
        id=f"{script.path.stem}/{name}",
        statement=line.get("statement", script.path.name),
        authority=OURS,
        numbers="ours",
        bound=line.get("bound", 0.0),
        reason="as the script says",
        script=script.path.name,
        holds=(),
    )


# --- programs --------------------------------------------------------------------------------


def begin(
    words: Sequence[str], said: Path, environment: Mapping[str, str], cwd: Path
) -> subprocess.Popen[bytes]:
    """Begin what Python runs; its stderr goes to the file `said`, and its stdout is not kept."""
    with said.open("wb") as file:
        return subprocess.Popen(
            [sys.executable, *words],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=file,
            env=environment,
            cwd=cwd,
            start_new_session=True,
        )


def end(processes: Sequence[subprocess.Popen[bytes]], grace: float) -> None:
    """End processes, and what they began: first asked, and `grace` seconds later killed."""
    try:
        for each in processes:
            _send(each, signal.SIGTERM)
        until = time.monotonic() + grace
        for each in processes:
            with suppress(subprocess.TimeoutExpired):
                each.wait(max(0.0, until - time.monotonic()))
    finally:  # even where Ctrl-C is pressed twice
        for each in processes:
            _send(each, signal.SIGKILL)
            each.wait()


def tail(said: Path, most: int) -> str:
    """The end of what was said, of so many bytes."""
    with said.open("rb") as file:
        file.seek(max(0, said.stat().st_size - most))
        return file.read().decode("utf-8", "replace")


def _send(process: subprocess.Popen[bytes], number: int) -> None:
    with suppress(ProcessLookupError, PermissionError):  # the latter where all are zombies
        os.killpg(process.pid, number)
