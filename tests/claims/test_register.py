"""The register of claims: every table has what it needs, and a damaged one is refused."""

import ast
import math

import pytest
from pydantic import ValidationError

from heavytop.claims.register import NUMBERS, Claim, load_register
from heavytop.claims.validate import validate
from heavytop.errors import ForeignFile, HeavyTopError

from .own_claims import GOOD, VALIDATION, made, one

TABLE = {
    "id": "x", "statement": "a sum", "authority": "a", "numbers": "ours", "bound": 1,
    "reason": "exact", "script": "1.py", "holds": ["symbols"],
}  # fmt: skip


def test_thirty_claims_of_eight_authorities_each_with_a_bound_and_its_reason():
    register = load_register()
    ids = [claim.id for claim in register.claims]
    assert len(ids) == len(set(ids)) >= 30
    assert len({claim.authority for claim in register.claims}) >= 8
    for claim in register.claims:
        assert 0 <= claim.bound < math.inf
        assert claim.reason
        assert claim.holds
        assert claim.numbers in NUMBERS
        assert (register.folder / claim.script).is_file()
    assert "22_work_precision.py" in register.proofs
    assert not {claim.script for claim in register.claims} & set(register.proofs)


def test_the_independent_rigid_body_sees_nothing_of_the_package():
    tree = ast.parse((VALIDATION / "rigid.py").read_text("utf-8"))
    named = {n.module or "" for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)}
    named |= {a.name for n in ast.walk(tree) if isinstance(n, ast.Import) for a in n.names}
    assert not any(name.startswith(("heavytop", "claim")) for name in named)


CHANGES = [
    {"numbers": None}, {"numbers": "theirs"}, {"bounds": 2}, {"bound": "1"}, {"bound": -1},
    {"bound": True}, {"bound": float("inf")}, {"holds": "symbols"}, {"holds": []}, {"reason": " "},
    {"needs": ".x"}, {"script": "../1.py"}, {"script": "a/1.py"}, {"script": "-1.py"},
    {"script": "1.sh"}, {"statement": "a\x1b[31m"}, {"id": "x,y"}, {"id": "-x"}, {"id": ""},
]  # fmt: skip


@pytest.mark.parametrize("change", CHANGES)
def test_a_table_that_is_no_claim_is_refused_by_its_key(change):
    assert Claim.model_validate(TABLE).numbers == "ours"
    table = {key: value for key, value in (TABLE | change).items() if value is not None}
    with pytest.raises(ValidationError) as error:
        Claim.model_validate(table)
    assert {each["loc"][0] for each in error.value.errors()} == set(change)


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ('id = "x"', 'id = "y"', "'y': the name of two claims"),
        ('id = "x"', 'id = "50_one"', "'50_one': the name of .* a claim and a script"),
        ('script = "50_one.py"', 'script = "gone.py"', "script = 'gone.py': not there"),
        ("bound = 1.0", "bound = -1.0", r"claim\.0\.bound = -1\.0: .*greater than or equal to 0"),
        ("[authorities]", "[author]", "author = .*Extra inputs"),
        ('"book"', '"novel"', "authority = 'novel': none of book"),
        ("format = 1", "format = 2", r"format = 2: Input should be 1"),
        ("reason", "\udcff", "utf-8"),
    ],
)
def test_a_damaged_register_is_refused_with_its_file(tmp_path, old, new, why):
    one(tmp_path, "", ("x", "y"))
    path = tmp_path / "claims.toml"
    text = path.read_text("utf-8").replace(old, new, 1)
    path.write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(ForeignFile, match=f"claims.toml: .*{why}"):
        load_register(tmp_path)


def test_without_a_register_or_a_claim_nothing_holds(tmp_path):
    with pytest.raises(HeavyTopError, match="installed without its claims"):
        load_register(tmp_path)
    with pytest.raises(ForeignFile, match=r"claims\.toml: no claims"):
        validate(register=made(tmp_path, {}, {}))
    (tmp_path / "claims.toml").unlink()
    (tmp_path / "claims.toml").mkdir()
    with pytest.raises(ForeignFile, match=r"claims\.toml"):
        load_register(tmp_path)


def test_a_script_that_is_no_python_does_not_hold(tmp_path):
    one(tmp_path, GOOD)
    (tmp_path / "60_bad.py").write_text("def (", "utf-8")
    [found] = validate(["60_bad"], register=load_register(tmp_path)).failed
    assert found.failure == "ended with code 1: SyntaxError: invalid syntax"
