"""The claims on the page: what was measured against what is bound, and on whose authority."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from heavytop.pages.commands import command
from heavytop.pages.section import Section, Table

if TYPE_CHECKING:
    from collections.abc import Mapping

    from heavytop.pages.findings import Finding


def claims_section(finding: Finding, ident: str) -> Section:
    """Return the section of a validation: all claims, those that fail first."""
    claims = sorted(finding.document["claims"], key=lambda each: each["passed"] is not False)
    words = [_verdict(each) for each in claims]
    return Section(
        ident=ident,
        heading="Claims",
        words=", ".join(f"{words.count(word)} {word}" for word in ("hold", "FAIL", "skipped")),
        table=Table.of(
            {
                "verdict": [
                    f"skipped: {each['skipped']}" if each["skipped"] else word
                    for each, word in zip(claims, words, strict=True)
                ],
                "claim": [each["id"] for each in claims],
                "statement": [each["statement"] for each in claims],
                "authority": [each["authority"] for each in claims],
                "measured": [each["measured"] for each in claims],
                "bound": [each["bound"] for each in claims],
            },
            most=2000,
        ),
        command=command("validate", "-o", "out"),
    )


def _verdict(claim: Mapping[str, Any]) -> str:
    return "skipped" if claim["passed"] is None else "hold" if claim["passed"] else "FAIL"
