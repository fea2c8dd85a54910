"""Every way to say a start, held to the attitude, the rates and the constants it was made from."""

import math
import re
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import heavytop as ht
from heavytop.exact import PI, sqrt
from heavytop.scene.scene import read_scene

from ..motions import BOOK, CONE
from .test_scene_file import faults

TOP = ht.Top("1.2", "0.7", "2.5")
RATES = ("thetadot", "phidot", "omega3")


def rotated(q):
    """The matrix of a quaternion, scalar first."""
    return Rotation.from_quat(q, scalar_first=True).as_matrix()


def moving(start):
    """The attitude and the angular velocity in space that the closed form begins with."""
    record = ht.Motion(TOP, start).at(0.0)
    return rotated(np.array(record.quaternion)), np.array(record.omega)


@pytest.mark.parametrize("numbers", np.random.default_rng(5).normal(size=(6, 7)))
def test_a_rotation_or_a_quaternion_with_any_rates_is_the_start_it_says(numbers):
    q, omega = numbers[:4], numbers[4:]
    R = rotated(q)
    starts = [
        ht.State.from_quaternion(q.tolist(), omega_body=omega.tolist()),
        ht.State.from_rotation(R.tolist(), omega_body=omega.tolist()),
        ht.State.from_quaternion((-q).tolist(), omega_space=(R @ omega).tolist()),
    ]
    angles = {name: float(getattr(starts[0], name)) for name in ("theta", "phi", "psi")}
    starts += [ht.State(**angles, omega_body=omega), ht.State(**angles, omega_space=R @ omega)]
    rates = {name: float(getattr(starts[0], name)) for name in RATES}
    starts.append(ht.State.from_quaternion(q.tolist(), **rates))
    for start in starts:
        attitude, turning = moving(start)
        assert np.abs(attitude - R).max() < 1e-14
        assert np.abs(turning - R @ omega).max() < 1e-13


@pytest.mark.parametrize("omega", [(0, 0, 2), (1, 2, 3), (-1, 0, 3), (0, -2, 1)])
@pytest.mark.parametrize("q", [(1, 0, 0, 0), (0.6, 0, 0, -0.8), (0, 1, 0, 0), (0, 0.6, 0.8, 0)])
def test_an_axis_on_the_vertical_moves_where_its_angular_velocity_says(q, omega):
    """On a pole φ and ψ are not defined apart: what is held is where the body is a moment later."""
    start = ht.State.from_quaternion(q, omega_body=omega)
    record, h = ht.Motion(TOP, start).at(np.array([0.0, 1e-6])), 1e-6
    R = rotated(np.array(q, float))
    later = rotated(np.array(record.quaternion[1]))
    assert np.abs(later - R @ Rotation.from_rotvec(h * np.array(omega)).as_matrix()).max() < 1e-10


def test_a_start_stays_exact_through_a_rotation():
    start = ht.State.from_quaternion((3, 1, 2, 5), omega_body=("1/3", 0, 7))
    again = read_scene(ht.Scene(TOP, start).to_toml()).start
    assert again == start
    assert again.given == start.given
    still = ht.State.from_quaternion((3, 1, 0, 0), omega3=5)
    assert ht.classify(TOP, still).tags == ("start-at-rest",)
    turned = [[1, 0, 0], [0, "cos(0.95)", "-sin(0.95)"], [0, "sin(0.95)", "cos(0.95)"]]
    assert float(ht.State.from_rotation(turned).theta) == 0.95


START = ht.State("0.8", thetadot="1.5", phidot="-2", omega3="3.25")


def constants(start):
    values = ht.Motion(TOP, start).constants
    numbers = {name: str(getattr(values, name)) for name in ("E", "E_prime", "p_phi", "p_psi")}
    return numbers | {"theta": start.theta, "thetadot": start.thetadot, "omega3": start.omega3}


@pytest.mark.parametrize("energy", ["E", "E_prime"])
@pytest.mark.parametrize("spin", ["p_psi", "omega3"])
@pytest.mark.parametrize("unknown", ["energy", "p_phi", "spin", "theta", "thetadot"])
def test_any_four_constants_lead_back_to_the_motion(energy, spin, unknown):
    known, same = constants(START), {"energy": energy, "spin": spin}
    names = {"energy", "p_phi", "spin", "theta", "thetadot"} - {unknown}
    given, found = {name: known[name] for name in (same.get(x, x) for x in names)}, []
    for branch in ("falling", "rising", "forward", "backward"):
        try:
            start = ht.State.from_constants(TOP, **given, branch=branch)
        except ht.ImpossibleStart:
            continue
        found.append([float(getattr(start, n)) for n in ("theta", *RATES)])
        made = constants(start)
        assert all(float(made[n]) == pytest.approx(float(known[n]), rel=1e-13) for n in given)
    expected = [float(getattr(START, n)) for n in ("theta", *RATES)]
    assert any(np.allclose(each, expected, rtol=1e-12) for each in found)


def test_the_branches_of_an_energy_are_its_turning_points():
    known = ht.Motion(TOP, START)
    given = {name: str(getattr(known.constants, name)) for name in ("E", "p_phi", "p_psi")}
    for branch, end in (("falling", known.theta_min), ("rising", known.theta_max)):
        start = ht.State.from_constants(TOP, **given, thetadot=0, branch=branch)
        assert float(start.theta) == pytest.approx(end, rel=1e-14)


def test_constants_without_energy_start_at_rest():
    assert ht.State.from_constants(TOP, p_phi=1, omega3=2, theta=1).thetadot == 0


@pytest.mark.parametrize("which", ["slow", "fast"])
@pytest.mark.parametrize("theta", ["0.7", "2.2"])
@pytest.mark.parametrize("spin", [{"psidot": 9}, {"omega3": -9}])
def test_a_steady_start_stays_at_its_tilt(which, theta, spin):
    start = ht.State.steady(TOP, theta, which=which, **spin)
    verdict, ((name, value),) = ht.classify(TOP, start), spin.items()
    assert (verdict.kind, which in verdict.tags) == ("uniform-precession", True)
    assert float(getattr(start, name)) == value
    again = ht.State.steady(TOP, theta, phidot=start.phidot)
    assert float(again.omega3) == pytest.approx(float(start.omega3), rel=1e-15)


@pytest.mark.parametrize("theta", [-0.2, 7, -7, 30, 1e20, 3.2, "-pi/2", "400 deg", "2*pi-1e-30"])
def test_a_tilt_outside_is_the_same_motion_and_is_said(theta):
    angle = float(ht.Exact.of(theta))
    with pytest.warns(ht.FoldedTiltWarning, match="outside") as said:
        start = ht.State(theta, thetadot="0.3", phi="0.2", psi=1, phidot="0.7", psidot=4)
    R, omega = moving(start)
    assert np.abs(R - Rotation.from_euler("ZXZ", [0.2, angle, 1]).as_matrix()).max() < 1e-13
    node, axis = np.array([math.cos(0.2), math.sin(0.2), 0]), R[:, 2]
    assert np.abs(omega - (0.3 * node + 0.7 * np.eye(3)[2] + 4 * axis)).max() < 1e-13
    assert ((str(said[0].message),), ht.State(PI / 2).notices) == (start.notices, ())
    assert ('degrees are "30 deg"' in start.notices[0]) == (theta == 30)
    assert (start.theta.sign(), (PI - start.theta).sign()) == (1, 1)


LOW = {  # too little energy for these, by what is missing of the constants
    "thetadot": {"p_phi": 5, "p_psi": 1, "theta": 1},
    "p_phi": {"p_psi": 1, "theta": 1, "thetadot": 2},
    "p_psi": {"p_phi": 5, "theta": 1, "thetadot": 2},
    "theta": {"p_phi": 5, "p_psi": 1, "thetadot": 2},
}


@pytest.mark.parametrize("energy", ["E", "E_prime"])
@pytest.mark.parametrize("unknown", LOW)
def test_the_least_energy_that_is_named_is_the_least(energy, unknown):
    (fault,) = faults(ht.State.from_constants, TOP, **LOW[unknown], **{energy: -99})
    assert fault.key == energy
    least = float(re.findall(r"at least (\S+)", fault.rule)[0])
    made = constants(ht.State.from_constants(TOP, **LOW[unknown], **{energy: least + 1e-9}))
    assert all(float(made[n]) == pytest.approx(x, rel=1e-9) for n, x in LOW[unknown].items())
    with pytest.raises(ht.ImpossibleStart):
        ht.State.from_constants(TOP, **LOW[unknown], **{energy: least - 1e-9})


HEAD = "format = 1\n[top]\nA = 1\nC = 0.5\ngMR = 2\n[start]\n"


# what is wrong, the key that is named, and a word of its sentence
@pytest.mark.parametrize(("text", "expected"), {
    "quaternion = [1, 0, 0]": ("quaternion", "4 numbers"),
    "quaternion = [0, 0, 0, 0]": ("quaternion", "not all zero"),
    'quaternion = [1, 0, "2 cm", 0]': ("quaternion", "no unit"),
    "quaternion = [1, 0, 0, 0]\ntheta = 1": ("quaternion", "give theta or quaternion"),
    "rotation = [[1, 0, 0], [0, 1, 0]]": ("rotation", "three rows"),
    "rotation = [[1, 0, 0], [0, 1, 0], [0, 0, 1.1]]": ("rotation", "length 1"),
    "rotation = [[1, 0, 0], [0, 1, 0], [0, 0, -1]]": ("rotation", "reflection"),
    "theta = 1\nomega_body = [1, 2, 3]\nomega_space = [1, 2, 3]": ("omega_space", "not both"),
    "theta = 1\nomega_body = [1, 2, 3]\nphidot = 1": ("phidot", "does not go with"),
    "omega_body = [1, 2, 3]": ("theta", "missing"),
    "theta = 1\npsidot = 1\nomega3 = 1": ("omega3", "give psidot or omega3"),
    "p_phi = 1\ntheta = 1": ("E", "1 more of"),
    "E = 9\np_phi = 1\np_psi = 1\ntheta = 1\nthetadot = 0": ("E", "one too many"),
    'E = 9\np_phi = 1\np_psi = 1\ntheta = 1\nbranch = "up"': ("branch", "one of falling"),
    'E = 9\np_phi = 1\np_psi = 1\ntheta = 1\nbranch = "forward"': ("branch", "here"),
    "E = 1\np_phi = 0.3\np_psi = 1\ntheta = 0.1": ("E", "momenta at rest have theta = 72.54 deg"),
    "E = -9\np_phi = 1\np_psi = 1\nthetadot = 0": ("E", " J with these momenta, which have it at"),
    "E = 9\np_phi = 1\np_psi = 2\ntheta = 0": ("p_phi", "nothing else reaches the vertical"),
    "E = 9\np_phi = 2\ntheta = 0\nthetadot = 0": ("p_psi", "does not follow"),
    'steady = "medium"\ntheta = 1\nomega3 = 9': ("steady", "one of slow, fast"),
    'steady = "slow"\ntheta = 1\nphidot = 9\nomega3 = 9': ("phidot", "does not go with"),
    'steady = "slow"\ntheta = 1\nomega3 = 1': ("omega3", "at least 4.15"),
    'steady = "slow"\ntheta = 1\nomega3 = "30 rpm"': ("omega3", " rad/s in magnitude"),
    'steady = "fast"\ntheta = "pi/2"\nomega3 = 9': ("steady", "no fast rate"),
    'steady = "slow"\ntheta = "pi/2"\nomega3 = 0': ("omega3", "not 0"),
    "steady = true\ntheta = 1": ("phidot", "missing"),
    "steady = true\ntheta = 1\nphidot = 0": ("phidot", "not 0"),
}.items())  # fmt: skip
def test_a_wrong_start_is_refused_by_one_fault_that_says_what_would_be_right(text, expected):
    (fault,), (key, word) = faults(read_scene, HEAD + text), expected
    assert fault.key == f"start.{key}"
    assert word in f"{fault.rule} {fault.hint}"


def test_a_start_that_follows_from_a_wrong_top_is_read_all_the_same():
    head = HEAD.replace("A = 1", "A = 0")
    for theta, keys in (('"x"', ["top.A", "start.theta"]), ("1", ["top.A"])):
        start = f'{head}steady = "slow"\ntheta = {theta}\nomega3 = 9'
        assert [fault.key for fault in faults(read_scene, start)] == keys
    with pytest.raises(ht.ImpossibleStart, match="top: a Top"):
        ht.State.steady(None, 1, omega3=9)


# --- exactly --------------------------------------------------------------------------------------

rates = st.floats(-20, 20).map(lambda x: round(x, 9))


@given(st.floats(0.05, 3.09), rates, rates)
def test_psidot_and_omega3_say_the_same(theta, phidot, spin):
    held = ht.State(theta, phidot=phidot, psidot=spin)
    kicked = ht.State.kicked(theta=theta, phidot=phidot, omega3=held.omega3)
    assert (held.held, kicked.held) == ("psidot", "omega3")
    assert kicked.psidot == held.psidot


def test_spin_is_zero_where_none_is_given_and_poles_belong_to_the_tilts():
    assert ht.State("pi/2", phidot=3).psidot == 0
    assert ht.State("pi/3", phidot=3).omega3 == Fraction(3, 2)
    for theta in (0, math.pi, "180 deg", "3.14159265358979323846"):
        assert ht.State(theta).theta == ht.Exact.of(theta)


def test_a_start_from_constants_at_a_turning_point_and_through_the_vertical():
    """At θ = 0 with p_φ = p_ψ, φ̇ has the limit p_ψ/2A and θ̇² = 2(E' − gMR)/A."""
    start = ht.State.from_constants(BOOK, "0.62983125", "0.0006825", "0.008745", "pi/3")
    assert (start.thetadot, start.phidot, start.psidot) == (0, -15, 140)
    top = ht.Top(2, 1, 3)
    start = ht.State.from_constants(top, E=20, p_phi=4, p_psi=4, theta=0)
    assert (start.phidot, start.thetadot) == (1, 3)
    bottom = ht.State.from_constants(top, E=14, p_phi=-4, p_psi=4, theta="pi", branch="rising")
    assert (bottom.phidot, bottom.thetadot) == (-1, -3)


@pytest.mark.reference
def test_steady_precession_of_betschs_gyro_and_without_gravity_and_level():
    slow = ht.State.steady(CONE, "pi/3", "140.6", "slow")
    assert (slow.phidot, slow.psidot, slow.thetadot) == (10, Fraction("135.6"), 0)
    least = 2 * sqrt(CONE.A * CONE.gMR / 2) / CONE.C
    slow, fast = (ht.State.steady(CONE, "pi/3", least, which) for which in ("slow", "fast"))
    assert slow.phidot == fast.phidot
    assert ht.State.steady(CONE, "pi/2", 100, "slow").phidot == CONE.gMR / (CONE.C * 100)
    top = ht.Top(1, 1, 0)
    assert ht.State.steady(top, "pi/3", 2, "slow").phidot == 0
    assert ht.State.steady(top, "pi/3", 2, "fast").phidot == 4
    assert ht.State.steady(top, "pi/3", 0, "slow").phidot == 0
