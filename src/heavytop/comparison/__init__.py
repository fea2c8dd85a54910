"""Rivals: what other people would integrate the top with, to hold the Taylor integrator against.

Every rival is a row of `METHODS` and, once set up by `march`, a
`heavytop.comparison.march.March`. Reading the table needs none
of the libraries (numba, scipy, CyRK); setting a method up needs its own.
"""

from heavytop.comparison.setting_up import march
from heavytop.comparison.table import METHODS, Method, absent, named

__all__ = ["METHODS", "Method", "absent", "march", "named"]
