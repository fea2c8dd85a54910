"""Measuring claims: their scripts are run, and what they tell is set beside the register."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from heavytop.claims.register import NAME, PACKED, Register, load_register, stem
from heavytop.claims.running import Ended, Errand, run_scripts
from heavytop.claims.validation import Measured, Validation, counts
from heavytop.claims.verdicts import verdicts
from heavytop.errors import ForeignFile, HeavyTopError
from heavytop.names import LONGEST, nearest
from heavytop.scene.arguments import wrong_type

LIMIT: Final = 120.0  # s for a script of registered claims
PROOF_LIMIT: Final = 7200.0  # s for any other: some of them time what takes minutes


class UnknownClaim(HeavyTopError, ValueError):
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
    """What is claimed of the package, measured and held to its bounds.

    Each script of claims runs in a group of processes of its own, which does not outlive this one,
    however it ends; only what leaves for a session of its own may. None of the claims of a script
    holds that ends otherwise than by code 0 or 5, that is not done in its time (two minutes; two
    hours for those of `proofs`), or that tells what it was not asked for, or more than 1 MB. What
    an interrupt leaves is nothing: scripts are asked to end, and after two seconds killed.

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
    found = dict[str, tuple[Measured, ...]]()
    with _runnable(known) as place:
        groups = _errands(known, place, asked, proofs)
        if not any(groups):
            raise ForeignFile(f"{known.folder / NAME}: no claims")
        with closing(_run(groups, (jobs, 1), note or (lambda _: None))) as running:
            for ended in running:
                found[ended.errand.script.name] = verdicts(known, ended)
                if note is not None:
                    note(_sentence(ended, found[ended.errand.script.name]))
                if progress is not None:
                    progress(len(found) / sum(map(len, groups)))
    scripts = [*known.scripts, *known.proofs]
    results = tuple(each for script in scripts for each in found.get(script, ()))
    return Validation(results, proofs, asked)


Groups = tuple[list[Errand], list[Errand]]


def _asked(names: Sequence[str], known: Register) -> tuple[str, ...]:
    if isinstance(names, str) or not isinstance(names, Sequence):
        raise wrong_type("names", "a list of names", names)
    for name in names:
        if name not in known.names:
            shown = f"{name!r:.{LONGEST + 2}}"
            raise UnknownClaim(f"{shown} is no claim and no script{_hint(name, known.names)}")
    return tuple(dict.fromkeys(names))


def _hint(name: str, names: Sequence[str]) -> str:
    near = nearest(name, names)
    return f"; {near}" if near else ""


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


def _errands(known: Register, place: Path, names: tuple[str, ...], proofs: bool) -> Groups:
    """What there is to run: some at a time, and one at a time."""
    quick = []
    for script, claims in known.scripts.items():
        whole = not names or stem(script) in names
        asked = tuple(claim.id for claim in claims if whole or claim.id in names)
        if asked:
            quick.append(Errand(place / script, asked, LIMIT))
    slow = (script for script in known.proofs if proofs or stem(script) in names)
    return quick, [Errand(place / script, None, PROOF_LIMIT) for script in slow]


def _run(groups: Groups, jobs: tuple[int, int], note: Callable[[str], None]) -> Generator[Ended]:
    for group, at_once in zip(groups, jobs, strict=True):
        yield from run_scripts(group, at_once, lambda one: note(f"running {one.script.name}"))


def _sentence(ended: Ended, found: Sequence[Measured]) -> str:
    said = ", ".join(f"{many} {word}" for word, many in counts(found).items() if many)
    return f"{ended.errand.script.name}: {said} in {ended.seconds:.1f} s"
