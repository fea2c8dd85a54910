"""Every number of others has its line in PROVENANCE.md, and is as far from exact as it says."""

import ast
import re
from pathlib import Path

import pytest

from heavytop.claims import load_claims

VALIDATION = Path(__file__).parents[2] / "validation"
SCRIPTS = sorted({VALIDATION / f"{x.script}.py" for x in load_claims().values() if not x.is_proof})
PROVENANCE = (VALIDATION / "PROVENANCE.md").read_text("utf-8").replace("−", "-")
DECIMAL = re.compile(r"(?<![\w.])\d+\.\d+(?![\w.])")


def test_a_number_of_more_than_six_digits_has_its_line():
    """Zeros before the first digit do not count."""
    written = DECIMAL.findall("\n".join(path.read_text("utf-8") for path in SCRIPTS))
    long = {each for each in written if len(each.replace(".", "").lstrip("0")) > 6}
    assert len(long) > 30
    assert long <= {*DECIMAL.findall(PROVENANCE)}


def test_what_exudyn_prints_is_as_far_from_exact_as_is_said(script):
    """omega_y of the Lie-group benchmark at both times, by the rigid body of the claims."""
    body = script("rigid").Body(
        ("15.234375", "0.46875", "15.234375"), "147.15", (0, 1, 0),
        (1, 0, 0, 0), ("0", "150", "-4.61538"),
    )  # fmt: skip
    times = ("0.01", "2")
    exact = {t: at.omega[1] for t, at in zip(times, body.at(times), strict=True)}
    rows = re.findall(r"^\| (0\.01|2) \| (-?\d+\.\d+) \| .* \| (\S+) \|$", PROVENANCE, re.M)
    assert len(rows) == 24
    for t, value, said in rows:
        off = abs(exact[t] - type(exact[t])(value))
        assert f"{float(off):.1e}" == f"{float(said):.1e}", value


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_a_largest_is_taken_by_what_lets_no_nan_slip(path):
    tree = ast.parse(path.read_text("utf-8"))
    called = (each.func for each in ast.walk(tree) if isinstance(each, ast.Call))
    assert "max" not in {each.id for each in called if isinstance(each, ast.Name)}
