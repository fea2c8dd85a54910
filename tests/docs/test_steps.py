"""The page of Taylor's method: its steps a period, and those that the singularities predict."""

import re
from itertools import pairwise
from pathlib import Path

import mpmath
import numpy as np
import pytest

from heavytop import Motion, load_scene, propagate

PAGE = (Path(__file__).parents[2] / "docs" / "theory" / "taylor.md").read_text("utf-8")
pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")  # of digits that are not met
ROWS = re.findall(r"^\| `([\w-]+)` \|(.*)\|$", PAGE, re.MULTILINE)


def scene_of(name, periods):
    return load_scene(name, overrides=[f"span.periods={periods}", "want.events=[]"])


def steps_a_period(scene, formulation):
    """In every block but the first, whose steps are bounded by those at the start."""
    period = Motion(scene.top, scene.start).period
    marks = propagate(scene, formulation=formulation).orbit.checkpoints
    blocks = pairwise(marks[1:])
    return [(b.steps - a.steps) * period / (b.time[0] - a.time[0]) for a, b in blocks]


def expected(motion, poles_of_angles):
    """e² ∮dt/ρ, with ρ the distance from the nearest of the singularities that the page names."""
    (u1, u2, u3), (m, mc) = motion.roots, motion.modulus
    quarter, other = float(mpmath.ellipk(m)), float(mpmath.ellipk(mc))
    lowest = (1 + u1) / (u2 - u1)
    highest = (1 - u2) * (u3 - u1) / ((u2 - u1) * (u3 - 1))
    v = [float(mpmath.ellipf(mpmath.atan(mpmath.sqrt(x)), mc)) for x in (lowest, highest)]
    x = np.linspace(-quarter, quarter, 20_000)
    rho = np.hypot(x, other)
    if poles_of_angles:
        rho = np.minimum(np.minimum(rho, np.hypot(x, v[0])), np.hypot(quarter - abs(x), v[1]))
    return np.exp(2 + 0.7 / 19) * 2 * quarter * np.mean(1 / rho)


@pytest.mark.parametrize(("name", "cells"), ROWS)
def test_steps_are_as_many_as_the_page_says(name, cells):
    scene = scene_of(name, 700)
    motion = Motion(scene.top, scene.start)
    taken, angles = (steps_a_period(scene, form)[-1] for form in ("axis", "subsystem"))
    found = [taken, expected(motion, False), angles, expected(motion, True)]
    assert [float(cell) for cell in cells.split("|")] == pytest.approx(found, abs=0.06)


def test_steps_lengthen_where_an_angle_grows():
    assert len(ROWS) == 3
    [shown] = re.findall(r"from ([\d.]+) to ([\d.]+) steps a period", " ".join(PAGE.split()))
    growing, kept = (steps_a_period(scene_of("sicm-kicked", 1000), form)
                     for form in ("lagrange", "subsystem"))  # fmt: skip
    assert [float(x) for x in shown] == pytest.approx([growing[0], growing[-1]], abs=0.06)
    assert {f"keeps its {each:.0f}." in PAGE for each in kept} == {True}
