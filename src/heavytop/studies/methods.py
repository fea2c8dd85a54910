"""Methods of a drift study: the Taylor integrator in every form, and its rivals, in one table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib.util import find_spec
from typing import Final

from heavytop.comparison import methods as comparison
from heavytop.equations.formulation import FORMULATIONS
from heavytop.errors import Impossible
from heavytop.integration.bits import DOUBLE, LONG_DOUBLE
from heavytop.integration.projection import why_not
from heavytop.names import nearest
from heavytop.run.planning import EPSILON
from heavytop.scene.arguments import Refused

MPFR_BITS: Final = 128
DEFAULT: Final = (
    "taylor-axis",
    "taylor-axis-projected",
    "taylor-cubic",
    "dop853-cyrk",
    "sofroniou-spaletta10",
    "gauss8",
)
SOURCE: Final = "Jorba & Zou, Experimental Mathematics 14 (2005) 99-117; heyoka"
TOLERANCE: Final = "tolerance"
SLOW: Final = 10_000  # periods: what takes a millisecond and more for each goes no farther


@dataclass(frozen=True, slots=True)
class Method:
    """One method of integration, as it will be run.

    Attributes
    ----------
    name : str
        As in the table: ``taylor-axis-projected``, ``dop853-cyrk``.
    formulation : str
    language : str
        Of the right-hand side.
    setting : float
        What its accuracy is asked for by: see `set_by`.
    set_by : str
        ``tolerance`` or ``steps a period``.
    least, most : float
        Bounds of the setting.
    order : int or None
        Of the method; None where it chooses.
    reach : float
        Nutation periods it goes to at most, for its slowness.
    needs : tuple of str
        Packages it cannot do without.
    source : str
        Where the method was published.
    bits : int
        Of the numbers it computes in.
    projected, is_rival : bool
    """

    name: str
    formulation: str
    language: str
    setting: float
    set_by: str
    least: float
    most: float
    order: int | None
    reach: float
    needs: tuple[str, ...]
    source: str
    bits: int = DOUBLE
    projected: bool = False
    is_rival: bool = False
    changed: bool = False

    @property
    def absent(self) -> tuple[str, ...]:
        """Packages it needs that are not installed."""
        return tuple(package for package in self.needs if find_spec(package) is None)

    @property
    def text(self) -> str:
        """What asks for this method: its name, with the setting where it is not the usual one."""
        return f"{self.name}={shortest(self.setting)}" if self.changed else self.name


class NoMethod(Refused):
    """What is no method, and the rule that says so; `hint` may name the one that was meant."""


def method(text: str) -> Method:
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


def _named(name: str) -> Method:
    own = taylor_methods()
    if name in own:
        return own[name]
    try:
        return _of(comparison.named(name))
    except Impossible:
        known = ("auto", *own, *comparison.METHODS)
        raise NoMethod(f"one of {_in_words()}", nearest(name, known)) from None


def _in_words() -> str:
    """Return all names, those of the Taylor integrator's in every formulation at once."""
    own = taylor_methods()
    rivals = ", ".join(comparison.METHODS)
    first = next(iter(FORMULATIONS))
    patterns = [n.replace(first, "FORM") for n, each in own.items() if each.formulation == first]
    return f"auto, {rivals}, {', '.join(patterns)} with FORM one of {', '.join(FORMULATIONS)}"


@cache
def taylor_methods() -> Mapping[str, Method]:
    """Return the Taylor integrator's methods: every formulation, projected or in more bits."""
    found = [each for form in FORMULATIONS for each in _of_formulation(form)]
    return {each.name: each for each in found}


def _of_formulation(form: str) -> list[Method]:
    plain = Method(
        name=f"taylor-{form}",
        formulation=form,
        language="compiled by heyoka",
        setting=EPSILON,
        set_by=TOLERANCE,
        least=EPSILON,
        most=1e-2,
        order=None,
        reach=float("inf"),
        needs=(),
        source=SOURCE,
    )
    found = [plain]
    if not why_not(FORMULATIONS[form].build()):
        found.append(replace(plain, name=f"{plain.name}-projected", projected=True))
    for name, bits in (("longdouble", LONG_DOUBLE), ("mpfr", MPFR_BITS)):
        least = 2.0 ** (1 - bits)
        precise = replace(plain, name=f"{plain.name}-{name}", bits=bits, reach=SLOW)
        found.append(replace(precise, setting=least, least=least, most=least))
    return found


def _of(rival: comparison.Method) -> Method:
    return Method(
        name=rival.name,
        formulation=rival.formulation,
        language=rival.language,
        setting=rival.default,
        set_by=rival.setting,
        least=rival.least,
        most=rival.most,
        order=rival.order,
        reach=SLOW if rival.language == "python" else float("inf"),
        needs=rival.needs,
        source=rival.source,
        is_rival=True,
    )


def shortest(x: float) -> str:
    """Return the shortest text that reads back as a number.

    Examples
    --------
    >>> shortest(200.0), shortest(1e-9), shortest(1234.5671)
    ('200', '1e-09', '1234.5671')
    """
    return repr(x).removesuffix(".0")
