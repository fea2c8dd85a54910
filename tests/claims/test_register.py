"""What a script tells is taken for nothing that it is not: else a claim fails, and says why."""

from __future__ import annotations

import json

import pytest
from pydantic import ValidationError

from heavytop.claims.register import NUMBERS, Claim, load_register
from heavytop.claims.validate import validate
from heavytop.errors import ForeignFile

from .own_claims import GOOD, by_id, made, one

X = '{"id": "x", "measured": %s}'


def told(tmp_path, body, ids=("x",)):
    return by_id(validate(register=one(tmp_path, body, ids)))


@pytest.mark.parametrize("measured", ['"0.5"', "[0.5]", "NaN", "-Infinity", "null"])
def test_what_is_no_number_does_not_hold(tmp_path, measured):
    found = told(tmp_path, f"tell({(X % measured).encode()!r})")["x"]
    assert (found.passed, found.measured, found.failure) == (False, None, "no finite number")
    json.dumps(found.row, allow_nan=False)


@pytest.mark.parametrize(
    ("line", "failure"),
    [
        (b'{"id": "x", "measured": 0.5', "line 2 of what it told is no JSON object"),
        (b"[0.5]", "line 2 of what it told is no JSON object"),
        (b"\xff\xfe", "line 2 of what it told is no JSON object"),
    ],
)
def test_a_line_too_many_spoils_what_was_measured_and_keeps_it(tmp_path, line, failure):
    found = told(tmp_path, GOOD + f"tell({line!r})")["x"]
    assert (found.passed, found.measured, found.failure) == (False, 0.5, failure)


def test_a_difference_does_not_hold_by_its_sign(tmp_path):
    found = told(tmp_path, 'tell({"id": "x", "measured": -0.5})')["x"]
    assert (found.passed, found.measured) == (False, -0.5)
    assert found.failure == "negative, as no distance is"


def test_a_number_with_a_failure_does_not_hold(tmp_path):
    found = told(tmp_path, 'tell({"id": "x", "measured": 0.5, "failure": "worn out"})')["x"]
    assert (found.passed, found.measured, found.failure) == (False, 0.5, "worn out")


@pytest.mark.parametrize(
    ("name", "failure"),
    [("x", "skipped, but what it needs is there"),
     ("present", "skipped, but what it needs is there"),
     ("absent", None)],
)  # fmt: skip
def test_only_what_an_absent_package_prevents_is_skipped(tmp_path, name, failure):
    body = f'tell({{"id": "{name}", "skipped": "no time"}})'
    found = told(tmp_path, body, (name,))[name]
    assert found.failure == failure
    assert found.skipped == (None if failure else "no time")


def test_a_package_that_does_not_import_is_a_failure_where_it_is_installed(tmp_path):
    body = (
        "from claim import claimed, finish\n@claimed('present')\ndef _():\n"
        "    raise ImportError('libGL.so.1')\nfinish()\n"
    )
    found = by_id(validate(register=made(tmp_path, {"50_p.py": body}, {"50_p.py": ["present"]})))
    assert found["present"].failure == "ImportError: libGL.so.1"


@pytest.mark.parametrize(
    ("line", "measured", "failure"),
    [
        ({"statement": "s", "measured": 0.5, "bound": 1}, 0.5, None),
        ({"statement": "s", "measured": "0.5", "bound": 1}, None, "no finite number"),
        ({"skipped": "no time"}, None, "skipped, but what it needs is there"),
    ],
)
def test_other_scripts_are_not_trusted_either(tmp_path, line, measured, failure):
    found = by_id(validate(["50_one"], register=one(tmp_path, f"tell({line!r})", ())))
    assert (found["50_one/1"].measured, found["50_one/1"].failure) == (measured, failure)
    assert found["50_one/1"].passed is (failure is None)


@pytest.mark.parametrize(
    ("body", "failure"),
    [("", "it claims nothing"), ("1 / 0", "ended with code 1: ZeroDivisionError: division by zero"),
     ("tell(b'[')", "line 1 of what it told is no JSON object")],
)  # fmt: skip
def test_a_script_that_claims_nothing_does_not_hold(tmp_path, body, failure):
    [found] = validate(["50_one"], register=one(tmp_path, body, ())).results
    assert (found.claim.id, found.passed, found.failure) == ("50_one/end", False, failure)


TABLE = {
    "id": "x", "statement": "a sum", "authority": "a", "numbers": "ours", "bound": 1,
    "reason": "exact", "script": "1.py", "holds": ["symbols"],
}  # fmt: skip


def test_a_claim_says_whose_numbers_it_is_held_against():
    assert {claim.numbers for claim in load_register().claims} <= set(NUMBERS)
    assert Claim.model_validate(TABLE).numbers == "ours"


@pytest.mark.parametrize(
    "change",
    [
        {"numbers": None}, {"numbers": "theirs"}, {"bounds": 2}, {"bound": "1"}, {"bound": -1},
        {"bound": True}, {"bound": float("nan")}, {"bound": float("inf")}, {"holds": "symbols"},
        {"holds": []}, {"reason": " "}, {"needs": 3}, {"needs": ".x"}, {"script": "../1.py"},
        {"script": "/tmp/1.py"}, {"script": "a/1.py"}, {"script": "-1.py"}, {"script": "1.sh"},
        {"statement": "a\x1b[31m"}, {"id": "x,y"}, {"id": "-x"}, {"id": "a b"}, {"id": ""},
    ],
)  # fmt: skip
def test_a_table_that_is_no_claim_is_refused_by_its_key(change):
    table = {key: value for key, value in (TABLE | change).items() if value is not None}
    with pytest.raises(ValidationError) as error:
        Claim.model_validate(table)
    assert {each["loc"][0] for each in error.value.errors()} == set(change)


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ('id = "x"', 'id = "y"', "'y': the name of two claims"),
        ('script = "50_one.py"', 'script = "gone.py"', "script = 'gone.py': not there"),
        ("bound = 1.0", "bound = -1.0", r"claim\.0\.bound = -1\.0: .*greater than or equal to 0"),
        ("[authorities]", "[author]", "author = .*Extra inputs"),
        ('"book"', '"novel"', "authority = 'novel': none of book"),
        ("format = 1", "format =", "Invalid value"), ('"a book"', '" "', r"authorities\.book"),
    ],
)  # fmt: skip
def test_a_damaged_register_is_refused_with_its_file(tmp_path, old, new, why):
    one(tmp_path, "", ("x", "y"))
    path = tmp_path / "claims.toml"
    path.write_text(path.read_text("utf-8").replace(old, new, 1), "utf-8")
    with pytest.raises(ForeignFile, match=f"claims.toml: .*{why}"):
        load_register(tmp_path)


def test_a_script_that_is_no_python_is_refused_with_its_name(tmp_path):
    one(tmp_path, "")
    (tmp_path / "60_bad.py").write_text("def (", "utf-8")
    with pytest.raises(ForeignFile, match=r"60_bad\.py: not readable as Python"):
        load_register(tmp_path)


def test_a_claim_is_not_named_as_a_script_is(tmp_path):
    with pytest.raises(ForeignFile, match=r"'50_one': the name of .* a claim and a script"):
        one(tmp_path, GOOD, ("x", "50_one"))


def test_where_nothing_is_claimed_nothing_holds(tmp_path):
    with pytest.raises(ForeignFile, match=r"claims\.toml: no claims"):
        validate(register=made(tmp_path, {}, {}))


def test_a_register_that_is_a_folder_is_refused(tmp_path):
    (tmp_path / "claims.toml").mkdir()
    with pytest.raises(ForeignFile, match=r"claims\.toml"):
        load_register(tmp_path)


def test_a_register_that_is_no_text_is_refused(tmp_path):
    one(tmp_path, "")
    (tmp_path / "claims.toml").write_bytes(b"\xff")
    with pytest.raises(ForeignFile, match=r"claims\.toml"):
        load_register(tmp_path)
