"""A drift: what a study found, method by method, of each start and over all of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import takewhile
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from heavytop.errors import MissingPackage
from heavytop.run.planning import closed_form_of
from heavytop.studies.drifts import checked
from heavytop.studies.drifts.growth import Growth, growth
from heavytop.studies.drifts.members import SPREAD, STARTS
from heavytop.studies.drifts.study import Study
from heavytop.studies.ledger import Book
from heavytop.studies.methods import Method

if TYPE_CHECKING:
    import xarray

SCHEMA: Final = "heavytop/drift/1"
LOST: Final = 0.05  # of a period: beyond it what is left of a phase error is no measure of it
MEASURED: Final = ("energy", "axis")
MOMENTA: Final = ("p_phi", "p_psi")
Values = tuple[float | None, ...]


@dataclass(frozen=True, kw_only=True)
class Errors:
    """Errors at the times of a study.

    Attributes
    ----------
    periods : tuple of float, shape (k,)
        Times in nutation periods of each run's own start.
    energy, phase_s, axis : tuple of (float or None), shape (k,)
        Of E' relative to max(|E'|, gMR), of the phase [s], and of the axis; None where the
        formulation does not say, and of the phase from where a run has lost a twentieth of a
        period: there it measures nothing any more.
    invariants : dict from str to tuple
        The same of the formulation's other invariants, relative.
    """

    periods: tuple[float, ...] = ()
    energy: Values = ()
    phase_s: Values = ()
    axis: Values = ()
    invariants: Mapping[str, Values] | None = None

    def lists(self) -> dict[str, Any]:
        """Return them for JSON; None for momenta that cannot change."""
        known, none = self.invariants or {}, (None,) * len(self.periods)
        return {
            "periods": list(self.periods),
            "energy": list(self.energy),
            **{name: list(known.get(name, none)) for name in MOMENTA},
            "invariants": {name: list(x) for name, x in known.items() if name not in MOMENTA},
            "phase_s": list(self.phase_s),
            "axis": list(self.axis),
        }


@dataclass(frozen=True, kw_only=True)
class MemberDrift(Errors):
    """The errors of one run, with their signs, at the times that it reached.

    Attributes
    ----------
    steps : int
        How many it took. What else there is: `Errors`.
    """

    steps: int


@dataclass(frozen=True)
class MethodDrift(Errors):
    """How the errors of one method grow.

    Attributes
    ----------
    method : Method
        Which one, with its setting.
    period : float
        T of the scene [s].
    periods : tuple of float, shape (k,)
        Times that all runs reached, in nutation periods of each run's own start.
    energy, phase_s, axis : tuple of (float or None), shape (k,)
        RMS over the starts of the errors that `members` have; None from where one has None.
    invariants : dict from str to tuple
        The same of the formulation's other invariants, relative.
    members : tuple of MemberDrift
        The runs, in the order of `Study.starts`.
    spread : Errors or None
        Standard deviations over the starts, of the errors with their signs.
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
    members: tuple[MemberDrift, ...] = ()
    spread: Errors | None = None
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
        found = {
            "name": self.method.text,
            "formulation": self.method.formulation,
            "language": self.method.language,
            "setting": {self.method.set_by: self.method.setting},
            "us_per_period": self.us_per_period,
            "steps": self.steps,
            **self.lists(),
            "energy_exponent": self.energy_exponent,
            "phase_exponent": self.phase_exponent,
            "stderr": {
                "energy": self.energy_growth and self.energy_growth.stderr,
                "phase": self.phase_growth and self.phase_growth.stderr,
            },
            "ended": {str(number): why for number, why in (self.ended or {}).items()},
            "skipped": self.skipped,
            "spread": self.spread and self.spread.lists(),
            "members": [{**each.lists(), "steps": each.steps} for each in self.members],
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
            "spread": SPREAD,
            "starts": self.study.starts,
            "methods": [each.document(costs=costs) for each in self.methods],
            "files": dict(files or {}),
            "versions": identity["versions"],
        }

    def to_xarray(self) -> xarray.Dataset:
        """Return errors over ``scheme`` and ``mark``, nan where there are none.

        ``energy`` and the others are root mean squares over the starts, ``energy_spread`` standard
        deviations, and ``member_energy``, over ``start`` too, the errors of each run; ``theta`` and
        the others over ``start`` are the initial conditions.

        (A dimension called method could not be selected: xarray has an option of that name.)
        """
        import xarray

        each, count = self.methods, self.study.ensemble
        members = [one.members or (Errors(),) * count for one in each]
        width = max((len(run.periods) for runs in members for run in runs), default=0)
        table: dict[str, Any] = {
            name: ("start", np.array([one[name] for one in self.study.starts]), about)
            for name, about in STARTS.items()
        }
        for name, (c, what, unit) in self._columns().items():
            mean, spread = ([c(x or Errors()) for x in some] for some in
                            (each, [one.spread for one in each]))  # fmt: skip
            alone = np.array([_filled([c(run) for run in runs], width) for runs in members])
            shaped = alone.reshape(len(each), count, width)
            table[name] = (("scheme", "mark"), _filled(mean, width), _about(what, unit))
            table[f"member_{name}"] = (
                ("scheme", "start", "mark"), shaped, _about(f"{what}, of each start", unit),
            )  # fmt: skip
            if name != "periods":
                over = _about(f"{what}, standard deviation over the starts", unit)
                table[f"{name}_spread"] = (("scheme", "mark"), _filled(spread, width), over)
        asked = {name: self.study.identity[name] for name in ("ensemble", "samples", "seed")}
        title, schemes = self.study.scene.title, [one.method.text for one in each]
        return xarray.Dataset(
            table,
            coords={"scheme": ("scheme", schemes, _about("method that was followed", "1"))},
            attrs={"schema": SCHEMA, "title": title, **asked, "spread": SPREAD},
        )

    def _columns(self) -> dict[str, tuple[Callable[[Errors], Values], str, str]]:
        """Return what a dataset holds: columns of errors, with their names and units."""
        columns: dict[str, tuple[Callable[[Errors], Values], str, str]] = {
            "periods": (lambda e: e.periods, "time in nutation periods", "1"),
            "energy": (lambda e: e.energy, "error of E', relative to max(|E'|, gMR)", "1"),
            "phase_s": (lambda e: e.phase_s, "phase error of the nutation", "s"),
            "axis": (lambda e: e.axis, "distance of the axis, a unit vector", "1"),
        }
        others = {name: None for each in self.methods for name in each.invariants or {}}
        for name in others:
            columns[name] = (partial(_invariant, name), f"error of {name}, relative", "1")
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
    members = tuple(_member(run, LOST * nothing.period) for run in runs)
    gone = sum(run.periods for run in runs)
    spent = sum(map(book.spent_s, tasks))
    return replace(
        nothing,
        **_over(members, _root_mean_square),
        members=members,
        spread=Errors(**_over(members, _deviation)),
        steps=float(np.mean([run.steps for run in runs])),
        us_per_period=spent / gone * 1e6 if gone else None,
        ended={i: run.ended for i, run in enumerate(runs) if run.ended},
    )


def _member(run: checked.Ended, lost: float) -> MemberDrift:
    rows = run.rows
    names = rows[0]["invariants"] if rows else ()
    phases = [_number(row["phase_s"]) for row in rows]
    known = len(list(takewhile(lambda x: x is not None and abs(x) < lost, phases)))
    return MemberDrift(
        periods=tuple(float.fromhex(row["periods"]) for row in rows),
        **{name: tuple(_number(row[name]) for row in rows) for name in MEASURED},
        phase_s=(*phases[:known], *[None] * (len(phases) - known)),
        invariants={n: tuple(_number(row["invariants"][n]) for row in rows) for n in names},
        steps=run.steps,
    )


def _over(members: Sequence[Errors], mean: Callable[[Any], Any]) -> dict[str, Any]:
    """Return errors over all runs, at the times that all of them reached."""

    def folded(columns: Iterable[Values]) -> Values:
        every = zip(*columns, strict=False)
        return tuple(None if None in each else float(mean(np.array(each))) for each in every)

    periods = min((each.periods for each in members), key=len)
    names = (members[0].invariants or ()) if periods else ()
    return {
        "periods": periods,
        **{n: folded(getattr(x, n) for x in members) for n in (*MEASURED, "phase_s")},
        "invariants": {n: folded((x.invariants or {})[n] for x in members) for n in names},
    }


def _root_mean_square(values: Any) -> Any:
    return np.sqrt(np.mean(np.square(values)))


def _deviation(values: Any) -> Any:
    return np.sqrt(np.mean(np.square(values - np.mean(values))))


def _number(text: str | None) -> float | None:
    return None if text is None else float.fromhex(text)


def _filled(columns: Sequence[Values], width: int) -> Any:
    table = np.full((len(columns), width), np.nan)
    for row, values in zip(table, columns, strict=True):
        row[: len(values)] = [np.nan if x is None else x for x in values]
    return table


def _about(what: str, units: str) -> dict[str, str]:
    return {"long_name": what, "units": units}


def _invariant(name: str, each: Errors) -> Values:
    return (each.invariants or {}).get(name, ())
