"""What `validate` promises: measured beside bound, honestly; exit 5 where a claim does not hold."""

from __future__ import annotations

import ast
import json
import math
import subprocess
import sys

import pytest
from typer.testing import CliRunner

from heavytop.claims import validate as validating
from heavytop.claims.register import load_register
from heavytop.claims.validate import UnknownClaim, validate
from heavytop.cli import app, command
from heavytop.errors import HeavyTopError, WrongType

from .own_claims import GOOD, VALIDATION, by_id, made, one

PROMISED = {"id", "statement", "authority", "bound", "measured", "passed", "skipped"}

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


@pytest.fixture
def fake(tmp_path):
    return made(tmp_path, {"50_fake.py": FAKE}, {"50_fake.py": IDS})


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


def test_what_is_asked_for_is_names(fake):
    for wrong in ("hold", "50_fak", "", "a\n" * 100, "\udcff"):
        with pytest.raises(UnknownClaim, match="is no claim and no script") as error:
            validate([wrong], register=fake)
        assert len(str(error.value)) < 200
        assert isinstance(error.value, HeavyTopError)
    with pytest.raises(UnknownClaim):
        validate([3], register=fake)
    with pytest.raises(WrongType, match='names: a list of names, not "holds"'):
        validate("holds", register=fake)
    with pytest.raises(ValueError, match="jobs = 0: at least 1"):
        validate(jobs=0, register=fake)


def test_each_script_is_told_of_as_it_begins_and_ends(tmp_path):
    scripts = {"01_own.py": "from claim import claim\nclaim('one', 1, 2)\n", "50_fake.py": FAKE}
    known = made(tmp_path, scripts, {"50_fake.py": IDS})
    notes, parts = [], []
    validate(proofs=True, register=known, note=notes.append, progress=parts.append)
    assert [note.partition(" in ")[0] for note in notes] == [
        "running 50_fake.py", "50_fake.py: 1 passed, 5 failed, 1 skipped",
        "running 01_own.py", "01_own.py: 1 passed",
    ]  # fmt: skip
    assert parts == [0.5, 1.0]


def test_other_scripts_state_their_own_claims(tmp_path):
    own = (
        '"""About tops.\n\nMore."""\nfrom claim import claim\n'
        'claim("one", 1, 2)\nclaim("two", 3, 2)\n'
    )
    scripts = {"01_own.py": own, "02_worse.py": own + "raise SystemExit(3)\n", "50_fake.py": FAKE}
    register = made(tmp_path, scripts, {"50_fake.py": ("holds",)})
    assert register.proofs["01_own.py"] == "About tops."
    assert set(by_id(validate(register=register))) == {"holds"}
    all_of_them = validate(proofs=True, register=register)
    assert all_of_them.document()["authorities"] == 1  # a book; we are none
    found = by_id(all_of_them)
    assert [(name, each.passed) for name, each in found.items()] == [
        ("holds", True), ("01_own/1", True), ("01_own/2", False),
        ("02_worse/1", False), ("02_worse/2", False), ("02_worse/end", False),
    ]  # fmt: skip
    assert [found[f"02_worse/{n}"].measured for n in (1, 2, "end")] == [1, 3, None]
    assert found["02_worse/1"].failure == "ended with code 3: it said nothing"


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
@pytest.mark.parametrize(
    ("arguments", "asked", "proofs"),
    [((), [], False), (("holds", "holds", "absent"), ["holds", "absent"], False),
     (("holds", "--proofs"), ["holds"], True)],
)  # fmt: skip
def test_the_document_keeps_what_was_asked(arguments, asked, proofs):
    document = json.loads(cli("--json", *arguments).stdout)
    assert (document["asked"], document["proofs"]) == (asked, proofs)
    assert {claim["numbers"] for claim in document["claims"]} == {"formula"}


@pytest.mark.usefixtures("ours")
def test_a_script_that_ends_badly_is_out_of_bound_and_no_bug(tmp_path, monkeypatch):
    known = one(tmp_path, GOOD + "raise SystemExit(3)")
    monkeypatch.setattr(validating, "load_register", lambda: known)
    shown = cli("-v")
    assert shown.exit_code == 5
    assert "x does not hold: ended with code 3: it said nothing" in shown.stderr
    assert "FAIL  x of the top" in shown.stdout
    assert "0.5" in shown.stdout
    assert "heavytop: 50_one.py: 1 failed in " in shown.stderr


def test_a_damaged_register_is_a_foreign_file(tmp_path, monkeypatch):
    (tmp_path / "claims.toml").write_text("[", "utf-8")
    monkeypatch.setattr(validating, "load_register", lambda: load_register(tmp_path))
    shown = cli()
    assert shown.exit_code == 3
    assert "claims.toml" in shown.stderr


@pytest.mark.usefixtures("ours")
def test_a_folder_that_cannot_be_written_is_said_before_anything_runs(tmp_path):
    (tmp_path / "file").touch()
    shown = cli("-o", tmp_path / "file", "-v")
    assert shown.exit_code == 2
    assert "not a folder" in shown.stderr
    assert "running" not in shown.stderr


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
    assert "1 holds, 5 fail, 1 skipped" in shown
    assert "ok    holds of the top   formula       0.5      1" in shown


@pytest.mark.parametrize("late", ["heavytop.cli.command", "heavytop.cli.messages", "typer"])
def test_an_interrupt_before_there_is_a_command_is_no_traceback(late):
    program = (
        "import sys\n"
        "class Pressed:\n"
        "    def find_spec(self, name, *_):\n"
        f"        if name == {late!r}: raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Pressed())\nfrom heavytop.cli import main\nmain()\n"
    )
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True)
    assert (ended.returncode, ended.stderr) == (130, b"")


def test_an_interrupt_outside_of_a_verb_is_no_traceback(monkeypatch):
    def pressed():
        raise KeyboardInterrupt

    monkeypatch.setattr(command, "app", pressed)
    with pytest.raises(SystemExit) as left:
        command.main()
    assert left.value.code == 130


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
