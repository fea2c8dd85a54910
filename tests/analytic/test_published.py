"""Intervals, closed form and runs against what others printed.

The exact values are the closed form of the decimal parameters, evaluated at 50 digits by another
program and cross-checked there against a 133-bit integration. A printed number stands for all that
round to it; one that is right holds a whole interval.
"""

from fractions import Fraction

import numpy as np
import pytest

import heavytop as ht
from heavytop.exact.balls import Interval

from ..motions import LIE, LIE_START, shipped
from ..views import Bounds

pytestmark = pytest.mark.reference

# SICM section 2.10, and Simo & Wong 1991: numbers of the motion, a time, and there θ, φ and ψ
PRINTED = {
    "sicm-kicked": (
        {"theta_min": "0.1", "theta_max": "0.51723131823843479801",
         "period": "0.54289551818821995785", "precession": "3.9741816546440002896"},
        2, ("0.42694370530965690245", "15.116964095456707822", "236.55741389988304583"),
    ),
    "sicm-dropped": (
        {"theta_min": "0.1", "theta_max": "0.18124330588605412758",
         "period": "0.40140587019470118608", "precession": "2.5447045765778085269"},
        2, ("0.10034197801825827725", "12.723297224661743492", "267.43844510670482409"),
    ),
    "sicm-forward-spin-held": (
        {"theta_min": "0.0061062066932874334", "theta_max": "0.1",
         "period": "0.30707767486330860938", "precession": "1.6506667427855664099"},
        2, ("0.0073402039616035999567", "10.202056212530240399", "299.71994163326388011"),
    ),
    "sicm-forward": (
        {"theta_min": "0.011325330683010017286",
         "period": "0.40519342773311807625", "precession": "8.8559785436360372515"},
        2, ("0.097999175790862108505", "43.890088225010207381", "236.1891611362196391"),
    ),
    "simo-wong": (
        {"theta_max": "0.054551690224341661691",
         "period": "0.6854584972896153183", "precession": "0.28610768780066136647"},
        10, ("0.054220099402661058193", "4.1961910407406375175", "495.80979342433535177"),
    ),
}  # fmt: skip
# the Lie-group benchmark (Géradin & Cardona; Brüls, Cardona & Arnold 2012): axis and ω in space
LIE_STATES = {
    "0.01": ("0.046113597053992541", "0.99893500360930237", "-0.001547491785141019",
             "6.6076510932350919", "149.84739395407446", "-4.8403614979935789"),
    "0.2": ("0.60555056137711977", "0.59895768179491916", "-0.52398302743000318",
            "86.371693257061342", "92.431658122002961", "-80.794450910977386"),
    "1": ("0.17334396409838604", "0.64008859207056878", "-0.74849079113358131",
          "20.139786505764021", "96.243343865826055", "-113.43442578788221"),
    "2": ("-0.15041682274564176", "-0.72416559163689565", "-0.6730222695604441",
          "-27.658515525823269", "-106.16380414312445", "-102.4624638053261"),
}  # fmt: skip


def printed(text):
    """All numbers that round to the text."""
    return Interval(Fraction(text), Fraction(1, 2 * 10 ** len(text.partition(".")[2])))


@pytest.mark.parametrize("case", PRINTED)
def test_intervals_lie_in_what_is_printed(case):
    """And so do numbers of a thousand digits."""
    (numbers, t, state), found = PRINTED[case], Bounds(shipped(case), 30)
    assert all(getattr(found, name) in printed(text) for name, text in numbers.items())
    for name, text in zip(("theta", "phi", "psi"), state, strict=True):
        assert found(name, t) in printed(text), name
        assert getattr(shipped(case).at(t, 1000), name) in printed(text), name


BOUND = {"axis": 1e-12, "routh": 1e-12, "subsystem": 1e-12, "lagrange": 1e-11}


@pytest.mark.parametrize("formulation", BOUND)
@pytest.mark.parametrize("case", PRINTED)
def test_runs_end_where_is_printed(case, formulation):
    _, t, state = PRINTED[case]
    end = ht.propagate(ht.load_scene(case), formulation=formulation)(float(t))
    exact = np.array(state, float)
    bound = BOUND[formulation] * (np.maximum(1, exact) if t == 10 else 1)
    assert np.all(abs(np.array([end.theta, end.phi, end.psi]) - exact) < bound)


# --- the Lie-group benchmark ------------------------------------------------------------------


def test_the_lie_group_benchmark():
    found = Bounds(ht.Motion(LIE, LIE_START), 30)
    low, middle, high = found.roots
    assert low in printed("-0.99999999999973779144")
    assert middle == Interval(Fraction(0), Fraction(0))
    assert high in printed("3.2053612385329505649")
    assert found.period in printed("0.74520694761676905573")
    assert found.precession in printed("0.6810111281938199783")
    for t, state in LIE_STATES.items():
        assert found("u", t) in printed(state[2])
        at = ht.Motion(LIE, LIE_START).at(Fraction(t), 30)
        for got, want in zip((*at.axis, *at.omega), state, strict=True):
            assert abs(got - Fraction(want)) < 1e-16 * max(1, abs(got))


def test_runs_of_the_lie_group_benchmark():
    states = np.array([*LIE_STATES.values()], float)
    at = ht.propagate(ht.load_scene("lie-group-benchmark"))([0.01, 0.2, 1, 2])
    assert np.max(np.abs(at.axis - states[:, :3])) < 5e-15
    assert np.max(np.abs(at.omega - states[:, 3:])) < 5e-13
