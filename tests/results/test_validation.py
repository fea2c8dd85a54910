"""A validation counts its claims, and says what does not hold."""

import pytest

from heavytop.results.validation import Validation

from ..report.conftest import validate


def test_claims_are_shown_by_authority_and_what_fails_decides_the_exit_code():
    found = Validation.from_document(validate())
    holding, failing = found.tables()
    assert [table.texts()[0][0] for table in (holding, failing)] == ["ok", "FAIL"]
    assert (holding.fails, failing.fails) == (False, True)
    assert next(found.facts()) == ("claims", "1 holds, 1 fails")
    assert [*found.facts()][-1] == ("that-fails", "out of its bound")
    [(code, sentence)] = found.problems()
    assert (code, sentence) == (5, "that-fails does not hold")
    assert found.document()["authorities"] == 2


@pytest.mark.parametrize(
    ("passed", "words"),
    [([True] * 82 + [None] * 3, "82 hold, none fails, 3 skipped"), ([False] * 2, "0 hold, 2 fail"),
     ([True, False], "1 holds, 1 fails")],
)  # fmt: skip
def test_claims_are_counted(passed, words):
    claims = tuple({"passed": each, "skipped": None, "failure": None, "id": ""} for each in passed)
    assert next(Validation(claims=claims).facts()) == ("claims", words)
