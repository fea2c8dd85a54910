"""The table of claims in docs/validation.md, from a document that `heavytop validate --json` made.

heavytop validate --json | python validation/claims_page.py
"""

import json
import sys

from page import rewrite

from heavytop.report.tables import Table, grouped, size

SKIPPED = "skipped"


HEAD = ("claim", "what is measured", "measured", "bound")


def row(claim):
    measured = SKIPPED if claim["measured"] is None else size(claim["measured"])
    return f"`{claim['id']}`", claim["statement"], measured, f"{claim['bound']:.2g}"


def table(document):
    """One table: a row for each authority, with whose numbers it gives, above its claims."""
    rows = []
    for (authority,), claims in grouped(document["claims"], "authority").items():
        origins = ", ".join(sorted({claim["numbers"] for claim in claims}))
        rows += [("", f"**{authority}** ({origins})", "", ""), *map(row, claims)]
    return Table(HEAD, tuple(rows), left=2).markdown


rewrite("validation.md", "claims", table(json.load(sys.stdin)))
