"""The energy–momentum document and its pictures: JSON, what they hold, the same bytes again."""

import json

import numpy as np
import pytest
from matplotlib.colors import to_hex

from heavytop.plots.figures import save
from heavytop.plots.style import KINDS
from heavytop.plots.theory import critical_set_figure, energy_momentum_figure
from heavytop.results.energy_momentum import diagram_of
from heavytop.scene.scene import load_scene

SCENES = ("spherical-pendulum", "sicm-kicked", "inverted-gravity", "separatrix", "force-free",
          "at-rest", "sleeping-marginal")  # fmt: skip
ADVENTURES = {
    "thin": ["start.theta=0.1", "start.psidot=117.19"],  # barely too slow to sleep
    "weightless, at rest": ["top.gMR=0", "start.phidot=0", "start.psidot=0"],
    "fast": ["start.psidot=1e6"],
}


def document_of(name, *overrides):
    found = diagram_of(load_scene(name, overrides)).document()
    return json.loads(json.dumps(found, allow_nan=False))


@pytest.fixture(scope="module")
def falling():
    return document_of("through-bottom")


@pytest.mark.parametrize("name", SCENES)
def test_a_document_holds_the_diagram_of_any_scene(name):
    document = document_of(name)
    edge, window, start = document["edge"], document["window"], document["start"]
    p, energy = np.array(edge["p_phi"]), np.array(edge["E_prime"])
    assert np.all(np.diff(p) > 0)
    assert window["p_phi"][0] <= start["p_phi"] <= window["p_phi"][1]
    assert window["E_prime"][0] <= start["E_prime"] <= window["E_prime"][1]
    slack = 1e-12 * abs(energy).max()
    assert np.interp(start["p_phi"], p, energy) <= start["E_prime"] + 1e-3 * abs(energy).max()
    falls = document["ratio"] is not None and document["ratio"] < 1
    assert (document["focus_focus"] is not None) == falls == (document["circuit"] is not None)
    if document["ratio"] is not None:
        for corner in (document["hanging"], *([] if falls else [document["standing"]])):
            there = energy[p.tolist().index(corner["p_phi"])]
            assert there == pytest.approx(corner["E_prime"], abs=slack)


def test_the_circuit_of_a_document(falling):
    circuit = falling["circuit"]
    assert circuit["winding"] == 1
    assert circuit["monodromy"] == [[1, 0, 0], [0, 1, 0], [-1, 1, 1]]
    turned = circuit["precession"][-1] - circuit["precession"][0]
    assert turned == pytest.approx(2 * np.pi, abs=1e-12)
    assert falling["focus_focus"] == falling["standing"]


def test_the_critical_set_of_a_document(falling):
    """Every row of a sheet is the edge of the diagram of its p_psi; the other line is off both."""
    found = falling["critical_set"]
    focus_focus = found["focus_focus"]
    momentum = max(focus_focus["p_psi"]) / 2
    for sheet, sign in zip(found["sheets"], (1, -1), strict=True):
        b, a, h = (np.array(sheet[name]) for name in ("p_psi", "p_phi", "E_prime"))
        rate = np.array(sheet["rate"], dtype=float)
        assert np.all(np.ptp(b, axis=1) == 0)
        assert np.all(np.sign(rate[np.isfinite(rate)]) == sign)
        np.testing.assert_allclose(h[:, 0], -0.0456, rtol=1e-14)  # hanging
        np.testing.assert_allclose(a[:, 0], -b[:, 0], rtol=1e-14)
        assert np.all(abs(b) <= 2.6001 * momentum)
    p_psi = np.array(focus_focus["p_psi"])
    np.testing.assert_allclose(focus_focus["p_phi"], p_psi)
    assert abs(p_psi).max() ** 2 == pytest.approx(4 * 3.28e-4 * 0.0456)
    sleeping = np.array(found["sleeping"]["p_psi"])
    assert abs(sleeping).min() == pytest.approx(abs(p_psi).max())


@pytest.mark.parametrize("name", ADVENTURES)
def test_every_diagram_can_be_drawn(name, tmp_path):
    document = document_of("sicm-kicked", *ADVENTURES[name])
    figure = energy_momentum_figure(document)
    save(figure, tmp_path / "one.png")
    assert len(figure.axes) == (2 if document["circuit"] else 1)


def test_the_chart_shows_what_the_document_says(falling, tmp_path):
    figure = energy_momentum_figure(falling)
    left, right = figure.axes
    drawn = {line.get_label(): line.get_xydata() for line in (*left.lines, *right.lines)}
    cusps = sorted([place["p_phi"], place["E_prime"]] for place in falling["cusps"])
    np.testing.assert_allclose(drawn["cusps"][[0, -1]], cusps)
    turned = np.array(falling["circuit"]["precession"]) / (2 * np.pi)
    np.testing.assert_array_equal(drawn["Δφ, followed"][:, 1], turned)
    [place] = drawn["the scene: through-bottom"]
    assert place.tolist() == [falling["start"]["p_phi"], falling["start"]["E_prime"]]
    assert any("+1 turn" in text.get_text() for text in right.texts)
    loops = next(
        area
        for area in left.collections
        if to_hex(area.get_facecolor()[0]) == KINDS["loops"].colour.lower()
    )
    spread = loops.get_paths()[0].vertices[:, 0]
    assert abs(spread).max() == pytest.approx(abs(falling["p_psi"]))
    for draw in (energy_momentum_figure, critical_set_figure):
        for name in ("one.svg", "other.svg"):
            save(draw(falling), tmp_path / name)
        assert (tmp_path / "one.svg").read_bytes() == (tmp_path / "other.svg").read_bytes()


def test_without_gravity_there_is_no_focus_focus_line_to_draw():
    with pytest.raises(ValueError, match="without gravity"):
        critical_set_figure(document_of("force-free"))
