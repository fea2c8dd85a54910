"""find, sweep and --unit as they are typed."""

import re

from ..commands import document, printed


def test_find_and_sweep_answer_in_json_and_in_words(tmp_path):
    asked = ("find", "sicm-dropped", "--vary", "start.psidot=100:400", "--so-that", "period = 0.3")
    assert document(*asked)["schema"] == "heavytop/find/1"
    assert "period 300 ms" in printed(*asked, "--unit", "rpm,ms")
    swept = ("sweep", "sicm-dropped", "--over", "start.psidot=100:400:3", "--facts", "round,ratio")
    assert len(document(*swept, "--unit", "rpm")["rows"]) == 3
    assert printed(*swept, "--unit", "rpm", "-o", str(tmp_path / "x.csv")) == ""
    assert (tmp_path / "x.csv").read_text("utf-8").startswith("start.psidot [rpm],kind,round [s]")
    printed(*swept, "-o", str(tmp_path / "out"))
    assert (tmp_path / "out" / "sweep.svg").stat().st_size > 1000


def test_a_run_is_shown_in_the_units_asked_for_and_its_json_stays_si():
    for scene in ("sicm-dropped", "sleeping-unstable", "steady-betsch", "spherical-pendulum"):
        shown = printed("classify", scene, "--unit", "deg,ms,rpm").partition("why")
        rest = shown[2].partition("\nθ")[2]
        assert not re.search(r"[0-9] (rad/s|rad|s)\b", rest), rest
    ran = printed("run", "sicm-kicked", "--set", "span.time=0.3", "--unit", "deg,deg/s,ms")
    assert not re.search(r"[0-9] (rad/s|rad|s)\b", ran.partition("θ between")[2])
    found = document("classify", "sicm-dropped", "--unit", "deg,ms")["motion"]
    assert round(found["period"], 6) == 0.401406


def test_what_a_held_spin_makes_of_a_kick_is_said():
    [note] = document("classify", "sicm-kicked")["warnings"]
    assert "from 0.1 to 0.363598452 rad" in note
    assert document("classify", "sicm-forward")["warnings"] == []
    assert "20.8327 deg" in " ".join(printed("classify", "sicm-kicked", "--unit", "deg").split())
