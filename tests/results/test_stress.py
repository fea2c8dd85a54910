"""A stress test says what the marks mean, what failed, and whether auto was silently wrong."""

from heavytop.results.stress import silently_wrong
from heavytop.results.table import Row

from .made import RUN, stress_of


def test_it_explains_the_marks_that_occur_and_what_failed():
    bad = Row(RUN, method="m", formulation="axis", outcome="singular", note="stopped")
    chance = Row(bad, method="n", untold=True, digits_lost=None)
    left = {"case": "x", "method": "y", "reason": "no time"}
    found = stress_of(RUN, bad, chance, skipped=(left,))
    [table] = found.tables()
    assert table.head == ["case", "A", "M 1e-9", "N"]
    assert table.texts() == [["cusp", "0.5", "0.5 sing", "?"]]
    facts = dict(found.facts())
    assert {"sing singular", "?", "auto"} <= facts.keys()
    assert (facts["cusp"], facts["skipped"]) == ("singular: m, n: stopped", "no time: y (1)")
    without = dict(stress_of(chance).facts())  # its table has no "sing", and auto was not asked for
    assert "?" in without
    assert not {"sing singular", "auto"} & without.keys()


def test_its_exit_code_is_that_of_what_auto_did():
    assert [code for code, _ in stress_of().problems()] == [4]
    assert [*stress_of(RUN).problems()] == []
    wrong = stress_of(Row(RUN, outcome="diverged"))
    assert [code for code, _ in wrong.problems()] == [5]
    assert wrong.document()["auto"] == {"run": True, "silently_wrong": ["cusp"]}
    assert stress_of(RUN).to_pandas().loc[("cusp", "auto"), "digits_lost"] == 0.5


def test_only_a_run_that_says_nothing_is_silently_wrong_and_chance_is_counted_as_nothing_to_tell():
    for wrong, more in (
        (False, {"digits_lost": 1.9}), (True, {"digits_lost": 2.1}), (True, {"untold": True}),
        (True, {"outcome": "diverged"}), (False, {"outcome": "diverged", "named": True}),
    ):  # fmt: skip
        assert silently_wrong(Row(RUN, **more)) == wrong
    counts = stress_of(Row(RUN, untold=True)).counts()["auto"]
    assert {word: n for word, n in counts.items() if n} == {"nothing-to-tell": 1}
