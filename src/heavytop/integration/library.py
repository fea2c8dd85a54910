"""heyoka; where it is missing, the one place that says so, and how it is to be had.

Whoever needs it takes it from here. It has wheels for Linux only, so pip installs it there alone.
"""

from heavytop.errors import MissingPackage

try:
    import heyoka as hy
except ModuleNotFoundError as missing:
    raise MissingPackage("integration", ["heyoka"]) from missing

__all__ = ["hy"]
