"""heyoka; where it is missing, the one place that says so, and how it is to be had.

Whoever needs it takes it from here. It has wheels for Linux only, so pip installs it there alone.
"""

from heavytop.errors import MissingPackage, is_interrupt

try:
    import heyoka as hy
except ImportError as fault:
    if is_interrupt(fault):
        raise KeyboardInterrupt from None
    broken = "" if isinstance(fault, ModuleNotFoundError) else str(fault)
    raise MissingPackage("integration", ["heyoka"], broken=broken) from fault

__all__ = ["hy"]
