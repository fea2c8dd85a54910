"""A shipped scene for every kind of motion: each is of its kind by proof, and meets its digits."""

import re
from pathlib import Path

import pytest

import heavytop as ht
from heavytop.run.verify import misses

from ..motions import SCENES, shipped
from ..trajectories import run_of

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "what-a-top-can-do.md").read_text("utf-8")


# scene: (kind, tags)
MOTIONS = {
    "at-rest": ("at-rest", ()),
    "force-free": ("force-free", ("closed-orbit",)),
    "hanging": ("hanging", ()),
    "inverted-gravity": ("loops", ("inverted-gravity",)),
    "lie-group-benchmark": ("loops", ()),
    "near-separatrix": ("waves", ("near-separatrix",)),
    "planar-asymptotic": ("planar-pendulum", ("asymptotic",)),
    "planar-pendulum": ("planar-pendulum", ("swinging", "closed-orbit", "start-at-rest")),
    "planar-rotating": ("planar-pendulum", ("rotating", "closed-orbit")),
    "separatrix": ("separatrix", ()),
    "sicm-dropped": ("cusps", ("start-at-rest",)),
    "sicm-forward": ("waves", ()),
    "sicm-forward-spin-held": ("loops", ()),
    "sicm-kicked": ("loops", ()),
    "sicm-second-edition": ("loops", ()),
    "simo-wong": ("cusps", ("start-at-rest",)),
    "sleeping": ("sleeping", ("stable",)),
    "sleeping-marginal": ("sleeping", ("marginal",)),
    "sleeping-unstable": ("sleeping", ("unstable",)),
    "spherical-pendulum": ("waves", ("spherical-pendulum",)),
    "spherical-top": ("loops", ("spherical-top",)),
    "spin-reversal": ("waves", ("spin-reversal",)),
    "steady-betsch": ("uniform-precession", ("slow", "closed-orbit")),
    "steady-fast": ("uniform-precession", ("fast", "closed-orbit")),
    "steady-single": ("uniform-precession", ("single", "closed-orbit")),
    "through-bottom": ("through-bottom", ()),
    "through-top": ("through-top", ()),
}


def test_every_kind_and_every_tag_has_a_scene():
    assert list(MOTIONS) == SCENES
    assert {kind for kind, _ in MOTIONS.values()} == {*map(str, ht.Kind)} - {"undecided"}


@pytest.mark.parametrize("name", MOTIONS)
def test_its_kind_is_proved(name):
    verdict = shipped(name).verdict
    assert (str(verdict.kind), verdict.tags) == MOTIONS[name]
    assert verdict.certified
    assert not verdict.open_tags


@pytest.mark.parametrize("changes", [(), ("want.digits=30", "want.samples=7")])
@pytest.mark.parametrize("name", MOTIONS)
def test_it_meets_its_digits(name, changes):
    run = run_of(*changes, name=name)
    assert {"theta", "phi", "psi", "axis"} & set(run.scene.quantities)
    assert misses(run).digits == {}


# --- the page ----------------------------------------------------------------------------------


def test_the_page_names_every_scene_and_every_tag():
    named = set(re.findall(r"`([a-z-]+)`", PAGE))
    assert MOTIONS.keys() <= named
    assert named >= {tag for _, tags in MOTIONS.values() for tag in tags}
    assert {str(kind) for kind in ht.Kind} <= named


def test_the_picture_has_a_panel_for_every_kind_and_is_not_too_large(script):
    drawn = {panel[0] for panels in script("draw").KINDS.values() for panel in panels}
    assert drawn <= MOTIONS.keys()
    assert {MOTIONS[name][0] for name in drawn} == {kind for kind, _ in MOTIONS.values()}
    assert {MOTIONS[name][1][:1] for name in drawn} == {tags[:1] for _, tags in MOTIONS.values()}
    assert 100_000 < (ROOT / "docs" / "images" / "kinds.svg").stat().st_size < 360_000
