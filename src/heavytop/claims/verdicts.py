"""Verdicts: what scripts told, set beside what is claimed; no script judges itself."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from importlib.util import find_spec
from typing import Final

from heavytop.claims.claim import OURS, Claim
from heavytop.claims.register import Register, stem
from heavytop.claims.running import Ended
from heavytop.claims.told import Table, number, tables, words
from heavytop.claims.validation import Measured

FAILED: Final = 5  # the code of a script one of whose claims does not hold
UNTOLD: Final = "nothing was measured"


def verdicts(known: Register, ended: Ended) -> tuple[Measured, ...]:
    """What came of the claims of one script.

    Parameters
    ----------
    known : Register
    ended : Ended

    Returns
    -------
    tuple of Measured
        Where the script did not come to its end, or told what it should not, none of its claims
        holds; what it measured is kept.
    """
    told, garbled = tables(ended.told)
    script = ended.errand.script.name
    asked = ended.errand.asked
    if asked is None:
        found = list(_proved(script, known.proofs[script], told))
        strange = "" if told else "it claims nothing"
    else:
        found = [_held(claim, told) for claim in known.scripts[script] if claim.id in asked]
        strange = next((_unasked(each) for each in told if each.get("id") not in asked), "")
    trouble = words(ended.trouble) or garbled or strange or _contradiction(ended, found)
    if trouble and asked is None:
        found.append(Measured(_blank(script, known.proofs[script], "end")))
    return tuple(_spoilt(each, trouble) for each in found) if trouble else tuple(found)


def _unasked(table: Table) -> str:
    return f"it told of {words(table.get('id'), 60)}, which it was not asked for"


def _contradiction(ended: Ended, found: Sequence[Measured]) -> str:
    if ended.code != FAILED or any(each.passed is False for each in found):
        return ""
    return f"ended with code {FAILED}, but nothing that it told fails"


def _spoilt(each: Measured, trouble: str) -> Measured:
    why = trouble if each.failure in (None, UNTOLD) else each.failure
    return replace(each, passed=False, skipped=None, failure=why)


def _held(claim: Claim, told: Sequence[Table]) -> Measured:
    lines = [each for each in told if each.get("id") == claim.id]
    if not lines:
        return Measured(claim, passed=False, failure=UNTOLD)
    if len(lines) > 1:
        return Measured(claim, passed=False, failure=f"told {len(lines)} times")
    return _skipped(claim, lines[0]) if "skipped" in lines[0] else _signed(_judged(claim, lines[0]))


def _signed(each: Measured) -> Measured:
    """Let no difference hold because it is negative: registered claims are of distances."""
    if each.measured is None or each.measured >= 0:
        return each
    return replace(each, passed=False, failure=each.failure or "negative, as no distance is")


def _judged(claim: Claim, line: Table) -> Measured:
    """Hold a number to the bound once more, whatever the script has made of it."""
    measured = number(line.get("measured"))
    if measured is not None and line.get("failure") is None:
        return Measured(claim, measured, measured <= claim.bound)
    why = line.get("failure") or _no_number(line.get("measured"))
    return Measured(claim, measured, passed=False, failure=words(why))


def _no_number(value: object) -> str:
    return "no finite number" if value is None else f"{words(value, 40)}: no finite number"


def _skipped(claim: Claim, line: Table) -> Measured:
    """Let only that be skipped which needs a package, and only where this is not there."""
    if claim.needs is None:
        return Measured(claim, passed=False, failure="skipped, but it needs no package")
    if find_spec(claim.needs.partition(".")[0]) is not None:
        return Measured(claim, passed=False, failure=f"skipped, but {claim.needs} is installed")
    return Measured(claim, skipped=words(line["skipped"]))


def _proved(script: str, about: str, told: Sequence[Table]) -> Iterator[Measured]:
    """What a script that states its own claims told."""
    for n, line in enumerate(told, 1):
        blank = _blank(script, about, str(n))
        bound = number(line.get("bound"))
        claim = replace(blank, statement=words(line.get("statement", about)), bound=bound or 0.0)
        if "skipped" in line or bound is None:
            yield Measured(claim, passed=False, failure="skipped, or without a bound")
        else:
            yield _judged(claim, line)


def _blank(script: str, about: str, name: str) -> Claim:
    reason = "as the script says"
    return Claim(f"{stem(script)}/{name}", about, OURS, "ours", 0.0, reason, script, ())
