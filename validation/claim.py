"""One line per claim: what was measured, beside its bound."""

from __future__ import annotations

import sys
from collections.abc import Callable
from time import perf_counter

failed: list[str] = []


def claim(statement: str, measured: float, bound: float) -> None:
    """Print a claim that `measured` is at most `bound`, and remember whether it holds."""
    holds = measured <= bound
    if not holds:
        failed.append(statement)
    print(f"{'ok  ' if holds else 'FAIL'} {statement}: {measured:.3g} (bound {bound:.3g})")


def finish() -> None:
    """Leave with exit code 5 if a claim of this script failed."""
    sys.exit(5 if failed else 0)


def interleaved(programs: dict[str, Callable[[], object]], repeats: int = 15) -> dict[str, float]:
    """Return the best time of each program [s], all run in turn so that ratios hold."""
    best = dict.fromkeys(programs, float("inf"))
    for _ in range(repeats):
        for name, program in programs.items():
            began = perf_counter()
            program()
            best[name] = min(best[name], perf_counter() - began)
    return best
