"""A result of every kind, about a scene whose texts would break out of a page; the browser."""

import json

import numpy as np
import pytest

import heavytop as ht
from heavytop.report.files import write_result
from heavytop.results.registry import RESULTS
from heavytop.results.run import run_result
from heavytop.results.table import Row

from ..results.made import AUTO, CLAIM, FAILING, POINT, RUN, diagram_of, stress_of, validation_of
from .browser import CHROMIUM, Browser

BREAKING = "<script>alert(1)</script>\"'><img src=x onerror=alert(2)> $\\frac{"
CLOSING = "</script></title></style><svg onload=alert(3)>&amp;<!--"
HOSTILE = [f"title={json.dumps(BREAKING)}", f"source={json.dumps(CLOSING)}"]


def every_result(scene):
    """A result of every kind by the name of its file."""
    t = np.linspace(0, 1, 50)
    theta = 1.0001 * ht.Motion(scene.top, scene.start).at(t).theta
    points = Row(POINT, language=BREAKING), AUTO
    claim = Row(CLAIM, id=CLOSING, statement=BREAKING, authority=BREAKING)
    skipped = ({"method": "gauss8", "reason": BREAKING, "setting": {"tolerance": 1e-9}},)
    named = {"hard": {"cusp": BREAKING}, "methods": {"auto": CLOSING}}
    return {
        "run.json": run_result(ht.propagate(scene)),
        "drift.json": ht.drift(scene, methods=["taylor-axis"], periods=10, samples=4),
        "workprec.json": diagram_of(*points, scene=scene.document(), skipped=skipped),
        "stress.json": stress_of(Row(RUN, note=BREAKING), **named),
        "atlas.json": ht.atlas(scene, "phidot=-30:40:24", "theta=0.1:1.5:16", jobs=1),
        "check.json": ht.check({"t": t, "theta": theta, CLOSING: t}, scene),
        "certify.json": ht.certify(ht.load_scene("sicm-kicked")),
        "validate.json": validation_of(claim, FAILING),
    }


@pytest.fixture(scope="session")
def place(tmp_path_factory):
    """A folder of results, each in a folder named as its document."""
    root = tmp_path_factory.mktemp("results")
    found = every_result(ht.load_scene("sicm-kicked", overrides=HOSTILE))
    unlike = ", ".join(found.keys() ^ RESULTS.keys())
    assert not unlike, f"tests/report/conftest.py: every_result lacks, or has in vain, {unlike}"
    for name, result in found.items():
        folder = root / name.removesuffix(".json")
        folder.mkdir()
        write_result(result, folder, figures=False)
    (root / "run" / "overview.svg").write_text("<svg onload='alert(4)'/>")
    return root


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    """One that complains of nothing, and is asked for nothing outside its pages."""
    if CHROMIUM is None:
        pytest.skip("no Chromium is installed")
    found = Browser(tmp_path_factory.mktemp("profile"))
    yield found
    found.value("1")  # what was said before has been heard then
    found.close()
    assert list(found.complaints()) == []
