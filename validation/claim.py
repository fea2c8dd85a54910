"""One line per claim: what was measured, beside its bound."""

from __future__ import annotations

import json
import math
import os
import sys
import tomllib
from collections.abc import Callable
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter
from typing import Any

ASKED = "HEAVYTOP_CLAIMS_ASKED"  # names, with commas between: only these are measured
TOLD = "HEAVYTOP_CLAIMS_TOLD"  # a file that takes a line of JSON for each claim
OF = "HEAVYTOP_CLAIMS_OF"  # the package that they are claims of

failed: list[str] = []


def of_whom() -> None:
    """Leave where Python would import another heavytop than the one that asks."""
    asks, spec = os.environ.get(OF), find_spec("heavytop")
    found = Path(spec.origin).parent if spec and spec.origin else Path()
    if asks and found.resolve() != Path(asks).resolve():
        sys.exit(f"it would measure another heavytop: {found}, not {asks}")


of_whom()


@cache
def register() -> dict[str, dict[str, Any]]:
    """Return the claims of claims.toml by name."""
    text = Path(__file__).with_name("claims.toml").read_text("utf-8")
    return {each["id"]: each for each in tomllib.loads(text)["claim"]}


def claim(statement: str, measured: float, bound: float, name: str | None = None) -> None:
    """Print a claim that `measured` is at most `bound`, and remember whether it holds."""
    holds = bool(measured <= bound)
    if not holds:
        failed.append(statement)
    print(f"{'ok  ' if holds else 'FAIL'} {statement}: {measured:.3g} (bound {bound:.3g})")
    tell(id=name, statement=statement, measured=plain(measured), bound=float(bound), passed=holds)


def most(*found: Any) -> Any:
    """Return the largest of some numbers, as max does, but no number where one of them is none."""
    values = list(found[0]) if len(found) == 1 else list(found)
    return next((value for value in values if value != value), None) or max(values)


def claimed(name: str) -> Callable[[Callable[[], Any]], Callable[[], Any]]:
    """Measure the claim of this name in claims.toml at once, if it is asked for."""

    def measuring(measure: Callable[[], Any]) -> Callable[[], Any]:
        asked = os.environ.get(ASKED) if TOLD in os.environ else None  # alone, a script has all
        if asked is None or name in asked.split(","):
            _hold(register()[name], measure)
        return measure

    return measuring


def _hold(known: dict[str, Any], measure: Callable[[], Any]) -> None:
    package, statement = known.get("needs"), known["statement"]
    if package and find_spec(package) is None:
        reason = f"needs {package}: pip install {package}"
        print(f"skip {statement}: {reason}")
        tell(id=known["id"], skipped=reason)
        return
    try:
        measured = float(measure())
    except Exception as fault:  # whatever it is, the claim does not hold
        why = " ".join(f"{type(fault).__name__}: {fault}".split())
        failed.append(statement)
        print(f"FAIL {statement}: {why}")
        tell(id=known["id"], passed=False, failure=why)
    else:
        claim(statement, measured, known["bound"], known["id"])


def plain(measured: float) -> float | None:
    """Return a number that JSON has, or None."""
    return float(measured) if math.isfinite(measured) else None


def tell(**found: Any) -> None:
    """Write a line for the program that asked, if one did."""
    if path := os.environ.get(TOLD):
        with Path(path).open("a", encoding="utf-8") as file:
            file.write(json.dumps(found) + "\n")


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
