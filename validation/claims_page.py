"""The table of claims in docs/validation.md, from a document that `heavytop validate --json` made.

heavytop validate --json | python validation/claims_page.py
"""

import json
import sys

from page import rewrite

from heavytop.report.tables import Table, grouped, size

SKIPPED = "skipped"


HEAD = ("claim", "what is measured", "held", "whose numbers", "measured", "bound")


def row(claim):
    measured = SKIPPED if claim["measured"] is None else size(claim["measured"])
    return (f"`{claim['id']}`", claim["statement"], ", ".join(claim["holds"]), claim["numbers"],
            measured, f"{claim['bound']:.2g}")  # fmt: skip


def table(document):
    """A heading and a table for each authority."""
    return "\n\n".join(
        f"**{authority}**\n\n{Table(HEAD, tuple(map(row, claims)), left=4).markdown}"
        for (authority,), claims in grouped(document["claims"], "authority").items()
    )


rewrite("validation.md", "claims", table(json.load(sys.stdin)))
