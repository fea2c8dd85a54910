"""A result of every kind, about a scene whose texts would break out of a page; the explorer."""

import json

import numpy as np
import pytest

import heavytop as ht
from heavytop.files import write_document
from heavytop.report.files import write_result
from heavytop.results.registry import RESULTS
from heavytop.results.run import run_result

from .browser import CHROMIUM, Browser
from .explorer_page import opened

BREAKING = "<script>alert(1)</script>\"'><img src=x onerror=alert(2)> $\\frac{"
CLOSING = "</script></title></style><svg onload=alert(3)>&amp;<!--"
HOSTILE = [f"title={json.dumps(BREAKING)}", f"source={json.dumps(CLOSING)}"]
POINT = {
    "method": "strang", "formulation": "axis", "language": BREAKING, "tolerance": None,
    "steps_a_period": 200, "bits": 53, "measures": "axis", "rival": True, "us_per_period": 9.0,
    "rhs_evaluations": None, "error": 1e-6, "theta_error": 1e-7, "energy_error": 1e-8,
    "phase_error": 1e-9, "warned": {}, "has_order": True, "setup_s": 0.1, "us_spread": 0.1,
    "error_spread": 0.0, "starts": 8, "runs": 2, "periods": 99.0, "steps": 9,
}  # fmt: skip


def workprec(scene):
    auto = POINT | {"method": "auto", "error": 1e-12, "rival": False}
    return {
        "schema": "heavytop/workprec/1", "scene": scene, "periods": 100, "phase": 99.6, "budget": 4,
        "points": [POINT, auto], "files": {},
        "skipped": [{"method": "gauss8", "reason": BREAKING, "setting": {"tolerance": 1e-9}}],
    }  # fmt: skip


def stress():
    run = {"case": "cusp", "method": "auto", "formulation": "auto", "outcome": "ok", "error": 1e-15,
           "digits_lost": 0.5, "note": BREAKING, "untold": False, "turns": None,
           "named": False}  # fmt: skip
    return {
        "schema": "heavytop/stress/1", "limits": {"time_s": 3.0}, "hard": {"cusp": BREAKING},
        "methods": {"auto": CLOSING}, "skipped": [], "cases": [run], "files": {},
    }  # fmt: skip


def validate():
    claim = {"id": CLOSING, "statement": BREAKING, "authority": BREAKING, "numbers": "formula",
             "bound": 1e-9, "measured": 2e-13, "passed": True, "skipped": None,
             "failure": None}  # fmt: skip
    failing = claim | {"id": "that-fails", "authority": "Euler", "passed": False, "measured": 1.0}
    return {"schema": "heavytop/validate/1", "claims": [claim, failing]}


@pytest.fixture(scope="session")
def place(tmp_path_factory):
    """A folder of results, each in a folder named as its document."""
    root = tmp_path_factory.mktemp("results")
    folders = {name: root / name.removesuffix(".json") for name in RESULTS}
    for folder in folders.values():
        folder.mkdir()
    scene, t = ht.load_scene("sicm-kicked", overrides=HOSTILE), np.linspace(0, 1, 50)
    write_result(run_result(ht.propagate(scene)), folders["run.json"], figures=False)
    (folders["run.json"] / "overview.svg").write_text("<svg onload='alert(4)'/>")
    theta = 1.0001 * ht.Motion(scene.top, scene.start).at(t).theta
    for name, found in {
        "drift": ht.drift(scene, methods=["taylor-axis"], periods=10, samples=4),
        "atlas": ht.atlas(scene, "phidot=-30:40:24", "theta=0.1:1.5:16", jobs=1),
        "check": ht.check({"t": t, "theta": theta, CLOSING: t}, scene),
        "certify": ht.certify(ht.load_scene("sicm-kicked")),
    }.items():
        write_result(found, root / name, figures=False)
    made = {"validate": validate(), "workprec": workprec(scene.document()), "stress": stress()}
    for name, document in made.items():
        write_document(root / name / f"{name}.json", document)
    return root


@pytest.fixture(scope="module")
def html(tmp_path_factory):
    return ht.explore(path=tmp_path_factory.mktemp("page") / "explore.html")


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    if CHROMIUM is None:
        pytest.skip("no Chromium is installed")
    found = Browser(tmp_path_factory.mktemp("profile"))
    yield found
    found.close()


@pytest.fixture
def page(browser, html):
    """The page at its start."""
    return opened(browser, html)
