"""The table of claims in docs/validation.md, from a document that `heavytop validate --json` made.

heavytop validate --json | python validation/claims_page.py
"""

import json
import sys

from page import rewrite

SKIPPED = "skipped"


def row(claim):
    measured = SKIPPED if claim["measured"] is None else f"{claim['measured']:.1e}"
    bound = f"{claim['bound']:.2g}" if claim["bound"] else "0"
    holds = ", ".join(claim["holds"])
    statement = claim["statement"].replace("|", "\\|")
    numbers = claim["numbers"]
    return f"| `{claim['id']}` | {statement} | {holds} | {numbers} | {measured} | {bound} |"


def table(document):
    """A heading and a table for each authority."""
    claims = document["claims"]
    parts = []
    for authority in dict.fromkeys(claim["authority"] for claim in claims):
        rows = [row(claim) for claim in claims if claim["authority"] == authority]
        head = (
            "| claim | what is measured | held | whose numbers | measured | bound |\n"
            "|---|---|---|---|--:|--:|"
        )
        parts.append("\n".join([f"**{authority}**\n", head, *rows]))
    return "\n\n".join(parts)


rewrite("validation.md", "claims", table(json.load(sys.stdin)))
