"""The shipped scenes, integrated, against exact values from outside the package.

The exact values are the closed form of the decimal parameters, evaluated at 50 digits by another
program and cross-checked there against a 133-bit integration (agreement to 1e-37).
"""

import numpy as np
import pytest

import heavytop as ht

# SICM section 2.10: A = 3.28e-4, C = 6.60e-5, gMR = 0.0456, theta0 = 0.1, to t = 2 s
AT_TWO_SECONDS = {
    "sicm-kicked": (0.42694370530965690245, 15.116964095456707822, 236.55741389988304583),
    "sicm-dropped": (0.10034197801825827725, 12.723297224661743492, 267.43844510670482409),
    "sicm-forward-spin-held": (
        0.0073402039616035999567,
        10.202056212530240399,
        299.71994163326388011,
    ),
    "sicm-forward": (0.097999175790862108505, 43.890088225010207381, 236.1891611362196391),
}
BOUND = {"axis": 1e-12, "routh": 1e-12, "subsystem": 1e-12, "lagrange": 1e-11}


@pytest.mark.parametrize("formulation", BOUND)
@pytest.mark.parametrize("scene", AT_TWO_SECONDS)
def test_angles_at_two_seconds(scene, formulation):
    trajectory = ht.propagate(ht.load_scene(scene), formulation=formulation)
    end = trajectory(2.0)
    found = (end.theta, end.phi, end.psi)
    assert np.max(np.abs(np.subtract(found, AT_TWO_SECONDS[scene]))) < BOUND[formulation]


@pytest.mark.parametrize("scene", AT_TWO_SECONDS)
def test_tilt_at_two_seconds_in_the_cubic_form(scene):
    wants = ht.load_scene(scene, overrides=['want.quantities=["theta"]'])
    trajectory = ht.propagate(wants, formulation="cubic")
    assert abs(trajectory(2.0).theta - AT_TWO_SECONDS[scene][0]) < 1e-12
    assert trajectory.events.count("turning") == ht.propagate(wants).events.count("turning")


# The Lie-group heavy-top benchmark (Geradin & Cardona; Bruls, Cardona & Arnold 2012)
LIE_GROUP = {
    0.01: (
        (0.046113597053992541, 0.99893500360930237, -0.001547491785141019),
        (6.6076510932350919, 149.84739395407446, -4.8403614979935789),
    ),
    0.2: (
        (0.60555056137711977, 0.59895768179491916, -0.52398302743000318),
        (86.371693257061342, 92.431658122002961, -80.794450910977386),
    ),
    1.0: (
        (0.17334396409838604, 0.64008859207056878, -0.74849079113358131),
        (20.139786505764021, 96.243343865826055, -113.43442578788221),
    ),
    2.0: (
        (-0.15041682274564176, -0.72416559163689565, -0.6730222695604441),
        (-27.658515525823269, -106.16380414312445, -102.4624638053261),
    ),
}


def test_lie_group_benchmark():
    trajectory = ht.propagate(ht.load_scene("lie-group-benchmark"))
    at = trajectory(list(LIE_GROUP))
    axis, omega = (np.array([v[i] for v in LIE_GROUP.values()]) for i in range(2))
    assert np.max(np.abs(at.axis - axis)) < 5e-15
    assert np.max(np.abs(at.omega - omega)) < 5e-13


@pytest.mark.filterwarnings("ignore::heavytop.errors.MissedDigitsWarning")
def test_lie_group_benchmark_is_seen_by_the_textbook_form_too_but_less_well():
    scene = ht.load_scene("lie-group-benchmark")
    textbook, axis = (ht.propagate(scene, formulation=f) for f in ("lagrange", "axis"))
    truth = np.array(LIE_GROUP[2.0][0])
    errors = [np.max(np.abs(run(2.0).axis - truth)) for run in (textbook, axis)]
    assert errors[1] < errors[0] < 1e-7
    assert textbook.statistics.steps > 10 * axis.statistics.steps


def test_ranges_and_counts_of_the_kicked_top():
    trajectory = ht.propagate(ht.load_scene("sicm-kicked"))
    events = trajectory.events
    kinds = np.array(events.kind)
    theta_max = events.theta[kinds == "theta_max"]
    reversal = events.theta[kinds == "reversal"]
    assert np.max(np.abs(theta_max - 0.51723131823843479801)) < 1e-14
    assert np.max(np.abs(reversal - 0.148027354547)) < 1e-12
    assert (events.count("turning"), events.count("reversal"), events.count("cusp")) == (8, 7, 0)


def test_the_fastest_precession_of_the_dropped_top():
    events = ht.propagate(ht.load_scene("sicm-dropped")).events
    lower = np.array(events.kind) == "theta_max"
    fastest = 2 * 0.0456 / (6.60e-5 * 140)  # 2 gMR / p_psi, exactly
    assert np.max(np.abs(events.phidot[lower] - fastest)) < 1e-12
