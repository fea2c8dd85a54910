"""Methods of integration: the Taylor integrator in every form, and those of others, in one table.

A setting, such as a tolerance or a number of steps, is a field of a method.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from typing import Any, Final

from heavytop.comparison import methods as comparison
from heavytop.comparison import own as own_methods
from heavytop.comparison.methods import TOLERANCE, MethodEntry
from heavytop.equations.formulation import FORMULATIONS
from heavytop.errors import BadScene, Fault, Impossible
from heavytop.integration.bits import DOUBLE, bits_of, why_not
from heavytop.run.planning import EPSILON, plan_steps
from heavytop.scene.arguments import Refused, one_of, shown
from heavytop.scene.scene import Scene
from heavytop.text import nearest

MPFR_BITS: Final = 128
DEFAULT: Final = (
    "taylor-axis",
    "taylor-axis-projected",
    "taylor-cubic",
    "dop853-cyrk",
    "sofroniou-spaletta10",
    "gauss8",
)
AUTO: Final = "auto"
AUTO_DIGITS, AUTO_MOST = 12, 30
BROUWER: Final = 1e-18  # heyoka's own advice for Brouwer's law, with compensated sums
SLOW: Final = 10_000  # periods: what takes a millisecond and more for each goes no farther


@dataclass(frozen=True, slots=True, kw_only=True)
class MethodSetting(MethodEntry):
    """One method of integration, as it will be run: an entry with a setting.

    Attributes
    ----------
    setting : float
        What its accuracy is asked for by: see `set_by`.
    bits : int
        Of the numbers it computes in.
    projected : bool
    changed : bool
        Whether the setting is another than the usual one.
    short : str
        Its heading in a stress test.
    atol : float or None
        The absolute tolerance, where it is not the relative one.
    solver : str
        scipy's solver, where it is called once for the whole span; empty where it goes in blocks.
    """

    setting: float
    bits: int = DOUBLE
    projected: bool = False
    changed: bool = False
    short: str = ""
    atol: float | None = None
    solver: str = ""

    @property
    def is_rival(self) -> bool:
        """Whether it is a method of others, or one's own."""
        return self.build is not None

    @property
    def published_order(self) -> int | None:
        """Its order; None where it varies, and of one's own, of which it is measured."""
        return self.order if self.source else None

    @property
    def states(self) -> str:
        """What its states are: a formulation, or the variables of a method of one's own."""
        return self.variables or self.formulation

    @property
    def reach(self) -> float:
        """The longest run [nutation periods]: a slow method goes no farther."""
        return SLOW if self.bits > DOUBLE or self.language == "python" else float("inf")

    @property
    def text(self) -> str:
        """What asks for this method: its name, with the setting where it is not the usual one."""
        setting = repr(self.setting).removesuffix(".0")
        return f"{self.name}={setting}" if self.changed else self.name

    @property
    def label(self) -> str:
        """The name with the setting, for a person."""
        return f"{self.name}={self.setting:.3g}"

    @property
    def set_to(self) -> str:
        """The setting in a few letters; empty for auto, which chooses.

        Examples
        --------
        >>> method("gauss8=32").set_to, method("taylor-axis").set_to
        ('32/period', '2.2e-16')
        """
        if self.formulation == AUTO:
            return ""
        if self.fixed:
            return f"{self.setting:g}/period"
        mantissa, _, power = f"{self.setting:.1e}".partition("e")
        return f"{float(mantissa):g}e{int(power)}"


class NoMethod(Refused):
    """What is no method, and the rule that says so; `hint` may name the one that was meant."""


def method(text: str) -> MethodSetting:
    """Return the method that a text asks for.

    Parameters
    ----------
    text : str
        ``NAME`` or ``NAME=SETTING``: a tolerance, or steps per nutation period.

    Raises
    ------
    NoMethod
        There is none of this name, or the setting is outside its bounds.

    Examples
    --------
    >>> method("taylor-axis-projected").formulation, method("taylor-cubic=1e-9").setting
    ('axis', 1e-09)
    """
    name, equals, setting = text.partition("=")
    found = _named(name)
    if not equals:
        return found
    try:
        value = float(setting)
    except ValueError:
        raise NoMethod(f"a number after the =: {found.set_by}") from None
    if not found.least <= value <= found.most:
        raise NoMethod(f"{found.set_by} from {found.least:g} to {found.most:g}")
    return replace(found, setting=value, changed=value != found.setting)


def auto_digits(text: str) -> int:
    """Return the digits of ``auto=DIGITS``, or the usual ones of ``auto``.

    Raises
    ------
    NoMethod
        They are no digits.
    """
    _, equals, digits = text.partition("=")
    if not equals:
        return AUTO_DIGITS
    if not digits.isdecimal() or not 1 <= int(digits[:4]) <= AUTO_MOST:
        raise NoMethod(f"whole digits after auto=, from 1 to {AUTO_MOST}")
    return int(digits)


def planned(text: str, scene: Scene, periods: float) -> MethodSetting:
    """Return the method that ``auto`` or ``auto=DIGITS`` stands for in a run of so many periods.

    Its name is the text.

    Raises
    ------
    BadScene
        There is no plan for so many digits.
    """
    wanted = Scene(scene.top, scene.start, periods=periods, quantities=("axis",), events=(),
                   samples=2, digits=auto_digits(text), name=scene.name)  # fmt: skip
    chosen = plan_steps(wanted)
    found = method(f"taylor-{chosen.formulation}")
    return replace(found, name=text, projected=chosen.projected,
                   bits=bits_of(chosen.precision), setting=chosen.tolerance)  # fmt: skip


def is_auto(text: str) -> bool:
    """Whether a text is ``auto`` or ``auto=DIGITS``."""
    return text.partition("=")[0] == AUTO


def admitted(methods: Any, file: str) -> Any:
    """Return the names of methods that a person gave, those of their own loaded.

    Raises
    ------
    BadScene
        One cannot be loaded, or two have one name; the faults name `file`.
    """
    if not isinstance(methods, Sequence) or isinstance(methods, str | bytes):
        return methods  # names, or refused where it is read
    names, faults, given = [], [], dict[str, Any]()
    for each in methods:
        try:
            known = isinstance(each, str | own_methods.Method) or callable(each)
            names.append(own_methods.admit(each) if known else each)
        except Impossible as wrong:
            rules = "; ".join(rule for _, rule in wrong.broken)
            faults.append(Fault(file, None, "methods", shown(each), rules))
        else:
            if not isinstance(each, str) and known and given.setdefault(names[-1], each) != each:
                rule = 'another method has this name: give one its own, Method(…, name="…")'
                faults.append(Fault(file, None, "methods", names[-1], rule))
    if faults:
        raise BadScene(tuple(faults))
    return names


def _named(name: str) -> MethodSetting:
    own = taylor_methods()
    if name in own:
        return own[name]
    try:
        return _of(comparison.named(name))
    except Impossible as wrong:
        if ":" in name:
            raise NoMethod(wrong.broken[0][1]) from None
        known = ("auto", *own, *comparison.METHODS)
        rule = f"one of mine.py:rk4, {_in_words()}"
        raise NoMethod(rule, nearest(name, known)) from None


def _in_words() -> str:
    """Return all names, those of the Taylor integrator's in every formulation at once."""
    own = taylor_methods()
    rivals = ", ".join(comparison.METHODS)
    first = next(iter(FORMULATIONS))
    patterns = [n.replace(first, "FORM") for n, each in own.items() if each.formulation == first]
    return f"auto, {rivals}, {', '.join(patterns)}; FORM: {', '.join(FORMULATIONS)}"


@cache
def taylor_methods() -> Mapping[str, MethodSetting]:
    """Return the Taylor integrator's methods: every formulation, projected or in more bits."""
    found = [each for form in FORMULATIONS for each in _of_formulation(form)]
    return {each.name: each for each in found}


def _of_formulation(form: str) -> list[MethodSetting]:
    about = {"order": None, "default": EPSILON, "block": 0, "build": None, "source": ""}
    limits = {"set_by": TOLERANCE, "least": EPSILON, "most": 1e-2, "setting": EPSILON}
    asked: dict[str, Any] = about | limits | {"formulation": form}
    plain = MethodSetting(name=f"taylor-{form}", language="compiled by heyoka", **asked)
    found = [plain]
    if not why_not(FORMULATIONS[form].build()):
        found.append(replace(plain, name=f"{plain.name}-projected", projected=True))
    tight = replace(plain, name=f"{plain.name}-compensated")
    found.append(replace(tight, setting=BROUWER, least=BROUWER, most=BROUWER))
    least = 2.0 ** (1 - MPFR_BITS)
    precise = replace(plain, name=f"{plain.name}-mpfr", bits=MPFR_BITS)
    return [*found, replace(precise, setting=least, least=least, most=least)]


def _of(rival: MethodEntry) -> MethodSetting:
    known = {each.name: getattr(rival, each.name) for each in fields(rival)}
    return MethodSetting(**known, setting=rival.default)


# --- what is put under stress ----------------------------------------------------------------

ANGLES: Final = "auto-angles"
FORMS: Final = ("axis", "attitude", "cubic", "routh", "subsystem", "lagrange")
TIGHT: Final = {"DOP853": 1e-12, "LSODA": 1e-11, "Radau": 1e-8}  # as far as each goes in good time


@cache
def stress_methods() -> Mapping[str, MethodSetting]:
    """Return what a stress test runs: auto, every form of the equations, and what others use.

    ``auto-angles`` is auto with phi and psi wanted.
    """
    auto = replace(method("taylor-axis"), formulation=AUTO)
    found = [replace(auto, name=AUTO, short=AUTO), replace(auto, name=ANGLES, short="auto:φψ")]
    found += [replace(method(f"taylor-{form}"), short=form) for form in FORMS]
    for end, short in (("", "a"), ("-lagrange", "l")):
        for solver, tolerance in TIGHT.items():
            each = method(f"{solver.lower()}-scipy{end}={tolerance}")
            found.append(replace(each, solver=solver, short=f"{solver.lower()}:{short}"))
    compiled = (
        ("blanes-moan-rkn6=64", "rkn6"),
        ("gauss8=32", "gauss8"),
        ("dop853-cyrk=1e-12", "cyrk"),
    )
    found += [replace(method(text), short=f"{short}:a") for text, short in compiled]
    defaults = replace(method("dop853-scipy-lagrange=1e-3"), solver="RK45", atol=1e-6)
    found.append(replace(defaults, name="solve-ivp-defaults", short="ivp:l"))
    return {each.name: each for each in found}


def stress_method(text: str) -> MethodSetting:
    """Return what a stress test runs by this name: one of its table, or one's own.

    Raises
    ------
    NoMethod
        There is none.
    """
    if text in stress_methods() or ":" not in text:
        return one_of(stress_methods(), "heavytop stress --list")(text)
    found = method(text)
    return replace(found, name=text, short=text.partition("=")[0].rpartition(":")[2])
