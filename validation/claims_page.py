"""What the claims measured: the table in docs/validation.md, and validation/measured.csv.

The document is one that `heavytop validate --json` made. The page has a row for each authority,
with the claim that comes nearest to its bound; the file has all claims.

heavytop validate --json | python validation/claims_page.py
"""

import csv
import json
import sys
from pathlib import Path

from page import markdown, rewrite

from heavytop.results.base import grouped

SKIPPED = "skipped"
MEASURED = Path(__file__).with_name("measured.csv")

HEAD = ("authority", "claims", "the one nearest to its bound", "measured", "bound")


def word(claim):
    """What a claim measured, as it is shown."""
    return SKIPPED if claim["measured"] is None else f"{claim['measured']:.1e}"


def share(claim):
    """How much of its bound a claim takes, as it is shown."""
    skipped = claim["measured"] is None or not claim["bound"]
    return 0 if skipped else float(word(claim)) / claim["bound"]


def row(authority, claims):
    """One authority: whose numbers it gives, how many claims, and the nearest to its bound."""
    origins = ", ".join(sorted({claim["numbers"] for claim in claims}))
    nearest = max(claims, key=share)
    told = f"`{nearest['id']}`: {nearest['statement']}"
    return (
        f"{authority} ({origins})",
        str(len(claims)),
        told,
        word(nearest),
        f"{nearest['bound']:g}",
    )


def table(document):
    """A row for each authority."""
    rows = (row(*each, claims) for each, claims in grouped(document["claims"], "authority").items())
    return markdown(HEAD, rows, left=3)


if __name__ == "__main__":
    document = json.load(sys.stdin)
    with MEASURED.open("w", encoding="utf-8", newline="") as file:
        rows = ((claim["id"], word(claim)) for claim in document["claims"])
        csv.writer(file, lineterminator="\n").writerows([("claim", "measured"), *rows])
    rewrite("validation.md", "claims", table(document))
