"""The closed form on every shipped scene: in doubles, and at 50, 100 and 1000 digits."""

import time
from itertools import pairwise

import numpy as np
import pytest
from flint import arb

import heavytop as ht
from heavytop.numbers.intervals import working
from heavytop.scene.scene import shipped_scenes

SCENES = sorted(shipped_scenes())


def span(scene, motion):
    return float(scene.time) if scene.time is not None else float(scene.periods) * motion.period


@pytest.mark.parametrize("name", SCENES)
def test_doubles_over_the_whole_span(name):
    """θ, 1 ∓ u to 2e-15 of themselves, zeros to 1e-29; φ, ψ to 1e-15 max(1, |x|); 401 times."""
    scene = ht.load_scene(name)
    motion = ht.Motion(scene.top, scene.start)
    t = np.linspace(0.0, span(scene, motion), 401)
    double, bits = motion.at(t), 400
    with working(bits):
        found = motion.rising.solution(bits)
        records = [found.at(arb(x)) for x in t]
        for quantity in ("theta", "phi", "psi", "one_minus_u", "one_plus_u"):
            want = [getattr(record, quantity) for record in records]
            assert all(x.rad() < 1e-40 for x in want)
            values = getattr(double, quantity)
            error = [abs(float(arb(x) - y)) for x, y in zip(values, want, strict=True)]
            size = np.abs([float(x) for x in want])
            allowed = np.maximum(2e-15 * size, 1e-29)
            if quantity in ("phi", "psi"):
                allowed = 1e-15 * np.maximum(1, size)
            assert np.all(error <= allowed), quantity


@pytest.mark.parametrize("name", SCENES)
def test_digits_upon_digits(name):
    """The end at 50, 100 and 1000 digits agrees to the digits of the fewer, within 2 s each."""
    scene = ht.load_scene(name)
    motion = ht.Motion(scene.top, scene.start)
    end = span(scene, motion)
    began = time.process_time()
    records = [motion.at(end, digits=digits) for digits in (50, 100, 1000)]
    assert time.process_time() - began < 6
    for digits, (fewer, more) in zip((50, 100), pairwise(records), strict=True):
        for quantity in ("theta", "phi", "psi"):
            one, other = getattr(fewer, quantity), getattr(more, quantity)
            assert abs(other.context.make_mpf(one._mpf_) - other) <= max(1, abs(other)) * (
                other.context.mpf(10) ** -digits
            )


# the same numbers at 20 digits, by another program; cross-checked there by an integrator
KNOWN = {
    "sicm-kicked": ("0.42694370530965690245", "15.116964095456707822", "236.55741389988304583"),
    "sicm-dropped": ("0.10034197801825827725", "12.723297224661743492", "267.43844510670482409"),
    "sicm-forward": ("0.097999175790862108505", "43.890088225010207381", "236.1891611362196391"),
    "sicm-forward-spin-held": (
        "0.0073402039616035999567", "10.202056212530240399", "299.71994163326388011",
    ),
    "simo-wong": ("0.054220099402661058193", "4.1961910407406375175", "495.80979342433535177"),
}  # fmt: skip


@pytest.mark.parametrize("digits", [25, 1000])
@pytest.mark.parametrize("name", KNOWN)
def test_known_ends(name, digits):
    scene = ht.load_scene(name)
    motion = ht.Motion(scene.top, scene.start)
    at = motion.at(10 if name == "simo-wong" else 2, digits=digits)
    for found, known in zip((at.theta, at.phi, at.psi), KNOWN[name], strict=True):
        ulp = 10.0 ** -(len(known) - 1 - known.index("."))
        assert abs(found - found.context.mpf(known)) < 0.51 * ulp
