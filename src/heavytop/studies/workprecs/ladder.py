"""The ladder: which methods are tried at which settings, from the loosest to the tightest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from heavytop.comparison.methods import METHODS
from heavytop.equations.formulation import FORMULATIONS
from heavytop.errors import BadScene
from heavytop.integration.bits import DOUBLE, LONG_DOUBLE, bits_of
from heavytop.run.planning import EPSILON, Plan, plan
from heavytop.scene.scene import Scene
from heavytop.studies.methods import TOLERANCE, Method, NoMethod, method

AUTO: Final = "auto"
AUTO_DIGITS: Final = (6, 9, 12)
AUTO_MOST: Final = 30
_LONGEST: Final = 100  # Python refuses to read an int of thousands of digits
WANTS: Final = ("axis", "theta")
FOLDED: Final = "the plan is folded: it goes one period, and no steps after it are there to time"
_PROJECTED: Final = ("axis", "attitude", "cubic")  # what planning projects
_PYTHON: Final = tuple(name for name, row in METHODS.items() if row.language == "python")
SLOWEST: Final = "radau-scipy"
DEFAULT: Final = (
    AUTO,
    *(f"taylor-{form}" for form in FORMULATIONS),
    *(f"taylor-{form}-projected" for form in _PROJECTED),
    *(name for name in METHODS if name not in _PYTHON),
    *(name for name in _PYTHON if name != SLOWEST),
    *(f"taylor-{form}-longdouble" for form in FORMULATIONS),
    *(f"taylor-{form}-mpfr" for form in FORMULATIONS),
    SLOWEST,  # last: what a short budget leaves out
)
_DECADES: Final = tuple(10.0**-k for k in range(3, 16))
_HALF_DECADES: Final = tuple(10.0 ** (-k / 2) for k in range(6, 31))
_LOW_ORDER: Final = tuple(25.0 * 2**k for k in range(10))
STEPS: Final = {  # a period; a decade of error is two or three rungs, where it is no more steps
    "strang": _LOW_ORDER,
    "implicit-midpoint": _LOW_ORDER,
    "bobenko-suris": _LOW_ORDER,
    "blanes-moan-rkn6": (6, 8, 10, 12, 14, 17, 20, 24, 28, 34, 40, 48, 57, 68, 80, 96, 114, 136),
    "kahan-li8": (6, 8, 10, 12, 14, 16, 18, 21, 24, 28, 32, 37, 42, 48, 56, 64, 74, 84),
    "sofroniou-spaletta10": (3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 14, 16, 18, 20, 22, 25, 28, 32),
    "gauss8": (2, 3, 4, 5, 6, 7, 8, 10, 12, 16),
}


@dataclass(frozen=True, slots=True)
class Trial:
    """One method at one setting.

    Attributes
    ----------
    method : Method
        What is run.
    digits : int or None
        That auto was asked for; None where the method is not auto's choice.
    wants : str or None
        What auto was asked for: ``axis`` or ``theta``.
    refused : str
        Why what auto chose cannot be timed; empty where it can.
    """

    method: Method
    digits: int | None = None
    wants: str | None = None
    refused: str = ""

    @property
    def name(self) -> str:
        """What it is called in a table: the method's own name, or ``auto``."""
        return self.method.name if self.digits is None else AUTO

    @property
    def text(self) -> str:
        """The name with the setting, for a person."""
        if self.digits is None:
            return f"{self.method.name}={self.method.setting:.3g}"
        return f"auto ({self.digits} digits of {self.wants})"


def trials(scene: Scene, text: str, periods: float) -> tuple[Trial, ...]:
    """Return what a text asks for: one setting of a method, or all that are on its ladder.

    Parameters
    ----------
    scene : Scene
    text : str
        ``NAME``, ``NAME=SETTING``, ``auto`` or ``auto=DIGITS``.
    periods : float
        How long a run is; auto depends on it.

    Raises
    ------
    NoMethod
        There is none of this name, or the setting is outside its bounds.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> scene = load_scene("sicm-kicked")
    >>> [trial.text for trial in trials(scene, "taylor-axis=1e-9", 100)]
    ['taylor-axis=1e-09']
    >>> [trial.method.name for trial in trials(scene, "auto=6", 100)]
    ['taylor-axis', 'taylor-cubic']
    """
    asked = auto_digits(text)
    if asked is not None:
        return tuple(_planned(scene, wants, digits, periods) for wants in WANTS for digits in asked)
    found = method(text)
    if "=" in text:
        return (Trial(found),)
    return tuple(Trial(method(f"{text}={rung!r}")) for rung in _rungs(found))


def auto_digits(text: str) -> tuple[int, ...] | None:
    """Return the digits for which a text asks auto; None where it asks for a method.

    Raises
    ------
    NoMethod
        It asks auto for what are no digits.

    Examples
    --------
    >>> auto_digits("auto"), auto_digits("auto=12"), auto_digits("gauss8")
    ((6, 9, 12), (12,), None)
    """
    name, equals, setting = text.partition("=")
    if name != AUTO:
        return None
    return (_digits(setting),) if equals else AUTO_DIGITS


def _digits(text: str) -> int:
    found = int(text) if text.isdecimal() and text.isascii() and len(text) < _LONGEST else 0
    if not 1 <= found <= AUTO_MOST:
        raise NoMethod(f"whole digits after auto=, from 1 to {AUTO_MOST}")
    return found


def _rungs(found: Method) -> Sequence[float]:
    if found.set_by != TOLERANCE:
        return STEPS.get(found.name, (found.setting,))
    if found.least == found.most:
        return (found.setting,)
    halves = (
        found.is_rival and found.language != "python"
    )  # a rung costs them more than it costs us
    rungs = [x for x in (_HALF_DECADES if halves else _DECADES) if found.least <= x <= found.most]
    return rungs if found.is_rival else [*rungs, found.least]


def _planned(scene: Scene, wants: str, digits: int, periods: float) -> Trial:
    """Return what a plan for so many digits of this stands for, or why it cannot be timed."""
    wanted = Scene(scene.top, scene.start, periods=periods, quantities=(wants,), events=(),
                   samples=2, digits=digits, name=scene.name)  # fmt: skip
    try:
        chosen = plan(wanted)
    except BadScene as refusal:
        rules = "; ".join(fault.rule for fault in refusal.faults)
        return Trial(method(f"taylor-{wants.replace('theta', 'cubic')}"), digits, wants, rules)
    return Trial(_of(chosen), digits, wants, FOLDED if chosen.folded else "")


def _of(chosen: Plan) -> Method:
    """Return the method that a plan stands for: its form, its bits, its tolerance."""
    name, bits = f"taylor-{chosen.formulation}", bits_of(chosen.precision)
    if bits == DOUBLE:
        loose = f"={chosen.tolerance!r}" if chosen.tolerance > EPSILON else ""
        return method(f"{name}{'-projected' if chosen.projected else ''}{loose}")
    if bits == LONG_DOUBLE:
        return method(f"{name}-longdouble")
    found = method(f"{name}-mpfr")
    if bits == found.bits:
        return found
    least = 2.0 ** (1 - bits)
    return replace(found, name=f"{name}-mpfr{bits}", bits=bits, setting=least, least=least,
                   most=least)  # fmt: skip
