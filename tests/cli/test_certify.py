"""`heavytop certify`: a scene, a stored run, what is refused, and exit codes."""

import json

import heavytop as ht

from ..commands import heavytop_


def test_a_scene_is_run_and_certified():
    found = heavytop_("certify", "sicm-kicked")
    assert found.exit_code == 0
    for words in (
        "proved bound",
        "whole turns proved",
        "turning 8, none missed",
        "bounds proved of axis, θ, φ, ψ",
    ):
        assert words in " ".join(found.stdout.split())


def test_a_stored_run_has_the_certificate_of_its_scene(tmp_path):
    run = tmp_path / "run"
    assert heavytop_("run", "sicm-dropped", "--no-figures", "-o", run).exit_code == 0
    stored = heavytop_("certify", run, "--json", "-o", tmp_path / "proof")
    assert stored.exit_code == 0
    known = json.loads(stored.stdout)
    assert known["schema"] == "heavytop/certify/1"
    assert known["bound"] == ht.certify(ht.propagate(ht.load_scene("sicm-dropped"))).bound
    kept = ht.Certificate.load(tmp_path / "proof" / "certify.json")
    assert kept.bound == known["bound"]
    again = heavytop_("resume", tmp_path / "proof", "--json")
    assert json.loads(again.stdout)["bound"] == known["bound"]


def test_a_form_without_certificates_is_refused():
    found = heavytop_("certify", "sicm-kicked", "--formulation", "lagrange")
    assert found.exit_code == 3
    assert "lagrange" in found.stderr
