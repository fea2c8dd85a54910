"""A drift: what a study found, method by method, as root mean squares over the starts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import takewhile
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from heavytop.drifts import checked
from heavytop.drifts.growth import Growth, growth
from heavytop.drifts.methods import Method
from heavytop.drifts.study import Study
from heavytop.errors import MissingPackage
from heavytop.ledger import Book
from heavytop.planning import closed_form_of

if TYPE_CHECKING:
    import xarray

SCHEMA: Final = "heavytop/drift/1"
LOST: Final = 0.05  # of a period: beyond it what is left of a phase error is no measure of it
MEASURED: Final = ("energy", "axis")
MOMENTA: Final = ("p_phi", "p_psi")
Values = tuple[float | None, ...]


@dataclass(frozen=True)
class MethodDrift:
    """How the errors of one method grow.

    Attributes
    ----------
    method : Method
        Which one, with its setting.
    period : float
        T of the scene [s].
    periods : tuple of float, shape (k,)
        Times in nutation periods of each run's own start.
    energy, phase_s, axis : tuple of (float or None), shape (k,)
        RMS over the starts of the error of E' relative to max(|E'|, gMR), of the phase [s], and
        of the axis; None where the formulation does not say, and of the phase from where the
        first run has lost a twentieth of a period: there it measures nothing any more.
    invariants : dict from str to tuple
        The same of the formulation's other invariants, relative.
    steps : float
        Mean number of steps of a run.
    us_per_period : float or None
        Time in the integrator, mean over the runs [µs].
    ended : dict from int to str
        Why runs ended early, by the number of the start.
    skipped : str or None
        Why the method was not run.
    """

    method: Method
    period: float
    periods: tuple[float, ...] = ()
    energy: Values = ()
    phase_s: Values = ()
    axis: Values = ()
    invariants: Mapping[str, Values] | None = None
    steps: float | None = None
    us_per_period: float | None = None
    ended: Mapping[int, str] | None = None
    skipped: str | None = None

    @cached_property
    def energy_growth(self) -> Growth | None:
        """With which power of the time the energy error grows."""
        return growth(self.periods, self.energy)

    @cached_property
    def phase_growth(self) -> Growth | None:
        """With which power of the time the phase error grows."""
        return growth(self.periods, self.phase_s)

    @property
    def energy_exponent(self) -> float | None:
        """The power of the time with which the energy error grows."""
        return None if self.energy_growth is None else self.energy_growth.exponent

    @property
    def phase_exponent(self) -> float | None:
        """The power of the time with which the phase error grows."""
        return None if self.phase_growth is None else self.phase_growth.exponent

    def document(self, *, costs: bool = True) -> dict[str, Any]:
        """Return what is known of the method, for JSON.

        Parameters
        ----------
        costs : bool
            Whether with what it took.
        """
        known = self.invariants or {}
        none = (None,) * len(self.periods)
        others = {name: list(x) for name, x in known.items() if name not in MOMENTA}
        found = {
            "name": self.method.text,
            "formulation": self.method.formulation,
            "language": self.method.language,
            "setting": {self.method.set_by: self.method.setting},
            "us_per_period": self.us_per_period,
            "steps": self.steps,
            "periods": list(self.periods),
            "energy": list(self.energy),
            **{name: list(known.get(name, none)) for name in MOMENTA},
            "invariants": others,
            "phase_s": list(self.phase_s),
            "axis": list(self.axis),
            "energy_exponent": self.energy_exponent,
            "phase_exponent": self.phase_exponent,
            "stderr": {
                "energy": self.energy_growth and self.energy_growth.stderr,
                "phase": self.phase_growth and self.phase_growth.stderr,
            },
            "ended": {str(number): why for number, why in (self.ended or {}).items()},
            "skipped": self.skipped,
        }
        if not costs:
            del found["us_per_period"]
        return found


@dataclass(frozen=True)
class Drift:
    """The result of a drift study; ``drift["strang"]`` is one method.

    Attributes
    ----------
    study : Study
        What was asked: the scene, the methods, how far.
    methods : tuple of MethodDrift
        What was found of each, in the order asked.
    """

    study: Study
    methods: tuple[MethodDrift, ...]

    def __getitem__(self, name: str) -> MethodDrift:
        """Return one method by its name."""
        return next(each for each in self.methods if each.method.text == name)

    def document(self, *, costs: bool = True, files: Mapping[str, str] | None = None) -> Any:
        """Return the document heavytop/drift/1.

        Parameters
        ----------
        costs : bool
            Whether with what runs took; without it there are no wall-clock values.
        files : mapping, optional
            Names of the files that were written, by what they are.
        """
        identity = self.study.identity
        asked = {name: identity[name] for name in ("periods", "ensemble", "samples", "seed")}
        return {
            "schema": SCHEMA,
            "scene": identity["scene"],
            **asked,
            "methods": [each.document(costs=costs) for each in self.methods],
            "files": dict(files or {}),
            "versions": identity["versions"],
        }

    def to_xarray(self) -> xarray.Dataset:
        """Return errors over ``scheme`` and ``mark``, nan where there are none.

        (A dimension called method could not be selected: xarray has an option of that name.)
        """
        import xarray

        width = max((len(each.periods) for each in self.methods), default=0)
        table = {
            name: (("scheme", "mark"), _filled([c(each) for each in self.methods], width), about)
            for name, (c, about) in self._columns().items()
        }
        names = [each.method.text for each in self.methods]
        asked = {name: self.study.identity[name] for name in ("ensemble", "samples", "seed")}
        return xarray.Dataset(
            table,
            coords={"scheme": ("scheme", names, _about("method that was followed"))},
            attrs={"schema": SCHEMA, "title": self.study.scene.title, **asked},
        )

    def _columns(self) -> dict[str, tuple[Callable[[MethodDrift], Values], dict[str, str]]]:
        """Return what a dataset holds: columns of methods, with their names and units."""
        columns: dict[str, tuple[Callable[[MethodDrift], Values], dict[str, str]]] = {
            "periods": (lambda m: m.periods, _about("time in nutation periods")),
            "energy": (lambda m: m.energy, _about("error of E', relative to max(|E'|, gMR)")),
            "phase_s": (lambda m: m.phase_s, _about("phase error of the nutation", "s")),
            "axis": (lambda m: m.axis, _about("distance of the axis, a unit vector")),
        }
        others = {name: None for each in self.methods for name in each.invariants or {}}
        for name in others:
            columns[name] = (partial(_invariant, name), _about(f"error of {name}, relative"))
        return columns


def gathered(study: Study, book: Book) -> Drift:
    """Return the drift that the runs of a study add up to.

    Parameters
    ----------
    study : Study
    book : Book
        Where all of its tasks are at their end.
    """
    return Drift(study, tuple(_method(study, each, book) for each in study.methods))


def _method(study: Study, method: Method, book: Book) -> MethodDrift:
    nothing = MethodDrift(method, float(closed_form_of(study.scene).period or 0.0))
    if method.absent:
        return replace(nothing, skipped=str(MissingPackage(method.name, method.absent)))
    tasks = [study.task_name(method, number) for number in range(study.ensemble)]
    entries = [book.entry(task) for task in tasks]
    if failed := [entry.failed for entry in entries if entry.failed]:
        return replace(nothing, skipped=failed[0])
    runs = checked.runs(book, tasks, study.marks(method))
    gone = sum(run.periods for run in runs)
    spent = sum(map(book.spent_s, tasks))
    return replace(
        nothing,
        **_errors([run.rows for run in runs], LOST * nothing.period),
        steps=float(np.mean([run.steps for run in runs])),
        us_per_period=spent / gone * 1e6 if gone else None,
        ended={i: run.ended for i, run in enumerate(runs) if run.ended},
    )


def _errors(runs: Sequence[Sequence[Mapping[str, Any]]], lost: float) -> dict[str, Any]:
    """Return the RMS errors over runs, at the marks that all of them passed."""
    common = min(map(len, runs))
    each = [run[:common] for run in runs]
    names = each[0][0]["invariants"] if common else ()
    return {
        "periods": tuple(float.fromhex(row["periods"]) for row in each[0]),
        **{name: _rms([[row[name] for row in run] for run in each]) for name in MEASURED},
        "phase_s": _rms([_while_known([row["phase_s"] for row in run], lost) for run in each]),
        "invariants": {
            name: _rms([[row["invariants"][name] for row in run] for run in each]) for name in names
        },
    }


def _while_known(phases: Sequence[str], lost: float) -> list[str | None]:
    """Return phase errors until the first that is lost, and None from there on."""
    known = list(takewhile(lambda x: abs(float.fromhex(x)) < lost, phases))
    return [*known, *[None] * (len(phases) - len(known))]


def _rms(runs: Sequence[Sequence[str | None]]) -> Values:
    return tuple(_mean(values) for values in zip(*runs, strict=True))


def _mean(values: Sequence[str | None]) -> float | None:
    numbers = [float.fromhex(x) for x in values if x is not None]
    return float(np.sqrt(np.mean(np.square(numbers)))) if len(numbers) == len(values) else None


def _filled(columns: Sequence[Values], width: int) -> Any:
    table = np.full((len(columns), width), np.nan)
    for row, values in zip(table, columns, strict=True):
        row[: len(values)] = [np.nan if x is None else x for x in values]
    return table


def _about(what: str, units: str = "1") -> dict[str, str]:
    return {"long_name": what, "units": units}


def _invariant(name: str, each: MethodDrift) -> Values:
    return (each.invariants or {}).get(name, ())
