"""Tops as people have them (demos, textbooks, threads), with the answers that they have."""

import math

import pytest

import heavytop as ht
from heavytop.scene.scene import read_scene

DEG = math.degrees(1)
TEXTBOOK = 'mass = 0.5\ndistance = "5 cm"\ngravity = 9.807\nA = 12e-4\nC = 4.5e-4'


WHEEL = "A = 0.30854479\nC = 0.20255625\ngMR = 9.81"


def motion(top, start):
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
    "Euler angles and body rates": (
        WHEEL, 'phi = "-40 deg"\ntheta = "35 deg"\nomega_body = [1, 0, 50]',
        "loops", "33.9736", "38.1950", ".201072"),
    "a point mass": ("A = 1\nC = 0\ngMR = 1", 'theta = "pi - 0.8"\nphidot = 0.1',
                     "waves", "134.163", "176.214", "3.272631"),
}  # fmt: skip


no_body = pytest.mark.filterwarnings("ignore::heavytop.ImpossibleBodyWarning")


@no_body  # the textbook's A is less than M R²
@pytest.mark.reference
@pytest.mark.parametrize("name", ROWS)
def test_a_top_as_it_is_said_has_the_answer_to_its_digits(name):
    top, start, kind, *answers = ROWS[name]
    found = motion(top, start)
    assert found.kind == kind
    for value, answer in zip(
        (found.theta_min * DEG, found.theta_max * DEG, found.period), answers, strict=True
    ):
        assert abs(value - float(answer)) <= 0.6 * 10 ** -len(answer.partition(".")[2])
