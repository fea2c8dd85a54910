"""The result of a check of a trajectory from elsewhere."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, ClassVar, Final, NamedTuple

from heavytop.errors import Exit
from heavytop.results.base import Result, error_of, error_text, nonzero
from heavytop.results.table import Fact
from heavytop.scene.quantities import ANGLES, quantity_of
from heavytop.text import printable

CHECKED_QUANTITIES: Final = ("axis", *ANGLES, "energy", "p_phi", "p_psi")
ORIGINS: Final = {"scene": "of the scene", "first row": "of the first row", "fitted": "fitted"}
EVENT_WORDS: Final = {"turning": "turning points", "reversal": "reversals", "cusp": "cusps"}


class Finding(NamedTuple):
    """A convention of the data that has to be undone, or something that they lack.

    Attributes
    ----------
    name : str
        Such as ``degrees`` or ``y-up``.
    sentence : str
        The same as a sentence, with its numbers.
    gain : float or None
        The misfit before it is undone over that after; None where a header declares it.
    """

    name: str
    sentence: str
    gain: float | None = None


class Check(Result):
    """A trajectory from elsewhere compared with the exact motion: conventions, errors, events.

    Attributes
    ----------
    scene : mapping
        ``name`` is where the data are from; ``top`` and ``start``, as doubles, are those of the
        exact motion with which the data are compared.
    origin : {"scene", "first row", "fitted"}
        Where that start is from.
    data : mapping
        The ``file``, how many ``rows``, their ``span`` [s], of every one of the ``columns`` the
        quantity that was taken from it or None, and the quantities that were ``read_as``.
    errors : mapping from str to mapping
        ``max``, ``rms`` and when the error is largest, ``t_max`` [s], by quantity, with conventions
        undone: axis, theta, phi (precession), psi (spin) [rad]; energy E' of max(|E'|, gMR), p_phi
        and p_psi of the larger momentum. None where the data do not give it. ``phase_s`` says how
        far the data run ahead [s].
    digits, digits_as_given : float
        The least number of decimal digits [1] of all that is compared: with the conventions
        undone, and of the data as they are.
    digits_required : float or None
        Digits [1] that the data should have as they are; None in a result that was loaded.
    growth : mapping from str to (float or None)
        The powers [1] of time by which phase, axis and energy grow; None where that is not clear.
    events : mapping from str to (Count or None)
        Turning points, reversals and cusps; None where the exact motion has none to count.
    condition : float
        How far the axis moves at most when every number of the problem changes in its last binary
        digit [rad].
    conventions : tuple of Finding
        Those that are sure, the one of the largest gain first; then those that headers declare.
    alternatives : tuple of mappings
        Where several explain the data alike: the ``names`` and the ``sentence`` of each.
    method : mapping
        Order, what is conserved, the floor of the precision, and a sentence.
    assumed : tuple of str
        What was done to the data, and found in them.
    slip : mapping or None
        The first of the conventions: its ``name`` and ``sentence``, ``error_before``, the RMS
        error of the data as they are (None where they fit no motion), and ``error_after``, what is
        left when all conventions are undone.
    curves : mapping from str to sequence of float
        The errors at the times ``t`` [s], in their units, and ``phase`` [s] at ``phase_t`` [s]: of
        many rows some.
    """

    schema: ClassVar = "heavytop/check/1"
    left_out: ClassVar = ("digits_required",)

    scene: Mapping[str, Any]
    origin: str
    data: Any
    errors: Any
    growth: Mapping[str, float | None]
    events: Mapping[str, Any]
    condition: float
    digits: float
    digits_as_given: float
    conventions: Sequence[Any]
    alternatives: Sequence[Any]
    method: Any
    assumed: Sequence[str]
    slip: Any
    curves: Mapping[str, Any]
    digits_required: float | None = None

    @property
    def name(self) -> str:
        """Where the data are from."""
        return str(self.data.file)

    @property
    def columns(self) -> dict[str, str]:
        """The quantity that was taken from each column; empty where none was."""
        return {name: quantity or "" for name, quantity in self.data.columns.items()}

    @property
    def phase(self) -> Any:
        """The error in phase, how far the data run ahead; None where it cannot be determined."""
        return self.errors.phase_s

    def __str__(self) -> str:
        return "\n".join(f"{name:14}  {text}" for name, text in self.facts())

    def facts(self) -> Iterator[Fact]:
        """Yield the verdict, how the data were read, errors, events, and the method found."""
        yield "verdict", self._verdict()
        first, last = map(_time, self.data.span)
        yield "data", f"{self.data.file}: {self.data.rows} rows from {first} to {last}"
        yield "columns", self._columns_in_words()
        yield "start", f"{ORIGINS[self.origin]}: {nonzero(self.scene['start'], '.10g')}"
        yield from (("assumed", printable(text)) for text in self.assumed)
        for each in self.conventions:
            gain = "" if each.gain is None else f" (undoing it: misfit {each.gain:.1e} smaller)"
            yield "convention", f"{each.name}: {each.sentence}{gain}"
        for some in self.alternatives:
            yield "could be", f"{_names(some)}: {some.sentence}"
        before = f" ({self.digits_as_given:.1f} as given)" if self.conventions else ""
        yield "digits", f"{self.digits:.1f}{before}"
        for name in CHECKED_QUANTITIES:
            if size := self.errors[name]:
                most, rms = error_text(name, size.max), error_text(name, size.rms)
                trend = f", {self.method[name]}" if self.method.get(name) else ""
                yield name, f"{most} at t = {_time(size.t_max)}, RMS {rms}{trend}"
        yield from self._phase_in_words()
        for name, count in self.events.items():
            if count is not None:
                lacks = name != "turning" and self.errors.phi is None
                yield EVENT_WORDS[name], "no φ in the data" if lacks else _count(count)
        change = "effect of a change in the last binary digit of the problem"
        moved = error_of("theta").with_unit(self.condition, form=".1e")
        yield "conditioning", f"{moved}: {change}"

    def _verdict(self) -> str:
        """Return two sentences: the conventions of the data, and their digits without these."""
        names = [each.name for each in self.conventions]
        first = [f"Conventions: {', '.join(names)}."] if names else []
        if self.alternatives:
            first.append(f"It could be {' or '.join(map(_names, self.alternatives))}.")
        good = f"The data have {self.digits:.1f} digits then: {self.method.sentence}."
        other = "other " * any(text.startswith("undone: ") for text in self.assumed)
        return " ".join([*(first or [f"No {other}convention has to be undone."]), good])

    def _columns_in_words(self) -> str:
        """Return the columns that were used, and the others."""
        columns = self.columns.items()
        used = ", ".join(name if name == q else f"{name} ({q})" for name, q in columns if q)
        ignored = ", ".join(name for name, q in columns if not q)
        return printable(f"{used}; ignored: {ignored}" if ignored else used)

    def _phase_in_words(self) -> Iterator[Fact]:
        """Yield the error in phase, or why it cannot be determined."""
        if (phase := self.phase) is not None:
            way, power = "behind" if phase.last < 0 else "ahead", self.growth["phase"]
            grows = "" if power is None else f", grows as t^{power:.1f}"
            lost = "" if phase.lost is None else f"lost at t = {_time(phase.lost, '.3g')}, "
            off = _time(abs(phase.last), ".2e")
            yield "phase", f"{lost}{off} {way} at t = {_time(phase.t)}{grows}"
        elif self.method.no_phase:
            yield "phase", self.method.no_phase

    def problems(self) -> Iterator[tuple[Exit, str]]:
        """Yield a sentence where the data have fewer digits than are required."""
        if self.digits_required is not None and self.digits_as_given < self.digits_required:
            wanted = f"{self.digits_required:g} digits were requested"
            yield Exit.OUT_OF_BOUND, f"{wanted}; the data have {self.digits_as_given:.1f}"


def _time(t: float, form: str = "g") -> str:
    """Return a time with its unit."""
    return quantity_of("t").with_unit(t, form=form)


def _names(some: Any) -> str:
    """Return the names of conventions that together explain the data."""
    return " and ".join(some.names) or "none"


def _count(count: Any) -> str:
    """Return the number of events in the data, and the proved number, in words."""
    found = "too few rows to count" if count.data is None else str(count.data)
    most = f" to {count.exact_most}" if count.exact_most > count.exact else ""
    return f"{found}; exact {count.exact}{most}"
