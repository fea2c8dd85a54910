"""`heavytop certify`: a scene, a stored run, what is refused, and exit codes."""

import json

import heavytop as ht

from ..commands import heavytop_, printed


def test_a_stored_run_has_the_certificate_of_its_scene(tmp_path):
    run = tmp_path / "run"
    printed("run", "sicm-dropped", "--no-figures", "-o", run)
    known = json.loads(printed("certify", run, "--json", "-o", tmp_path / "proof"))
    assert known["schema"] == "heavytop/certify/1"
    assert known["bound"] == ht.certify(ht.propagate(ht.load_scene("sicm-dropped"))).bound
    again = json.loads(printed("resume", tmp_path / "proof", "--json"))
    assert again["bound"] == known["bound"]


def test_a_form_without_certificates_is_refused():
    assert heavytop_("certify", "sicm-kicked", "--formulation", "lagrange").exit_code == 3
