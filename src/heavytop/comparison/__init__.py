"""Published and user-written methods of integration, with which the Taylor integrator is compared.

Every method is a row of `METHODS` and, once set up by `make_stepper`, a
`heavytop.comparison.steppers.Stepper`. Reading the table needs none of the libraries (numba,
scipy, CyRK); setting a method up needs its own.
"""

from heavytop.comparison.methods import METHODS, MethodEntry, make_stepper, named
from heavytop.comparison.steppers import IntegrationFailed

__all__ = ["METHODS", "IntegrationFailed", "MethodEntry", "make_stepper", "named"]
