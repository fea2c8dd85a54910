"""Measuring claims: their scripts are run, and what they measure is held to the register."""

from __future__ import annotations

import json
import math
import shutil
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from heavytop.claims.register import NAME, OURS, PACKED, Claim, Register, load_register, stem
from heavytop.claims.running import Ended, Script, run_scripts
from heavytop.errors import ForeignFile, HeavyTopError
from heavytop.machine import versions
from heavytop.names import LONGEST, nearest
from heavytop.scene.arguments import wrong_type

SCHEMA: Final = "heavytop/validate/1"
LIMIT: Final = 120.0  # s for a script of registered claims
PROOF_LIMIT: Final = 7200.0  # s for any other: some of them time what takes minutes
UNTOLD: Final = "nothing was measured"
FAILED: Final = 5  # the code of a script one of whose claims does not hold


class UnknownClaim(HeavyTopError, ValueError):
    """A name that is neither a claim nor a script; the message gives the nearest."""


@dataclass(frozen=True, slots=True)
class Measured:
    """One claim, and what came of it.

    Parameters
    ----------
    claim : Claim
    measured : float, optional
        None where it was skipped, and where nothing came out.
    passed : bool, optional
        None where it was skipped.
    skipped : str, optional
        Why, where it was.
    failure : str, optional
        What went wrong, where that is not a number beyond its bound; a number that was measured
        before it did is kept.
    """

    claim: Claim
    measured: float | None = None
    passed: bool | None = None
    skipped: str | None = None
    failure: str | None = None

    @property
    def row(self) -> dict[str, Any]:
        """The claim as a table of the document."""
        names = ("measured", "passed", "skipped", "failure")
        return self.claim.model_dump(mode="json") | {name: getattr(self, name) for name in names}


@dataclass(frozen=True, slots=True)
class Validation:
    """The claims that were looked at.

    Parameters
    ----------
    results : tuple of Measured
        In the order of the register.
    proofs : bool
        Whether every script was asked for.
    asked : tuple of str
        The names that were asked for; none where all registered claims were.
    """

    results: tuple[Measured, ...]
    proofs: bool = False
    asked: tuple[str, ...] = ()

    @property
    def failed(self) -> tuple[Measured, ...]:
        """What does not hold."""
        return tuple(each for each in self.results if each.passed is False)

    @property
    def counts(self) -> dict[str, int]:
        """How many hold, do not hold, and were skipped."""
        return _counts(self.results)

    def document(self, files: Mapping[str, str] | None = None) -> dict[str, Any]:
        """The document of the schema ``heavytop/validate/1``.

        Parameters
        ----------
        files : mapping, optional
            Names of the files that were written, by what they are.
        """
        return {
            "schema": SCHEMA,
            "asked": list(self.asked),
            "proofs": self.proofs,
            "counts": self.counts,
            "authorities": len({each.claim.authority for each in self.results} - {OURS}),
            "claims": [each.row for each in self.results],
            "files": dict(files or {}),
            "versions": versions(),
        }


def _counts(results: Sequence[Measured]) -> dict[str, int]:
    found = Counter(each.passed for each in results)
    return {"passed": found[True], "failed": found[False], "skipped": found[None]}


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
    hours for those of `proofs`), or that tells of claims that are not its own. What an interrupt
    leaves is nothing: scripts are asked to end, and after two seconds killed.

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
    found: dict[str, tuple[Measured, ...]] = {}
    with _runnable(known) as place:
        quick, slow = _registered(known, place, asked), _others(known, place, asked, proofs)
        if not (quick or slow):
            raise ForeignFile(f"{known.folder / NAME}: no claims")
        for scripts, at_once in ((quick, jobs), (slow, 1)):
            with closing(run_scripts(scripts, at_once, tell)) as running:
                for ended in running:
                    results = verdicts(ended, known.proofs)
                    said = ", ".join(f"{n} {word}" for word, n in _counts(results).items() if n)
                    tell(f"{ended.script.path.name}: {said} in {ended.seconds:.1f} s")
                    found[ended.script.path.name] = results
                    show(len(found) / len((*quick, *slow)))
    order = (*known.scripts, *known.proofs)
    results = tuple(each for script in order for each in found.get(script, ()))
    return Validation(results, proofs, asked)


def _asked(names: Sequence[str], known: Register) -> tuple[str, ...]:
    """The names, if all are known; none of them twice."""
    if isinstance(names, str) or not isinstance(names, Sequence):
        raise wrong_type("names", "a list of names", names)
    for name in names:
        if name not in known.names:
            hint = nearest(name, known.names)
            shown = f"{name!r:.{LONGEST + 2}}"
            raise UnknownClaim(f"{shown} is no claim and no script{hint and f'; {hint}'}")
    return tuple(dict.fromkeys(names))


@contextmanager
def _runnable(known: Register) -> Iterator[Path]:
    """The folder to run scripts in: some write beside themselves, which installed ones must not."""
    if known.folder != PACKED:
        yield known.folder
        return
    with TemporaryDirectory(prefix="heavytop-", ignore_cleanup_errors=True) as place:
        copy = Path(place) / "validation"
        shutil.copytree(known.folder, copy, copy_function=shutil.copyfile)
        for path in (copy, *copy.rglob("*/")):
            path.chmod(0o700)  # a package may be installed read-only
        yield copy


def _registered(known: Register, place: Path, names: tuple[str, ...]) -> list[Script]:
    """The scripts of the registered claims that are asked for."""
    found = []
    for script, claims in known.scripts.items():
        whole = not names or stem(script) in names
        if asked := tuple(claim for claim in claims if whole or claim.id in names):
            found.append(Script(place / script, asked, LIMIT))
    return found


def _others(known: Register, place: Path, names: tuple[str, ...], proofs: bool) -> list[Script]:
    """The scripts that state their own claims, where they are asked for."""
    asked = (script for script in known.proofs if proofs or stem(script) in names)
    return [Script(place / script, (), PROOF_LIMIT) for script in asked]


# --- verdicts: what a script measured beside what is claimed; no script judges itself ------------


def verdicts(ended: Ended, about: Mapping[str, str]) -> tuple[Measured, ...]:
    """What came of the claims of one script.

    Where the script did not come to its end, or told what is not its own, none of its claims
    holds; what it measured is kept. `about` says what the scripts are about that have none.
    """
    name = ended.script.path.name
    told, trouble = _told(ended.told)
    if ended.script.claims:
        found = [_judged(claim, told.pop(claim.id, None)) for claim in ended.script.claims]
        strange = f"it told of {next(iter(told))}, which it was not asked for" if told else ""
    else:
        found = [_judged(_own(name, about[name], n, line), line) for n, line in told.items()]
        strange = "" if told else "it claims nothing"
    trouble = ended.trouble or trouble or strange
    if not trouble and ended.code == FAILED and all(each.passed is not False for each in found):
        trouble = f"ended with code {FAILED}, but nothing that it told fails"
    if not trouble:
        return tuple(found)
    if not ended.script.claims:
        found.append(Measured(_own(name, about[name], "end", {})))
    return tuple(
        replace(each, passed=False, skipped=None, failure=_why(each, trouble)) for each in found
    )


def _why(each: Measured, trouble: str) -> str:
    """Its own reason why a claim does not hold, else that of its script."""
    return trouble if each.failure in (None, UNTOLD) else each.failure


def _told(text: str) -> tuple[dict[str, Mapping[str, Any]], str]:
    """The lines of what a script told by the claim's name, or by their number, and a fault."""
    found: dict[str, Mapping[str, Any]] = {}
    for n, line in enumerate(text.splitlines(), 1):
        try:
            table = json.loads(line)
            name = str(table.get("id") or n)
        except (ValueError, AttributeError):
            return found, f"line {n} of what it told is no JSON object"
        if name in found:
            return found, f"it told of {name} twice"
        found[name] = table
    return found, ""


def _judged(claim: Claim, line: Mapping[str, Any] | None) -> Measured:
    """Hold what was measured to the bound, whatever the script has made of it."""
    if line is None:
        return Measured(claim, passed=False, failure=UNTOLD)
    if "skipped" in line:
        if claim.needs is None or find_spec(claim.needs.partition(".")[0]) is not None:
            why = "skipped, but what it needs is there"
            return Measured(claim, passed=False, failure=why)
        return Measured(claim, skipped=str(line["skipped"]))
    measured, failure = line.get("measured"), line.get("failure")
    if not isinstance(measured, float | int) or not math.isfinite(measured):
        return Measured(claim, passed=False, failure=failure or "no finite number")
    signed = measured < 0 and claim.authority != OURS  # of registered claims: no distance is
    failure = failure or ("negative, as no distance is" if signed else None)
    return Measured(claim, measured, measured <= claim.bound and not failure, failure=failure)


def _own(script: str, about: str, name: str, line: Mapping[str, Any]) -> Claim:
    """The claim that a script states of itself."""
    bound = line.get("bound")
    return Claim.model_construct(
        id=f"{stem(script)}/{name}", statement=line.get("statement", about), authority=OURS,
        numbers="ours", bound=0.0 if bound is None else bound, reason="as the script says",
        script=script, holds=(), needs=None,
    )  # fmt: skip
