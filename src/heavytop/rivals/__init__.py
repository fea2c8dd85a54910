"""Rivals: what other people would integrate the top with, to hold the Taylor integrator against.

Every rival is a row of `METHODS` and, once set up by `march`, a `heavytop.march.March`. Reading
the table needs none of the libraries (numba, scipy, CyRK); setting a method up needs its own.
"""

from heavytop.rivals.setting_up import march
from heavytop.rivals.table import METHODS, Method, absent, named

__all__ = ["METHODS", "Method", "absent", "march", "named"]
