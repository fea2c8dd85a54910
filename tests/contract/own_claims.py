"""Registers of claims made for a test: scripts of its own, and what they should tell."""

from __future__ import annotations

import os
import shutil
import time
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
    return {each.claim.id: each for each in found.results}


def soon(path):
    """What a file says, as soon as it says something."""
    for _ in range(400):
        if path.exists() and path.read_text():
            return path.read_text()
        time.sleep(0.05)
    raise TimeoutError(path)


def gone(pid):
    """Whether a process has ended; one that nobody has asked after yet has."""
    for _ in range(100):
        try:
            os.kill(pid, 0)
            if Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z":
                return True
        except (ProcessLookupError, FileNotFoundError):
            return True
        time.sleep(0.02)
    return False
