"""The axisymmetric heavy top: derived, integrated by Taylor's method, held against the truth.

Names are imported when they are first used, so that ``import heavytop`` costs nothing. Those that
are public stand in ``__init__.pyi``. One that needs a package which is missing says so when it is
called: completion, ``help`` and ``from heavytop import *`` look at all of them.
"""

import lazy_loader

__version__ = "0.1.0"

_imported, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name):
    try:
        return _imported(name)
    except ImportError as fault:
        from heavytop.errors import MissingPackage

        if not isinstance(fault, MissingPackage):
            raise
        return fault.instead_of(name)
