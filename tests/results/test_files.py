"""Every result is read back from its file as it was written."""

import json

import numpy as np
import pytest

import heavytop as ht
from heavytop.results.base import load_result
from heavytop.results.registry import RESULTS
from heavytop.results.run import run_result

KICKED = ht.load_scene("sicm-kicked")


def checked():
    t = np.linspace(0, 2, 2001)
    record = ht.Motion(KICKED.top, KICKED.start).at(t * 1.0001)
    return ht.check({"t": t, "theta": record.theta, "phi": record.phi, "note": t}, KICKED)


MADE = {
    "run.json": lambda: run_result(ht.propagate(KICKED)),
    "drift.json": lambda: ht.drift(KICKED, methods=["strang"], periods=10, samples=4),
    "stress.json": lambda: ht.stress(cases=["cusp"], methods=["auto"]),
    "atlas.json": lambda: ht.atlas(KICKED, "phidot=-30:40:6", "theta=0.1:1.5:4"),
    "check.json": checked,
    "certify.json": lambda: ht.certify(KICKED),
    "validate.json": lambda: ht.validate(["betsch-cone"]),
}


@pytest.mark.parametrize("name", MADE)
def test_a_result_is_read_back_as_it_was_written(tmp_path, name):
    found = MADE[name]()
    found.save(tmp_path / name)
    read = load_result(tmp_path / name)
    text = json.dumps(found.document(), allow_nan=False)
    assert json.dumps(read.document(), allow_nan=False) == text
    assert [table.texts() for table in read.tables()] == [t.texts() for t in found.tables()]
    assert [*read.facts()] == [*found.facts()]
    assert len(read.numbers().to_pandas()) == len(read.numbers().rows)
    assert name in RESULTS
