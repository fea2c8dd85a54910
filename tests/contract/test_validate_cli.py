"""What `validate` promises: measured beside bound, honestly; exit 5 where a claim does not hold."""

from __future__ import annotations

import ast
import json
import math
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from typer.testing import CliRunner

from heavytop.claims import validating
from heavytop.claims.register import load_register
from heavytop.claims.validating import UnknownClaim, validate
from heavytop.cli import app
from heavytop.errors import HeavyTopError

PROMISED = {"id", "statement", "authority", "bound", "measured", "passed", "skipped"}
VALIDATION = Path(__file__).parents[2] / "validation"

HEAD = 'format = 1\n[authorities]\nbook = "a book"\n'
CLAIM = """
[[claim]]
id = "{id}"
script = "{script}"
authority = "book"
holds = ["closed form"]
statement = "{id} of the top"
bound = 1.0
reason = "so it is"
"""
FAKE = """
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
            text += 'needs = "no_such_package"\n' if name == "absent" else ""
    (folder / "claims.toml").write_text(text, "utf-8")
    return load_register(folder)


@pytest.fixture
def fake(tmp_path):
    return made(tmp_path, {"50_fake.py": FAKE}, {"50_fake.py": IDS})


def by_id(found):
    return {each.claim.id: each for each in found.results}


def test_each_claim_is_judged_by_its_bound(fake):
    found = by_id(validate(register=fake))
    assert {name: each.passed for name, each in found.items()} == {
        "holds": True, "fails": False, "raises": False, "nan": False, "absent": None,
        "lies": False, "unsaid": False,
    }  # fmt: skip
    assert (found["holds"].measured, found["fails"].measured) == (0.5, 2.0)
    assert found["raises"].failure == "ValueError: no such top"
    assert found["nan"].measured is None
    assert found["unsaid"].failure == "nothing was measured"
    assert found["absent"].skipped == "needs no_such_package: pip install no_such_package"


def test_only_what_is_asked_is_measured(fake):
    assert list(by_id(validate(["holds"], register=fake))) == ["holds"]
    assert set(by_id(validate(["50_fake"], register=fake))) == set(IDS)
    with pytest.raises(UnknownClaim, match='did you mean "holds"'):
        validate(["hold"], register=fake)


def test_a_script_that_dies_holds_nothing(tmp_path):
    dying = 'import sys\nprint("not this", file=sys.stderr)\nsys.exit("worn out")'
    found = validate(register=made(tmp_path, {"50_d.py": dying}, {"50_d.py": ("holds",)}))
    assert found.failed[0].failure == "ended with code 1: worn out"


def test_a_script_that_does_not_end_is_killed_with_what_it_started(tmp_path, monkeypatch):
    started = tmp_path / "pid"
    slow = (
        "import subprocess, sys, time, pathlib\n"
        'child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])\n'
        f"pathlib.Path({str(started)!r}).write_text(str(child.pid))\ntime.sleep(60)\n"
    )
    monkeypatch.setattr(validating, "LIMIT", 2.0)
    found = validate(register=made(tmp_path, {"50_s.py": slow}, {"50_s.py": ("holds",)}))
    assert found.failed[0].failure == "not done in 2 s"
    assert gone(int(started.read_text()))


def test_a_validation_that_is_ended_leaves_nothing_running(tmp_path):
    started = tmp_path / "pid"
    slow = (
        "import os, pathlib, time\n"
        f"pathlib.Path({str(started)!r}).write_text(str(os.getpid()))\ntime.sleep(60)\n"
    )
    made(tmp_path, {"50_s.py": slow}, {"50_s.py": ("holds",)})
    program = (
        "import sys\nfrom pathlib import Path\nfrom heavytop.claims import register, validating\n"
        f"known = register.load_register(Path({str(tmp_path)!r}))\n"
        "validating.load_register = lambda: known\n"
        "from heavytop.cli import app\nsys.argv = ['heavytop', 'validate']\napp()\n"
    )
    running = subprocess.Popen([sys.executable, "-c", program], stderr=subprocess.PIPE)
    for _ in range(600):
        if started.exists() and started.read_text():
            break
        time.sleep(0.05)
    running.send_signal(signal.SIGTERM)
    assert running.wait(20) == 130
    running.stderr.close()
    assert gone(int(started.read_text()))


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


def test_other_scripts_state_their_own_claims(tmp_path):
    own = (
        '"""About tops.\n\nMore."""\nfrom claim import claim\n'
        'claim("one", 1, 2)\nclaim("two", 3, 2)\n'
    )
    scripts = {"01_own.py": own, "02_worse.py": own + "raise SystemExit(3)\n", "50_fake.py": FAKE}
    register = made(tmp_path, scripts, {"50_fake.py": ("holds",)})
    assert register.proofs["01_own.py"] == "About tops."
    assert set(by_id(validate(register=register))) == {"holds"}
    found = by_id(validate(proofs=True, register=register))
    assert [(name, each.passed) for name, each in found.items()] == [
        ("holds", True), ("01_own/1", True), ("01_own/2", False),
        ("02_worse/1", True), ("02_worse/2", False), ("02_worse/end", False),
    ]  # fmt: skip


def test_what_an_installed_package_carries_is_run_from_a_copy(tmp_path, monkeypatch):
    at_home = (
        "from pathlib import Path\nfrom claim import claim\n"
        f"claim('at home', Path(__file__).parent == Path({str(tmp_path)!r}), 0)\n"
    )
    register = made(tmp_path, {"01_where.py": at_home}, {})
    assert validate(["01_where"], register=register).failed
    monkeypatch.setattr(validating, "PACKED", tmp_path)
    assert not validate(["01_where"], register=register).failed


def cli(*arguments):
    return CliRunner().invoke(app, ["validate", *map(str, arguments)])


@pytest.fixture
def ours(fake, monkeypatch):
    monkeypatch.setattr(validating, "load_register", lambda: fake)


@pytest.mark.usefixtures("ours")
def test_the_document_and_the_exit_code(tmp_path):
    shown = cli("--json", "-o", tmp_path / "made" / "here")
    document = json.loads(shown.stdout)
    assert shown.exit_code == 5
    assert document["schema"] == "heavytop/validate/1"
    assert all(set(claim) >= PROMISED for claim in document["claims"])
    assert document["counts"] == {"passed": 1, "failed": 5, "skipped": 1}
    assert json.loads((tmp_path / "made/here/validate.json").read_text("utf-8")) == document
    assert "raises does not hold: ValueError: no such top" in shown.stderr


@pytest.mark.usefixtures("ours")
def test_exit_codes_where_all_holds_and_where_a_name_is_unknown():
    assert cli("holds", "absent").exit_code == 0
    unknown = cli("hold")
    assert unknown.exit_code == 2
    assert "did you mean" in unknown.stderr


@pytest.mark.usefixtures("ours")
def test_the_table_shows_measured_and_bound():
    shown = cli().stdout
    for line in ("ok    holds of the top", "FAIL  fails of the top", "skip  absent of the top"):
        assert line in shown
    assert "absent  skipped: needs no_such_package: pip install no_such_package" in shown
    assert "1 claim holds, 5 fail, 1 was skipped; 1 authority" in shown


def test_an_installation_without_claims_says_so(tmp_path):
    with pytest.raises(HeavyTopError, match="installed without its claims"):
        load_register(tmp_path)


def test_thirty_claims_of_eight_authorities_each_with_a_bound_and_its_reason():
    register = load_register()
    ids = [claim.id for claim in register.claims]
    assert len(ids) == len(set(ids)) >= 30
    assert len({claim.authority for claim in register.claims}) >= 8
    for claim in register.claims:
        assert math.isfinite(claim.bound)
        assert claim.bound >= 0
        assert claim.reason
        assert claim.holds
        assert (register.folder / claim.script).is_file()


def test_the_independent_rigid_body_sees_nothing_of_the_package():
    tree = ast.parse((VALIDATION / "rigid.py").read_text("utf-8"))
    named = {n.module or "" for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)}
    named |= {a.name for n in ast.walk(tree) if isinstance(n, ast.Import) for a in n.names}
    assert not any(name.startswith(("heavytop", "claim")) for name in named)
