"""What a script tells is taken for nothing that it is not: else a claim fails, and says why."""

from __future__ import annotations

import json

import pytest

from heavytop.claims.claim import NUMBERS, Claim
from heavytop.claims.register import load_register
from heavytop.claims.validating import validate
from heavytop.errors import ForeignFile

from .own_claims import GOOD, by_id, made, one

X = '{"id": "x", "measured": %s}'


def told(tmp_path, body, ids=("x",)):
    return by_id(validate(register=one(tmp_path, body, ids)))


@pytest.mark.parametrize(
    ("measured", "failure"),
    [
        ('"0.5"', "0.5: no finite number"), ("true", "True: no finite number"),
        ("[0.5]", "[0.5]: no finite number"), ("NaN", "nan: no finite number"),
        ("-Infinity", "-inf: no finite number"), ("null", "no finite number"),
        ("1" + 400 * "0", "1" + 38 * "0" + "…: no finite number"),
        ('"\\ud800\\u0007"', "��: no finite number"),
        ("1" + 5000 * "0", "line 1 of what it told is no JSON object"),
    ],
)  # fmt: skip
def test_what_is_no_number_does_not_hold(tmp_path, measured, failure):
    found = told(tmp_path, f"tell({(X % measured).encode()!r})")["x"]
    assert (found.passed, found.measured, found.failure) == (False, None, failure)
    json.dumps(found.row, allow_nan=False).encode("utf-8")


@pytest.mark.parametrize(
    ("line", "failure"),
    [
        (b'{"id": "x", "measured": 0.5', "line 2 of what it told is no JSON object"),
        (b"[0.5]", "line 2 of what it told is no JSON object"),
        (b"\xff\xfe", "line 2 of what it told is no JSON object"),
        (b"[" * 100_000, "line 2 of what it told is no JSON object"),
        (b'{"id": "other", "measured": 0.5}', "it told of other, which it was not asked for"),
        (b'{"id": ["x"], "measured": 0.5}', "it told of ['x'], which it was not asked for"),
        (b'{"measured": 0.5}', "it told of None, which it was not asked for"),
    ],
)
def test_a_line_too_many_spoils_what_was_measured_and_keeps_it(tmp_path, line, failure):
    found = told(tmp_path, GOOD + f"tell({line!r})")["x"]
    assert (found.passed, found.measured, found.failure) == (False, 0.5, failure)


def test_a_claim_told_twice_does_not_hold(tmp_path):
    found = told(tmp_path, GOOD + GOOD + GOOD.replace("x", "y"), ("x", "y"))
    assert (found["x"].passed, found["x"].failure) == (False, "told 2 times")
    assert found["y"].passed


def test_a_difference_does_not_hold_by_its_sign(tmp_path):
    found = told(tmp_path, 'tell({"id": "x", "measured": -0.5})')["x"]
    assert (found.passed, found.measured) == (False, -0.5)
    assert found.failure == "negative, as no distance is"


def test_a_number_with_a_failure_does_not_hold(tmp_path):
    found = told(tmp_path, 'tell({"id": "x", "measured": 0.5, "failure": "worn\\nout"})')["x"]
    assert (found.passed, found.measured, found.failure) == (False, 0.5, "worn out")


@pytest.mark.parametrize(
    ("name", "failure"),
    [("x", "skipped, but it needs no package"), ("present", "skipped, but json is installed"),
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
        ({"statement": 3, "measured": 0.5, "bound": 1}, 0.5, None),
        ({"statement": "s", "measured": "0.5", "bound": 1}, None, "0.5: no finite number"),
        ({"statement": "s", "measured": 0.5}, None, "skipped, or without a bound"),
        ({"skipped": "no time"}, None, "skipped, or without a bound"),
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
    assert Claim.of(TABLE, {"a": "A"}).numbers == "ours"


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"numbers": None}, "numbers is missing"),
        ({"numbers": "theirs"}, "numbers = 'theirs': none of printed, program, formula, ours"),
        ({"numbers": ["ours"]}, r"numbers = \['ours'\]: not a text"),
        ({"bounds": 2}, 'bounds is unknown .did you mean "bound"'),
        ({"bound": "1"}, "bound = '1': not a finite number"), ({"bound": -1}, "bound = -1"),
        ({"bound": True}, "bound = True"), ({"bound": float("nan")}, "bound = nan"),
        ({"bound": False}, "bound = False"), ({"bound": float("inf")}, "bound = inf"),
        ({"authority": "b"}, "authority = 'b': none of a"), ({"holds": "symbols"}, "holds = "),
        ({"holds": []}, "holds = "), ({"reason": " "}, "reason = ' ': not a text"),
        ({"needs": 3}, "needs = 3: not a text"), ({"needs": ".x"}, "needs = '.x': not a text"),
        ({"bound": 10**400}, "bound = 10*…: not a finite number"),
        ({"script": "../1.py"}, "script = '../1.py': not the plain name"),
        ({"script": "/tmp/1.py"}, "script = '/tmp/1.py': not the plain name"),
        ({"script": "a/1.py"}, "not the plain name"), ({"script": "-1.py"}, "not the plain name"),
        ({"script": "1.sh"}, "not the plain name"),
        ({"statement": "a\x1b[31m"}, "statement = 'a.x1b.31m': not a text"),
        ({"holds": ["a\x1b"]}, "holds = "), ({"a\x1b": 1}, "a� is unknown"),
    ],
)  # fmt: skip
def test_a_table_that_is_no_claim_is_refused_with_its_name(change, why):
    table = {key: value for key, value in (TABLE | change).items() if value is not None}
    with pytest.raises(ForeignFile, match=f"^claim 'x': .*{why}"):
        Claim.of(table, {"a": "A"})


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ('id = "x"', 'id = "y"', "claim 'y' stands there 2 times"),
        ('script = "50_one.py"', 'script = "gone.py"', "script = 'gone.py': not there"),
        ("[[claim]]", "", "authorities, each a text"), ("format = 1", "format =", "Invalid value"),
        ("[authorities]", "[author]", "authority = 'book': none of"),
        ("format = 1", "claim = 3", "Cannot overwrite"),
    ],
)  # fmt: skip
def test_a_damaged_register_is_refused_with_its_file(tmp_path, old, new, why):
    one(tmp_path, "", ("x", "y"))
    path = tmp_path / "claims.toml"
    path.write_text(path.read_text("utf-8").replace(old, new, 1), "utf-8")
    with pytest.raises(ForeignFile, match=f"claims.toml: .*{why}"):
        load_register(tmp_path)


@pytest.mark.parametrize("name", ["x,y", "-x", "a b", "x\x1b[31m", "", "é"])
def test_a_name_that_could_be_something_else_is_refused(name):
    with pytest.raises(ForeignFile, match=r"id = .*: not letters, digits and") as error:
        Claim.of(TABLE | {"id": name}, {"a": "A"})
    assert str(error.value).isprintable()


@pytest.mark.parametrize("text", ["def (", "\0", "(" * 500_000, "-" * 500_000 + "1"])
def test_a_script_that_is_no_python_is_refused_with_its_name(tmp_path, text):
    one(tmp_path, "")
    (tmp_path / "60_bad.py").write_text(text, "utf-8")
    with pytest.raises(ForeignFile, match=r"60_bad\.py: not readable as Python"):
        load_register(tmp_path)


@pytest.mark.parametrize("name", ["6\x1b[31m.py", "6 x.py", "6,x.py"])
def test_a_script_with_a_name_that_no_script_has_is_refused(tmp_path, name):
    one(tmp_path, "")
    (tmp_path / name).touch()
    with pytest.raises(ForeignFile, match="not the plain name") as error:
        load_register(tmp_path)
    assert str(error.value).isprintable()


def test_a_claim_is_not_named_as_a_script_is(tmp_path):
    with pytest.raises(ForeignFile, match=r"claims\.toml: claim '50_one': the name of a script"):
        one(tmp_path, GOOD, ("x", "50_one"))


def test_an_authority_without_a_name_that_can_be_printed_is_refused(tmp_path):
    one(tmp_path, "")
    path = tmp_path / "claims.toml"
    path.write_text(path.read_text("utf-8").replace('"a book"', r'"a \u001b[31mbook"'), "utf-8")
    with pytest.raises(ForeignFile, match="authorities, each a text"):
        load_register(tmp_path)


def test_where_nothing_is_claimed_nothing_holds(tmp_path):
    with pytest.raises(ForeignFile, match=r"claims\.toml: no claims"):
        validate(register=made(tmp_path, {}, {}))


def test_what_is_told_without_end_is_not_read_to_its_end(tmp_path):
    body = GOOD + "tell(b' ' * 2**20)"
    found = told(tmp_path, body)["x"]
    assert (found.passed, found.measured) == (False, 0.5)
    assert found.failure == "it told more than 1 MB"


def test_a_register_that_is_a_folder_is_refused(tmp_path):
    (tmp_path / "claims.toml").mkdir()
    with pytest.raises(ForeignFile, match=r"claims\.toml"):
        load_register(tmp_path)


def test_a_register_that_is_no_text_is_refused(tmp_path):
    one(tmp_path, "")
    (tmp_path / "claims.toml").write_bytes(b"\xff")
    with pytest.raises(ForeignFile, match=r"claims\.toml"):
        load_register(tmp_path)
