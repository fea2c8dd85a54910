"""All methods by name, as studies take them: Taylor in every form, auto, published, users'."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import cache, partial
from itertools import product
from typing import Any, Final, TypeVar

from heavytop.comparison import methods as comparison
from heavytop.comparison import user
from heavytop.comparison.adaptive import scipy_stepper
from heavytop.comparison.methods import BY_TOLERANCE, DECADES, METHODS, MethodEntry, entry
from heavytop.doctor import versions
from heavytop.equations.formulation import why_not
from heavytop.equations.registry import FORMULATIONS
from heavytop.errors import Fault, Impossible, MissingPackage, Refused, refuse
from heavytop.exact.decimals import bits_of
from heavytop.exact.pairs import EPSILON
from heavytop.results.stress import AUTO
from heavytop.run.plan import closed_form_of
from heavytop.run.planning import plan_steps
from heavytop.scene.arguments import Reader, one_of, parse_names, parse_options
from heavytop.scene.scene import Scene
from heavytop.studies.journal import Parameters
from heavytop.text import nearest

T = TypeVar("T")

MPFR_BITS: Final = 128
AUTO_DIGITS, AUTO_MOST = 12, 30
BROUWER: Final = 1e-18  # heyoka's own advice for Brouwer's law, with compensated sums


def method(text: str) -> MethodEntry:
    """Return the method that a text names.

    Parameters
    ----------
    text : str
        ``NAME`` or ``NAME=SETTING``: a tolerance, or steps per nutation period.

    Raises
    ------
    Refused
        There is none of this name, or the setting is outside its bounds.

    Examples
    --------
    >>> method("taylor-axis-projected").formulation, method("taylor-cubic=1e-9").setting
    ('axis', 1e-09)
    """
    name, equals, setting = text.partition("=")
    every = {**taylor_methods(), **METHODS}
    try:
        found = every.get(name) or comparison.named(name)
    except Impossible as wrong:
        if ":" in name:
            raise Refused(wrong.faults[0].rule) from None
        ends = ", ".join(filter(None, VARIANTS))
        names = ", ".join([*(f"taylor-{form}" for form in FORMULATIONS), *METHODS])
        rule = f"auto, one of your own (mine.py:rk4) or one of {names}; taylor- with {ends} too"
        raise Refused(rule, nearest(name, (AUTO, *every))) from None
    if not equals:
        return found
    try:
        value = float(setting)
    except ValueError:
        raise Refused(f"a number after the =: {found.set_by}") from None
    if not found.least <= value <= found.most:
        raise Refused(f"{found.set_by} from {found.least:g} to {found.most:g}")
    return replace(found, setting=value)


def _single_setting(x: float) -> dict[str, Any]:
    """Return the fields of a method that has only one setting."""
    return dict.fromkeys(("default", "setting", "least", "most"), x) | {"grid": (x,)}


VARIANTS: Final[Mapping[str, dict[str, Any]]] = {
    "": {},
    "-projected": {"projected": True},
    "-compensated": _single_setting(BROUWER),
    "-mpfr": _single_setting(2.0 ** (1 - MPFR_BITS)) | {"bits": MPFR_BITS},
}
"""The fields in which variants of the Taylor integrator differ, by the end of the name."""


@cache
def taylor_methods() -> Mapping[str, MethodEntry]:
    """Return the Taylor integrator's methods: every formulation, projected or in more bits."""
    found = {}
    limits = {"set_by": BY_TOLERANCE, "least": EPSILON, "most": 1e-2}
    grid = (*(x for x in DECADES if x >= EPSILON), EPSILON)
    for form, formulation in FORMULATIONS.items():
        about = {"language": "compiled by heyoka", "formulation": form, "short": form}
        plain = entry(f"taylor-{form}", EPSILON, None, grid=grid, **limits, **about)
        for end, differs in VARIANTS.items():
            if "projected" not in differs or not why_not(formulation.build()):
                found[plain.name + end] = replace(plain, name=plain.name + end, **differs)
    return found


# --- auto ------------------------------------------------------------------------------------


def auto_digits(text: str) -> int:
    """Return the digits of ``auto=DIGITS``, the usual ones of ``auto``, or 0 of any other text.

    Raises
    ------
    Refused
        They are no digits.
    """
    name, equals, digits = text.partition("=")
    if name == AUTO and equals:
        if not digits.isdecimal() or not 1 <= int(digits[:4]) <= AUTO_MOST:
            raise Refused(f"whole digits after auto=, from 1 to {AUTO_MOST}")
        return int(digits)
    return AUTO_DIGITS if name == AUTO else 0


def plan_auto(text: str, scene: Scene, periods: float) -> MethodEntry:
    """Return the method that ``auto`` or ``auto=DIGITS`` stands for in a run of so many periods.

    Raises
    ------
    BadScene
        There is no plan for so many digits.
    """
    wanted = Scene(scene.top, scene.start, periods=periods, quantities=("axis",), events=(),
                   samples=2, digits=auto_digits(text), name=scene.name)  # fmt: skip
    chosen = plan_steps(wanted)
    bits, x = bits_of(chosen.precision), chosen.tolerance
    found = method(f"taylor-{chosen.formulation}{'-projected' * chosen.projected}")
    return replace(found, bits=bits, default=x, setting=x)


def settings(text: str, scene: Scene, periods: float) -> tuple[MethodEntry, ...]:
    """Return the methods of a text in a run of so many periods: one setting, or the whole grid.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> scene = load_scene("sicm-kicked")
    >>> [method.setting for method in settings("taylor-axis=1e-9", scene, 100)]
    [1e-09]
    >>> [(method.name, method.formulation) for method in settings("auto=6", scene, 100)]
    [('auto=6', 'axis')]
    """
    if auto_digits(text):
        return (replace(plan_auto(text, scene, periods), name=text),)
    found = method(text)
    grid = () if "=" in text else found.grid
    return tuple(replace(found, setting=float(x)) for x in grid) or (found,)


def expect_method(text: str) -> str:
    """Return a text that names a method or auto; refuse any other."""
    if not auto_digits(text):
        method(text)
    return text


# --- the methods of a study ------------------------------------------------------------------


def read_methods(file: str, methods: Any, read: Callable[[str], T]) -> tuple[list[T], list[Fault]]:
    """Return `read` of the name of each method, and the faults; users' methods are loaded.

    Faults are named by `file`.
    """
    given = dict[str, Any]()

    def register_and_read(each: Any) -> T:
        try:
            name = user.register(each)
        except Impossible as wrong:
            raise Refused("; ".join(fault.rule for fault in wrong.faults)) from None
        if given.setdefault(name, each) != each:
            raise Refused(f'{name}: another method has this name: give one Method(…, name="…")')
        return read(name)

    return parse_names(file, "methods", methods, register_and_read, (str, user.Method, Callable))


def read_options(
    scene: Scene, methods: Any, options: Mapping[str, object], readers: Mapping[str, Reader],
    read: Callable[[str], str],
) -> tuple[list[str], dict[str, Any]]:  # fmt: skip
    """Return methods and options of a study over nutation periods; refuse all faults at once.

    Raises
    ------
    BadScene
        There is no such method; an option is out of its bounds; nothing nutates.
    WrongType
        `scene` is no Scene.
    MissingPackage
        No method can run here; it names what the first of them needs.
    """
    motion, file = closed_form_of(scene), scene.name
    values, faults = parse_options(file, options, readers)
    names, wrong = read_methods(file, methods, read)
    if motion.period is None:
        rule = f"no nutation period to count: {motion.kind}"
        faults.append(Fault(file, None, "start", "", rule, "a top that nutates is needed"))
    refuse(faults, wrong)
    needs = [() if auto_digits(name) else method(name).absent for name in names]
    if all(needs):
        raise MissingPackage(names[0], needs[0])
    return names, values


def parameters_of(kind: str, names: Iterable[str], **asked: Any) -> Parameters:
    """Return the parameters of a study of methods, for JSON."""
    methods = [*dict.fromkeys(names)]
    about = {"kind": kind, "methods": methods, "versions": versions()}
    return {**about, **asked, **user.as_parameters(methods)}


# --- the methods of a stress test ------------------------------------------------------------

AUTO_ANGLES: Final = "auto-angles"
BLOCK, CALL = 1000, 50  # steps in a block: fixed, and adaptive ones


@cache
def stress_methods() -> Mapping[str, MethodEntry]:
    """Return the methods of a stress test: auto, Taylor in every form, and published methods.

    ``auto-angles`` is auto with phi and psi wanted. scipy's solvers are called once for the whole
    span (with 0 steps in a block), and unguarded: at a pole nothing warns their user.
    """
    auto = replace(method("taylor-axis"), formulation=AUTO, setting=0.0)
    found = [replace(auto, name=AUTO, short=AUTO), replace(auto, name=AUTO_ANGLES, short="auto:φψ")]
    found += [method(f"taylor-{form}") for form in FORMULATIONS]
    for form, row in product(FORMULATIONS, METHODS.values()):
        if form in row.stress:
            name = row.name if form == row.formulation else f"{row.name}-{form}"
            build: Any = row.build
            differs: dict[str, Any] = {"block": BLOCK if row.fixed else CALL}
            if row.language == "python":
                differs = {"block": 0, "build": partial(build, guarded=False)}
            chosen = method(f"{name}={row.stress[form]}")
            found.append(replace(chosen, short=f"{row.short}:{form[0]}", **differs))
    usual = partial(scipy_stepper, "RK45", atol=1e-6, guarded=False)
    defaults = replace(method("dop853-scipy-lagrange=1e-3"), build=usual, block=0, short="ivp:l")
    found.append(replace(defaults, name="solve-ivp-defaults"))
    return {each.name: each for each in found}


def stress_method(text: str) -> MethodEntry:
    """Return a method of a stress test by name: one of `stress_methods`, or a user's.

    Raises
    ------
    Refused
        There is none.
    """
    if text in stress_methods() or ":" not in text:
        return one_of(stress_methods())(text)
    found = method(text)
    return replace(found, name=text, block=BLOCK if found.fixed else CALL)
