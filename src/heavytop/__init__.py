"""The axisymmetric heavy top: derived, integrated by Taylor's method, held against the truth.

Names are imported when they are first used, so that ``import heavytop`` costs nothing. Those that
are public stand in ``__init__.pyi``.
"""

import lazy_loader

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
