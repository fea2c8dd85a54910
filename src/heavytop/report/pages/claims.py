"""The claims on the page: what was measured against what is bound, and on whose authority."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from heavytop.errors import ForeignFile
from heavytop.report.pages.commands import command, folder
from heavytop.report.pages.section import Section
from heavytop.report.pages.tables import Table
from heavytop.spelling import harmless

if TYPE_CHECKING:
    from collections.abc import Mapping

    from heavytop.report.pages.findings import Finding

WHOSE: Final = {
    "printed": "printed by the authority",
    "program": "its own program",
    "formula": "its formula",
    "ours": "its equations, integrated by us",
}


def verdicts(hold: int, fail: int, skipped: int) -> str:
    """How many claims hold, fail and were skipped.

    Examples
    --------
    >>> verdicts(82, 0, 3)
    '82 hold, none fails, 3 skipped'
    """
    words = [f"{hold} {'holds' if hold == 1 else 'hold'}"]
    words.append(f"{fail or 'none'} {'fails' if fail < 2 else 'fail'}")
    return ", ".join([*words, f"{skipped} skipped"] if skipped else words)


def claims_section(finding: Finding, ident: str) -> Section:
    """Return the section of a validation: all claims, those that fail first."""
    claims = sorted(finding.document["claims"], key=lambda each: each["passed"] is not False)
    words = [_verdict(each) for each in claims]
    counts = [words.count(word) for word in ("hold", "FAIL", "skipped")]
    return Section(
        ident=ident,
        heading="Claims",
        words=verdicts(*counts),
        table=Table.of(
            {
                "verdict": [
                    f"skipped: {each['skipped']}" if word == "skipped" else word
                    for each, word in zip(claims, words, strict=True)
                ],
                "claim": [each["id"] for each in claims],
                "statement": [each["statement"] for each in claims],
                "authority": [each["authority"] for each in claims],
                "whose numbers": [_whose(each.get("numbers")) for each in claims],
                "measured": [each["measured"] for each in claims],
                "bound": [each["bound"] for each in claims],
            },
            most=2000,
        ),
        command=_command(finding, ident),
        parted="authority",
    )


def _command(finding: Finding, ident: str) -> str:
    """What measures these claims again; documents of old do not say which were asked for."""
    asked = finding.document.get("asked") or ()
    if option := next((name for name in asked if name.startswith("-")), None):
        raise ForeignFile(f"{harmless(finding.path)}: asked: {option!r:.60}: no name of a claim")
    proofs = ["--proofs"] if finding.document.get("proofs") else []
    return command("validate", *asked, *proofs, *folder(ident))


def _whose(numbers: str | None) -> str | None:
    return None if numbers is None else WHOSE.get(numbers, numbers)


def _verdict(claim: Mapping[str, Any]) -> str:
    return "skipped" if claim["passed"] is None else "hold" if claim["passed"] else "FAIL"
