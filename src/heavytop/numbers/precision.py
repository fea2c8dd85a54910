"""The working precision of ball arithmetic, which flint keeps once for the whole process."""

from __future__ import annotations

from threading import RLock
from typing import Final

from flint import ctx

_LOCK: Final = RLock()


class working:
    """A working precision in bits, this thread's alone while the block runs.

    Blocks may be nested; each puts back the precision it found. Whatever computes with balls
    belongs inside one: outside, another thread may change the precision between two operations.

    Parameters
    ----------
    bits : int
        The precision, at least 2.

    Raises
    ------
    ValueError
        `bits` is less than 2.

    Examples
    --------
    >>> from flint import arb
    >>> with working(200):
    ...     print(arb.pi().rel_accuracy_bits() > 190)
    True
    """

    __slots__ = ("_before", "_bits")

    def __init__(self, bits: int) -> None:
        self._bits = bits

    def __enter__(self) -> None:
        _LOCK.acquire()
        self._before = ctx.prec
        try:
            ctx.prec = self._bits
        except BaseException:
            _LOCK.release()
            raise

    def __exit__(self, *raised: object) -> None:
        ctx.prec = self._before
        _LOCK.release()
