"""Exact real numbers: what a scene says, kept without rounding until a precision is asked for.

A number is a rational or a tree of operations. Its sign is decided by balls, and where it may be
zero by proof; flint is imported only when an irrational number has to be evaluated.
"""

from heavytop.exact.functions import acos, asin, atan, cos, sin, sqrt, tan
from heavytop.exact.number import ONE, PI, Exact, Number

__all__ = ["ONE", "PI", "Exact", "Number", "acos", "asin", "atan", "cos", "sin", "sqrt", "tan"]
