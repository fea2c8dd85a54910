"""Every result is read back from its file as it was written."""

import json

import numpy as np
import pytest

from heavytop.analytic.motion import Motion
from heavytop.checking.judge import check
from heavytop.claims.validate import validate
from heavytop.files import write_document
from heavytop.results.documents import read_document
from heavytop.results.run import run_result
from heavytop.run.propagation import propagate
from heavytop.scene.scene import load_scene
from heavytop.studies.atlas import atlas
from heavytop.studies.drift import drift

KICKED = load_scene("sicm-kicked")


def checked():
    t = np.linspace(0, 2, 2001)
    record = Motion(KICKED.top, KICKED.start).at(t * 1.0001)
    return check({"t": t, "theta": record.theta, "phi": record.phi, "note": t}, KICKED).document()


MADE = {
    "run.json": lambda: run_result(propagate(KICKED)).document(),
    "drift.json": lambda: drift(KICKED, methods=["strang"], periods=10, samples=4).document(),
    "atlas.json": lambda: atlas(KICKED, "phidot=-30:40:6", "theta=0.1:1.5:4").document(),
    "check.json": checked,
    "validate.json": lambda: validate(["betsch-cone"]).document(),
}


@pytest.mark.parametrize("name", MADE)
def test_a_result_is_read_back_as_it_was_written(tmp_path, name):
    document = json.loads(json.dumps(MADE[name](), allow_nan=False))
    write_document(tmp_path / name, document)
    unsaid = {"command": None, "files": {}, "versions": {}}
    assert read_document(tmp_path / name).found == unsaid | document
