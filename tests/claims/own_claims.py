"""Registers of claims made for a test: scripts of its own, and what they should tell."""

from __future__ import annotations

import shutil
from pathlib import Path

from heavytop.claims.register import load_register

VALIDATION = Path(__file__).parents[2] / "validation"
HEAD = 'format = 1\n[authorities]\nbook = "a book"\n'
CLAIM = """
[[claim]]
id = "{id}"
script = "{script}"
authority = "book"
numbers = "formula"
holds = ["closed form"]
statement = "{id} of the top"
bound = 1.0
reason = "so it is"
"""
NEEDS = {"absent": "no_such_package", "present": "json"}
TELL = """
import json, os
def tell(*lines):
    with open(os.environ["HEAVYTOP_CLAIMS_TOLD"], "ab") as file:
        for line in lines:
            file.write((line if isinstance(line, bytes) else json.dumps(line).encode()) + b"\\n")
"""
GOOD = 'tell({"id": "x", "measured": 0.5})\n'
FAKE = """
import os
from claim import claimed, finish, tell

@claimed("holds")
def _():
    return 0.5

@claimed("fails")
def _():
    return 2.0

@claimed("raises")
def _():
    raise ValueError("no such top")

@claimed("nan")
def _():
    return float("nan")

@claimed("absent")
def _():
    return 0.0

if "lies" in os.environ["HEAVYTOP_CLAIMS_ASKED"]:
    tell(id="lies", measured=2.0, passed=True)
finish()
"""
IDS = ("holds", "fails", "raises", "nan", "absent", "lies", "unsaid")


def made(folder, scripts, ids):
    """A register of our own: scripts by name, and the claims of each."""
    shutil.copy(VALIDATION / "claim.py", folder)
    text = HEAD
    for script, body in scripts.items():
        (folder / script).write_text(body, "utf-8")
        for name in ids.get(script, ()):
            text += CLAIM.format(id=name, script=script)
            text += f'needs = "{NEEDS[name]}"\n' if name in NEEDS else ""
    (folder / "claims.toml").write_text(text, "utf-8")
    return load_register(folder)


def one(folder, body, ids=("x",)):
    """A register of one script that tells by hand."""
    return made(folder, {"50_one.py": TELL + body}, {"50_one.py": ids})


def by_id(found):
    return {each.id: each for each in found.claims}
