"""Claims: measured errors of the package with their bounds and authorities, and their study.

A claim is a function under `claim` in a numbered script of ``validation/``, which registers it. A
`proof` measures several numbers at once, and states their bounds itself.
"""

from __future__ import annotations

import math
import os
import re
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass, replace
from hashlib import sha256
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeVar

from heavytop.doctor import versions
from heavytop.errors import HeavyTopError, refuse
from heavytop.results.table import Row
from heavytop.results.validation import THIS_PROJECT, Validation
from heavytop.scene import arguments
from heavytop.studies.journal import Chunk, Journal, Parameters
from heavytop.studies.study import Progress, run
from heavytop.studies.workers import TIMED_WORKER, Processes, TimedOut, WorkerLost
from heavytop.text import in_a_line

KIND: Final = "claims"
PACKAGE: Final = Path(__file__).parent
SCRIPTS_FOLDER: Final = next(
    filter(Path.is_dir, (PACKAGE / "_validation", PACKAGE.parents[1] / "validation")), PACKAGE
)
"""The folder of the scripts: inside the package in a wheel, beside ``src`` in a checkout."""

Measure = TypeVar("Measure", bound=Callable[..., Any])


class Authority(NamedTuple):
    """The authority for a claim, outside this project.

    Attributes
    ----------
    name : str
    numbers : str
        The source of the numbers that the package is compared with: ``printed`` by the authority;
        of its ``program``, run here; of its ``formula``, evaluated here; or ``ours``: its
        equations, integrated by code of this project that shares nothing with the package.
    """

    name: str
    numbers: str


OURSELVES: Final = Authority(THIS_PROJECT, "ours")


@dataclass(frozen=True)
class Claim:
    """The claim that the number that `measure` returns is at most `bound`.

    Attributes
    ----------
    id : str
    measure : callable
        Called with `of`, it returns a distance or a count; that of a proof yields several claims,
        each as statement, number and bound.
    statement : str
        The measured quantity, with its unit.
    authority : Authority
    bound : float
    reason : str
        The reason for this bound.
    holds : tuple of str
        The parts of the package that are compared with the authority.
    needs : str or None
        A package that may be missing.
    of : tuple
    is_proof : bool
    limit_s : float
        The longest time that it may take [s].
    """

    id: str
    measure: Callable[..., Any]
    statement: str
    authority: Authority = OURSELVES
    bound: float = 0.0
    reason: str = "as the script says"
    holds: tuple[str, ...] = ()
    needs: str | None = None
    of: tuple[Any, ...] = ()
    is_proof: bool = False
    limit_s: float = 120.0

    @property
    def script(self) -> str:
        """The name of its script, without the ending."""
        return Path(self.measure.__code__.co_filename).stem

    def rows(self, **given: Any) -> Iterator[Row]:
        """Measure the claim; yield its row, or those of a proof."""
        found = self.measure(*self.of, **given)
        if self.is_proof:
            for number, (statement, measured, bound) in enumerate(found, 1):
                about = {"id": f"{self.id}/{number}", "statement": statement, "bound": float(bound)}
                yield replace(self, **about).judge(float(measured))
        else:
            yield self.judge(float(found))

    def judge(
        self, measured: float | None = None, failure: str | None = None, skipped: str | None = None
    ) -> Row:
        """Compare a measured number with the bound; return the row with the verdict."""
        if measured is not None and not math.isfinite(measured):
            measured, failure = None, "no finite number"
        elif measured is not None and measured < 0 and self.authority.name != THIS_PROJECT:
            failure = "negative, although it is a distance"
        holds = failure is None and measured is not None and measured <= self.bound
        row = Row({name: getattr(self, name) for name in CLAIM_FIELDS}, script=f"{self.script}.py")
        row |= {"authority": self.authority.name, "numbers": self.authority.numbers}
        passed = None if skipped else holds
        return Row(row, measured=measured, passed=passed, skipped=skipped, failure=failure)


CLAIM_FIELDS: Final = ("id", "statement", "bound", "reason", "holds", "needs")
CLAIMS: Final[dict[str, Claim]] = {}
"""All loaded claims, by script and name."""


def claim(
    authority: Authority, bound: float, reason: str, *holds: str, name: str = "", **given: Any
) -> Callable[[Measure], Measure]:
    """Claim that what a function returns is at most a bound.

    The first paragraph of its docstring is the statement: what is measured, with its unit, where
    ``{0}`` stands for the first of `of`. A function may be under several of these.

    Parameters
    ----------
    name : str, optional
        Its id; by default that of the function, with hyphens, and points between digits.
    authority, bound, reason, holds
        As for `Claim`, of which `given` has ``needs`` and ``of``.
    """

    def add(measure: Measure) -> Measure:
        paragraph = " ".join((measure.__doc__ or "").partition("\n\n")[0].split())
        statement = paragraph.removesuffix(".").format(*given.get("of", ()))
        key = name or re.sub(r"(?<=\d)_(?=\d)", ".", measure.__name__).replace("_", "-")
        register(Claim(key, measure, statement, authority, float(bound), reason, holds, **given))
        return measure

    return add


def proof(measure: Measure) -> Measure:
    """Register a generator of claims: it yields a statement, a number and its bound for each."""
    name = measure.__name__
    register(Claim(name, measure, name, is_proof=True, limit_s=7200.0))
    return measure


def register(new: Claim) -> None:
    """Add a claim to `CLAIMS`."""
    task = f"{new.script}/{new.id}"
    if task in CLAIMS:
        raise ValueError(f"{task}: the name of two claims")
    CLAIMS[task] = replace(new, id=task) if new.is_proof else new


def load_claims(folder: str | None = None, script: str = "[0-9]*") -> dict[str, Claim]:
    """Return the claims of the scripts of a folder, by script and name; nothing is measured.

    Parameters
    ----------
    folder : str, optional
        By default that of the package.
    script : str
        The name of one, without its ending.

    Raises
    ------
    HeavyTopError
        There are none: the package was installed without its scripts.

    Examples
    --------
    >>> load_claims()["35_steady/betsch-cone"].reason
    'both are exact; the claim tests how the scene is read'
    """
    place = Path(folder or SCRIPTS_FOLDER)
    scripts = sorted(each.stem for each in place.glob(f"{script}.py"))
    if not scripts:
        raise HeavyTopError(f"{place}: no claims: installed without their scripts")
    sys.path.insert(0, str(place))  # for what the scripts share
    try:
        for name in scripts:
            import_module(name)
    finally:
        sys.path.remove(str(place))
    return {name: each for name, each in CLAIMS.items() if each.script in scripts}


# --- the study -------------------------------------------------------------------------------


def validate(
    names: Sequence[str] = (),
    *,
    proofs: bool = False,
    jobs: int = 2,
    folder: str | os.PathLike[str] | None = None,
    scripts: str | os.PathLike[str] | None = None,
    progress: Callable[[Progress], object] | None = None,
) -> Validation:
    """Measure the package's claims against outside authorities.

    Claims are measured in processes that end with this one. A claim does not hold where that takes
    more than two minutes (two hours for those of `proofs`), fails, or gives no finite number.

    Parameters
    ----------
    names : sequence of str
        Claims or scripts, such as betsch-cone 39_flint; default: all claims.
    proofs : bool
        Whether all that scripts claim on their own authority is measured as well. Some of it is
        timed, and so all is done by one process.
    jobs : int
        Processes; results do not depend on it.
    folder : path, optional
        Where everything is stored, so that what was killed goes on from there. It is new, or empty,
        or holds this study.
    scripts : path, optional
        A folder with other scripts than those of the package.
    progress : callable, optional
        It is given a `heavytop.studies.study.Progress` again and again.

    Returns
    -------
    Validation
        In the order of the scripts, whatever the order of `names`.

    Raises
    ------
    BadScene
        A name that is neither a claim nor a script; every such name is listed.
    ForeignFile
        The folder holds something else, another study, or what was measured of other code.
    InUse
        Another process is writing the folder.
    StoppedEarly
        Ctrl-C; a full disk. What was measured is in the folder.
    HeavyTopError
        The package was installed without its claims.

    Examples
    --------
    >>> import heavytop as ht
    >>> found = ht.validate(["betsch-cone"])
    >>> found.counts, found.failed
    ({'passed': 1, 'failed': 0, 'skipped': 0}, ())
    """
    arguments.check_callable("progress", progress)
    place = None if scripts is None else str(arguments.path_of("scripts", scripts).resolve())
    every = load_claims(place)
    known = {name: name for each in every.values() for name in (each.id, each.script)}
    arguments.expect("proofs", proofs, bool)
    _, wrong = arguments.parse_options(KIND, {"jobs": jobs}, {"jobs": arguments.JOBS})
    asked, faults = arguments.parse_names(KIND, "names", names, arguments.one_of(known))
    refuse(wrong, faults * (names not in ((), [])))

    def wanted(each: Claim) -> bool:
        by_name = each.id in asked or each.script in asked
        return by_name or (proofs if each.is_proof else not asked)

    parameters = {
        "kind": KIND, "asked": [*dict.fromkeys(asked)], "proofs": proofs,
        "claims": [name for name, each in every.items() if wanted(each)], "scripts": place,
        "code": _code_digest(place), "versions": versions(),
    }  # fmt: skip
    with Journal.open(folder, parameters) as journal:
        return complete(journal, jobs=jobs, on_progress=progress)


def _code_digest(scripts: str | None) -> str:
    """A digest of the code of package and scripts: both may have changed since a kill."""
    files = sorted([*PACKAGE.rglob("*.py"), *Path(scripts or SCRIPTS_FOLDER).glob("*.py")])
    return sha256(b"".join(file.read_bytes() for file in files)).hexdigest()[:16]


def _claims(parameters: Parameters) -> dict[str, Claim]:
    """The claims of a study, by name."""
    every = load_claims(parameters["scripts"])
    return {name: every[name] for name in parameters["claims"]}


def tasks(parameters: Parameters) -> list[str]:
    """Return the names of the claims that can be measured here."""
    chosen = _claims(parameters).items()
    return [name for name, each in chosen if not each.needs or find_spec(each.needs)]


def advance(parameters: Parameters, task: str, _checkpoint: object) -> Iterator[Chunk]:
    """Measure one claim, in a process that can be killed; each proof gets a new process."""
    scripts = parameters["scripts"]
    chosen = load_claims(scripts, task.partition("/")[0])[task]
    if chosen.is_proof:
        TIMED_WORKER.close()
    began = time.monotonic()
    try:
        rows = TIMED_WORKER.call(measure_task, scripts, task, timeout=chosen.limit_s)
    except (TimedOut, WorkerLost) as fault:
        rows = [chosen.judge(failure=str(fault))]
    yield Chunk(rows=rows, done=True, seconds=time.monotonic() - began)


def measure_task(scripts: str | None, task: str) -> list[Row]:
    """Measure a claim; after an exception it does not hold, for that reason."""
    chosen = load_claims(scripts, task.partition("/")[0])[task]
    rows: list[Row] = []
    with Path(os.devnull).open("w") as nowhere, redirect_stdout(nowhere):
        try:
            rows.extend(chosen.rows())  # those before an exception stay
        except Exception as fault:  # whatever it is
            rows.append(chosen.judge(failure=in_a_line(fault)))
    return rows or [chosen.judge(failure="it claims nothing")]


def complete(journal: Journal, *, jobs: int = 1, executor: Any = None, **how: Any) -> Validation:
    """Measure the remaining claims, and return the result.

    Raises
    ------
    ForeignFile
        The code differs from that of the claims measured before.
    """
    parameters = journal.parameters
    journal.expect({**parameters, "code": _code_digest(parameters["scripts"])})
    # Another process even for one job, so that Ctrl-C ends any claim at once.
    run(journal, executor=executor or Processes(1 if parameters["proofs"] else jobs), **how)
    found: list[Any] = []
    for name, each in _claims(parameters).items():
        skipped = f"needs {each.needs}: pip install {each.needs}"
        found += journal.rows(name) if journal.record(name).ended else [each.judge(skipped=skipped)]
    asked = {name: parameters[name] for name in ("asked", "proofs")}
    return Validation(**asked, claims=tuple(found), versions=versions())
