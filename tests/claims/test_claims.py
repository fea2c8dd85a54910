"""What `validate` promises: every claim is found, measured and judged, whatever it does."""

import ast
import math
from dataclasses import replace
from pathlib import Path

import pytest

import heavytop as ht
from heavytop.claims import CLAIMS, advance, load_claims, tasks, validate

from ..studies.toy import drop_line

pytestmark = pytest.mark.processes
FAKE, SLOW = ((Path(__file__).parent / "toys" / f"{x}.py").read_text() for x in ("fake", "slow"))


def script(folder, body):
    """Write a script whose name no other test has; return the folder, and the name."""
    name = f"50_{folder.name}"
    (folder / f"{name}.py").write_text(body)
    return folder, name


def by_id(found):
    return {each.id: each for each in found.claims}


def test_every_claim_has_a_statement_an_authority_a_bound_and_its_reason():
    found = load_claims().values()
    claims = [each for each in found if not each.is_proof]
    assert claims
    assert len({each.id for each in found}) == len(found)
    for each in claims:
        assert 0 <= each.bound < math.inf
        assert all((each.statement, each.authority.name, each.reason, each.holds))
        assert each.authority.numbers in ("printed", "program", "formula", "ours")


def test_the_independent_rigid_body_sees_nothing_of_the_package():
    body = Path(__file__).parents[2] / "validation" / "rigid.py"
    tree = ast.parse(body.read_text("utf-8"))
    named = {n.module or "" for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)}
    named |= {a.name for n in ast.walk(tree) if isinstance(n, ast.Import) for a in n.names}
    assert not any(name.startswith(("heavytop", "tools")) for name in named)


def test_without_scripts_and_with_two_claims_of_a_name_there_is_nothing_to_measure(tmp_path):
    with pytest.raises(ht.HeavyTopError, match="installed without"):
        load_claims(str(tmp_path))
    script(tmp_path, 2 * FAKE)
    with pytest.raises(ValueError, match="two claims"):
        load_claims(str(tmp_path))


# --- measuring -------------------------------------------------------------------------------


def test_each_claim_is_judged_by_its_bound_in_the_order_of_its_script(tmp_path):
    folder, name = script(tmp_path, FAKE)
    found = validate(proofs=True, scripts=folder)
    rows = by_id(found)
    assert {each.id: (each.passed, each.measured) for each in found.claims} == {
        "holds": (True, 0.5), "fails": (False, 2.0), "raises": (False, None), "nan": (False, None),
        "negative": (False, -0.5), "dies": (False, None), "absent": (None, None),
        "first": (True, 0.0), "last": (True, 1.0), f"{name}/own/1": (True, 1.0),
        f"{name}/own/2": (True, -3.0), f"{name}/own/3": (False, 3.0), f"{name}/own": (False, None),
        f"{name}/empty": (False, None),
    }  # fmt: skip
    assert ",first,last," in ",".join(rows)
    assert rows["first"].statement == "tilt of the top, 1"
    assert rows["raises"].failure == "ValueError: no such top"
    assert "SIGSEGV" in rows["dies"].failure
    assert "no_such_package" in rows["absent"].skipped
    assert rows[f"{name}/own"].failure == "OSError: no disk"
    assert rows["holds"].script == f"{name}.py"
    assert found.document()["authorities"] == 1  # a book; we are none


def test_only_what_is_asked_is_measured(tmp_path):
    folder, name = script(tmp_path, FAKE)
    seen = []
    found = validate(["last", "holds", "last"], scripts=folder, progress=seen.append)
    assert list(by_id(found)) == ["holds", "last"]
    assert (seen[0].tasks, seen[-1].ended) == (2, 2)
    parameters = {"scripts": str(folder), "claims": [f"{name}/absent", f"{name}/own"]}
    assert tasks(parameters) == [f"{name}/own"]
    with pytest.raises(ht.BadScene, match='did you mean "holds"'):
        validate(["hold"], scripts=folder)


def test_what_takes_too_long_is_killed_and_does_not_hold(tmp_path, monkeypatch):
    folder, name = script(tmp_path, SLOW)
    task, parameters = f"{name}/a", {"scripts": str(folder), "claims": [f"{name}/a"]}
    known = load_claims(str(folder))[task]
    [chunk] = advance(parameters, task, None)
    assert chunk.rows[0].passed
    monkeypatch.setitem(CLAIMS, task, replace(known, limit_s=0.1))
    [chunk] = advance(parameters, task, None)
    assert (chunk.done, chunk.rows[0].passed) == (True, False)
    assert "0.1 s" in chunk.rows[0].failure


# --- killed and resumed ----------------------------------------------------------------------


def test_a_validation_that_was_killed_goes_on_and_ends_the_same(tmp_path):
    folder, _ = script(tmp_path, SLOW)
    whole = validate(scripts=folder, jobs=2, folder=tmp_path / "out")
    assert whole.counts["passed"] == 4
    drop_line(tmp_path / "out")
    assert ht.resume(tmp_path / "out").document() == whole.document()


def test_what_was_measured_of_other_code_is_refused(tmp_path):
    place = tmp_path / "out"
    folder, _ = script(tmp_path, SLOW)
    validate(["a"], scripts=folder, folder=place)
    validate(["a"], scripts=folder, folder=place)  # it is finished
    script(tmp_path, SLOW + "# changed\n")
    for again in (lambda: validate(["a"], scripts=folder, folder=place), lambda: ht.resume(place)):
        with pytest.raises(ht.ForeignFile, match="code"):
            again()
