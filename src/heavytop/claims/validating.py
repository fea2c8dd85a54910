"""Measuring claims: their scripts are run, and what they tell is set beside the register."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from heavytop.claims.register import OURS, PACKED, Claim, Register, load_register, stem
from heavytop.claims.running import Ended, Errand, run_scripts
from heavytop.claims.validation import Measured, Validation
from heavytop.names import nearest

LIMIT: Final = 120.0  # s for a script of registered claims
PROOF_LIMIT: Final = 7200.0  # s for any other: some of them time what takes minutes


class UnknownClaim(ValueError):
    """A name that is neither a claim nor a script; the message gives the nearest."""


def validate(
    names: Sequence[str] = (),
    *,
    proofs: bool = False,
    jobs: int = 2,
    progress: Callable[[float], None] | None = None,
    note: Callable[[str], None] | None = None,
    register: Register | None = None,
) -> Validation:
    """Measure claims.

    Parameters
    ----------
    names : sequence of str
        Claims, or scripts without their ending; all registered claims when empty.
    proofs : bool
        Whether every other validation script is run as well.
    jobs : int
        Scripts at a time. Those of `proofs` have clocks to read, and run one at a time.
    progress : callable, optional
        It is told the part of the scripts that has ended.
    note : callable, optional
        It is told the name of each script as it begins.
    register : Register, optional
        By default that of the package.

    Returns
    -------
    Validation

    Raises
    ------
    UnknownClaim
        A name that is neither a claim nor a script.
    HeavyTopError
        The package was installed without its claims.

    Examples
    --------
    >>> from heavytop.claims.validating import validate
    >>> validate(["betsch-cone"]).counts
    {'passed': 1, 'failed': 0, 'skipped': 0}
    """
    known = register or load_register()
    with _runnable(known) as place:
        quick, slow = _errands(known, place, tuple(names), proofs)
        told = note or (lambda _: None)
        ended = dict[str, Ended]()
        for group, at_once in ((quick, jobs), (slow, 1)):
            for one in run_scripts(group, at_once, lambda errand: told(errand.script.name)):
                ended[one.errand.script.name] = one
                if progress is not None:
                    progress(len(ended) / len(quick + slow))
    scripts = [*known.scripts, *known.proofs]
    found = (_found(known, ended[script]) for script in scripts if script in ended)
    return Validation(tuple(each for group in found for each in group), proofs)


@contextmanager
def _runnable(known: Register) -> Iterator[Path]:
    """The folder to run scripts in: some write beside themselves, which installed ones must not."""
    if known.folder != PACKED:
        yield known.folder
        return
    with TemporaryDirectory(prefix="heavytop-validation-") as place:
        copy = Path(place) / "validation"
        shutil.copytree(known.folder, copy)
        yield copy


def _errands(
    known: Register, place: Path, names: tuple[str, ...], proofs: bool
) -> tuple[list[Errand], list[Errand]]:
    for name in names:
        if name not in known.names:
            raise UnknownClaim(f"{name!r} is no claim and no script{_hint(name, known.names)}")
    quick = []
    for script, claims in known.scripts.items():
        whole = not names or stem(script) in names
        asked = tuple(claim.id for claim in claims if whole or claim.id in names)
        if asked:
            quick.append(Errand(place / script, asked, LIMIT))
    slow = (script for script in known.proofs if proofs or stem(script) in names)
    return quick, [Errand(place / script, None, PROOF_LIMIT) for script in slow]


def _hint(name: str, names: Sequence[str]) -> str:
    near = nearest(name, names)
    return f"; {near}" if near else ""


def _found(known: Register, ended: Ended) -> Iterator[Measured]:
    script = ended.errand.script.name
    if script in known.proofs:
        return _proved(script, known.proofs[script], ended)
    return _held(known.scripts[script], ended)


def _held(claims: tuple[Claim, ...], ended: Ended) -> Iterator[Measured]:
    """Set what was told beside what is claimed; a claim that was not told of does not hold."""
    told = {each.get("id"): each for each in ended.told}
    for claim in claims:
        if claim.id not in (ended.errand.asked or ()):
            continue
        each = told.get(claim.id)
        if each is None:
            yield Measured(claim, passed=False, failure=ended.trouble or "nothing was measured")
        elif "skipped" in each:
            yield Measured(claim, skipped=each["skipped"])
        else:
            yield _judged(claim, each.get("measured"), each.get("failure"))


def _judged(claim: Claim, measured: float | None, failure: str | None) -> Measured:
    """Hold a number to the bound once more: a script does not judge itself."""
    holds = measured is not None and measured <= claim.bound
    why = None if measured is not None else failure or "no number"
    return Measured(claim, measured, holds, failure=why)


def _proved(script: str, about: str, ended: Ended) -> Iterator[Measured]:
    """What a script that states its own claims told, and whether it came to its end."""
    blank = Claim("", about, OURS, 0.0, "as the script says", script, ())
    for n, each in enumerate(ended.told, 1):
        name = f"{stem(script)}/{n}"
        claim = replace(blank, id=name, statement=each["statement"], bound=each["bound"])
        yield _judged(claim, each["measured"], "no finite number")
    if ended.trouble or not ended.told:
        claim = replace(blank, id=f"{stem(script)}/end")
        yield Measured(claim, passed=False, failure=ended.trouble or "it claims nothing")
