"""Exact real numbers: what a scene says, kept without rounding until a precision is asked for.

A number is a sum of terms, each a rational coefficient times powers of π, of square roots, of
cosines and sines, and of other sums. Rationals stay rationals, like terms are merged and roots are
brought to one form, so that many zeros are *proved* (√8 − 2√2, cos(π/3) − 1/2). Every other
question is answered by ball arithmetic at rising precision.

flint is imported only when an irrational number has to be evaluated.
"""

from heavytop.numbers.exact import ONE, PI, Exact, Number, acos, asin, atan, cos, sin, sqrt

__all__ = ["ONE", "PI", "Exact", "Number", "acos", "asin", "atan", "cos", "sin", "sqrt"]
