"""A validation counts its claims, and says what does not hold."""

from .made import CLAIM, FAILING, validation_of


def test_claims_are_shown_by_authority_and_what_fails_decides_the_exit_code():
    found = validation_of(CLAIM, FAILING)
    holding, failing = found.tables()
    assert [table.texts()[0][0] for table in (holding, failing)] == ["ok", "FAIL"]
    assert (holding.fails, failing.fails) == (False, True)
    assert next(found.facts()) == ("claims", "1 passed, 1 failed, 0 skipped")
    assert [*found.facts()][-1] == ("that-fails", "out of its bound")
    [(code, sentence)] = found.problems()
    assert (code, sentence) == (5, "that-fails does not hold")
    assert found.document()["authorities"] == 2
