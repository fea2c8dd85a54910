"""What a run and a classification say: numbers with their digits and units, at any width."""

from heavytop.results.run import event_table
from heavytop.results.table import Row
from heavytop.scene.quantities import MISSING

from ..commands import printed


def test_a_run_through_a_pole_says_that_phi_jumps():
    jump = "φ jumps by π: the value before or after it is given"
    for scene, time in (("sicm-kicked", 0.3), ("through-top", 1)):
        said = printed("run", scene, "--set", f"span.time={time}")
        assert (jump in said) == (scene == "through-top")


def test_events_have_all_digits_and_where_it_is_narrow_fewer():
    row = {"kind": "cusp", "t": 1 / 3, "theta": 0.1, "phi": None, "phidot": 1e-17, "residual": 0}
    table = event_table(Row(table=[Row(row), Row(row, phidot=5.0)], omitted=7))
    assert table.texts()[0] == ["cusp", "0.333333333333", "0.1", MISSING, "0", "0"]
    assert table.texts(3)[0][1] == "0.333"
    assert (table.more, table.head[1]) == (7, "t [s]")
