"""`heavytop certify`: a scene, a stored run, what is refused, and exit codes."""

import heavytop as ht

from ..commands import document, printed


def test_a_stored_run_has_the_certificate_of_its_scene(tmp_path):
    run = tmp_path / "run"
    printed("run", "sicm-dropped", "--no-figures", "-o", run)
    known = document("certify", run, "-o", tmp_path / "proof")
    assert known["schema"] == "heavytop/certify/1"
    assert known["bound"] == ht.certify(ht.propagate(ht.load_scene("sicm-dropped"))).bound
    assert document("resume", tmp_path / "proof")["bound"] == known["bound"]
