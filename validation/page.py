"""Tables of the documentation that scripts write, with machine and versions; that of the claims.

The page of the claims has a row for each authority, with the claim that comes nearest to its bound;
measured.csv has all: heavytop validate --json | python validation/page.py

With the names of some, only their lines of measured.csv are written.
"""

import csv
import json
import platform
import re
import sys
from pathlib import Path

from heavytop.claims import load_claims
from heavytop.doctor import cpu_model, version
from heavytop.results.base import group
from heavytop.results.table import Table
from heavytop.scene.quantities import Quantity

DOCS = Path(__file__).parents[1] / "docs"


def rewrite(page, marker, table, signed=True):
    """Put a table between the markers of a page of docs/, under it the machine that timed it."""
    path = DOCS / page
    text = path.read_text("utf-8")
    begin, end = f"<!-- begin {marker} -->", f"<!-- end {marker} -->"
    lines = [begin, table.rstrip(), *["", foot()] * signed, end]
    found, count = re.subn(
        f"{re.escape(begin)}.*?{re.escape(end)}", lambda _: "\n".join(lines), text, flags=re.S
    )
    if count != 1:
        raise ValueError(f"{page}: no table {marker}")
    path.write_text(found, "utf-8")


def markdown(head, rows, left=1):
    """A table of texts in Markdown; of so many columns at the left not aligned to the right."""
    columns = [str(k) for k in range(len(head))]
    table = [dict(zip(columns, row, strict=True)) for row in rows]
    about = {name: Quantity(text, "") for name, text in zip(columns, head, strict=True)}
    return Table(table, columns, meanings=about, left=left).markdown


def foot():
    """Machine and versions in a line."""
    packages = ("heavytop", "heyoka", "numpy", "scipy", "numba", "CyRK")
    versions = ", ".join(f"{name} {version(name)}" for name in packages if version(name))
    return f"*{cpu_model() or platform.machine()}, Python {platform.python_version()}; {versions}.*"


# --- the page of the claims ------------------------------------------------------------------

MEASURED = Path(__file__).with_name("measured.csv")

HEAD = ("authority", "the claim nearest to its bound", "measured", "bound")


def word(claim):
    """What a claim measured, as it is shown."""
    return "skipped" if claim["measured"] is None else f"{claim['measured']:.1e}"


def share(claim):
    """How much of its bound a claim takes, as it is shown."""
    skipped = claim["measured"] is None or not claim["bound"]
    return 0 if skipped else float(word(claim)) / claim["bound"]


def row(authority, claims):
    """One authority: whose numbers it gives, and the claim nearest to its bound."""
    origins = ", ".join(sorted({claim["numbers"] for claim in claims}))
    nearest = max(claims, key=share)
    told = f"`{nearest['id']}`: {nearest['statement']}"
    return f"{authority} ({origins})", told, word(nearest), f"{nearest['bound']:g}"


def claims_table(document):
    """A row for each authority."""
    rows = (row(*each, claims) for each, claims in group(document["claims"], "authority").items())
    return markdown(HEAD, rows, left=2)


def record(claims):
    """Write down what claims measured; of those that are not among them what stands there stays."""
    known = [each.id for each in load_claims().values() if not each.is_proof]
    with MEASURED.open(encoding="utf-8", newline="") as file:
        found = {row["claim"]: row["measured"] for row in csv.DictReader(file)}
    found |= {each["id"]: word(each) for each in claims if each["measured"] is not None}
    with MEASURED.open("w", encoding="utf-8", newline="") as file:
        rows = ((name, found[name]) for name in known if name in found)
        csv.writer(file, lineterminator="\n").writerows([("claim", "measured"), *rows])


if __name__ == "__main__":
    document = json.load(sys.stdin)
    record(document["claims"])
    if not document["asked"]:
        rewrite("validation.md", "claims", claims_table(document))
