"""The Lagrangian is built from the rotation matrix, whose angular velocity generates it."""

import sympy as sp

from heavytop.equations import lagrangian as lag
from heavytop.equations.lagrangian import normal_form


def test_the_rotation_is_orthogonal_and_the_angular_velocity_generates_it():
    R, omega = lag.rotation(), lag.angular_velocity()
    assert (R.T * R).applyfunc(normal_form) == sp.eye(3)
    difference = R.applyfunc(lag.time_derivative) - R * omega.hat()
    assert difference.applyfunc(normal_form) == sp.zeros(3)
