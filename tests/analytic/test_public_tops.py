"""Tops as people have them (demos, textbooks, threads), with the answers that they have."""

import math

import pytest

import heavytop as ht
from heavytop.scene.scene import read_scene

DEG, RPM = math.degrees(1), 30 / math.pi
TEXTBOOK = 'mass = 0.5\ndistance = "5 cm"\ngravity = 9.807\nA = 12e-4\nC = 4.5e-4'
DISC = 'mass = "8 g"\ndistance = "20 mm"\ngravity = 9.81\nA_cm = 8e-7\nC_cm = 1.6e-6'
SOLID = """gravity = 9.81
solids = [{shape = "disc", radius = "20 mm", thickness = "1e-40 m", centre = "2 cm", mass = "8 g"}]
"""
WHEEL = "A = 0.30854479\nC = 0.20255625\ngMR = 9.81"


def motion(top: str, start: str) -> ht.Motion:
    scene = read_scene(f"format = 1\n[top]\n{top}\n[start]\n{start}\n")
    return ht.Motion(scene.top, scene.start)


ROWS = {  # top, start, kind, least and greatest θ [deg], period [s]; None is not said
    "let go from rest": (TEXTBOOK, 'theta = "60 deg"\npsidot = "1000 rpm"',
                         "cusps", "60", "75.4142", ".175288"),
    "p_phi with omega3": ('A = "2/3"\nC = 1\ngMR = 1.962',
                          'omega3 = 1\np_phi = 0.5\ntheta = "pi/3"\nthetadot = 0.5625',
                          "loops", "56.4782", "137.6440", "2.496449"),
    "E, p_phi, p_psi": ("A = 0.1\nC = 0.05\ngMR = 9.81",
                        'E = 71\np_phi = 2\np_psi = 2.5\ntheta = 0.8\nbranch = "rising"',
                        "loops", "32.3831", "58.9561", ".316659"),
    "matrix and body rates": (
        'A = 1\nC = 1.5\nmass = 1\ndistance = "10 cm"\ngravity = 9.8',
        'rotation = [[1, 0, 0], [0, "cos(0.95)", "-sin(0.95)"], [0, "sin(0.95)", "cos(0.95)"]]\n'
        'omega_body = [0, "sin(0.95)", "0.45 + cos(0.95)"]', "waves", "54.431", "56.023", "6.8427"),
    "quaternion": (
        'A = 1\nC = 1.5\nmass = 1\ndistance = 0.1\ngravity = 9.8',
        'quaternion = ["cos(0.475)", "sin(0.475)", 0, 0]\nomega_space = [0, "-0.45*sin(0.95)",'
        ' "1 + 0.45*cos(0.95)"]', "waves", "54.431", "56.023", "6.8427"),
    "Euler angles and body rates": (
        WHEEL, 'phi = "-40 deg"\ntheta = "35 deg"\nomega_body = [1, 0, 50]',
        "loops", "33.9736", "38.1950", ".201072"),
    "moments of no body": ("A = 0.1\nC = 0.5\ngMR = 4.905",
                           'E = 11\np_phi = 2\np_psi = 2.5\ntheta = 0.8\nbranch = "rising"',
                           "loops", "30.1976", "52.1417", ".280321"),
    "a point mass": ("A = 1\nC = 0\ngMR = 1", 'theta = "pi - 0.8"\nphidot = 0.1',
                     "waves", "134.163", "176.214", "3.272631"),
}  # fmt: skip


no_body = pytest.mark.filterwarnings("ignore::heavytop.ImpossibleBodyWarning")


@no_body  # the textbook's A is less than M R²
@pytest.mark.reference
@pytest.mark.parametrize("name", ROWS)
def test_a_top_as_it_is_said_has_the_answer_to_its_digits(name: str) -> None:
    top, start, kind, *answers = ROWS[name]
    found = motion(top, start)
    assert found.kind == kind
    for value, answer in zip(
        (found.theta_min * DEG, found.theta_max * DEG, found.period), answers, strict=True
    ):
        assert abs(value - float(answer)) <= 0.6 * 10 ** -len(answer.partition(".")[2])


@no_body
@pytest.mark.reference
def test_steady_precessions_as_they_are_asked_for() -> None:
    rates = []
    for which in ("slow", "fast"):
        start = f'steady = "{which}"\ntheta = "60 deg"\npsidot = "1000 rpm"'
        rates.append(float(motion(TEXTBOOK, start).start.phidot) * RPM)
    assert rates == pytest.approx([51.9301, 1148.07], rel=1e-6)
    for disc in (DISC, SOLID):
        found = motion(disc, 'steady = true\ntheta = "30 deg"\nphidot = "1 rev/s"')
        assert float(found.start.psidot) == pytest.approx(164.29310, abs=1e-5)
        assert float(found.start.omega3) == pytest.approx(169.734, abs=1e-3)
        assert found.kind == "uniform-precession"
    assert motion(SOLID, "theta = 1").top.mass == ht.Exact.of("8 g")
