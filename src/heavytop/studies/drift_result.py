"""The result of a drift study: errors of every run, and over all starts, and how they grow."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import takewhile
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from heavytop.errors import MissingPackage
from heavytop.run.planning import closed_form_of
from heavytop.scene.scene import scene_of
from heavytop.studies.methods import Method, method
from heavytop.studies.steppers import SPREAD, neighbour
from heavytop.studies.store import MemoryStore, Parameters, Record

if TYPE_CHECKING:
    import xarray

SCHEMA: Final = "heavytop/drift/1"
LOST: Final = 0.05  # of a period: beyond it what is left of a phase error is no measure of it
LAST_DECADES: Final = 3  # of the times that are fitted: earlier errors are those of the start
LEAST_POINTS: Final = 4
MOMENTA: Final = ("p_phi", "p_psi")
COLUMNS: Final = {
    "periods": ("time in nutation periods", "1"),
    "energy": ("error of E', relative to max(|E'|, gMR)", "1"),
    "phase_s": ("phase error of the nutation", "s"),
    "axis": ("distance of the axis, a unit vector", "1"),
}
STARTS: Final = {
    **dict.fromkeys(("theta", "phi", "psi"), "rad"),
    **dict.fromkeys(("thetadot", "phidot", "psidot", "omega3"), "rad s-1"),
}
"""The initial conditions of each start, with their units."""

Values = tuple[float | None, ...]


@dataclass(frozen=True, kw_only=True)
class ErrorSeries:
    """Errors at the sample times of a study.

    Attributes
    ----------
    periods : tuple of float, shape (k,)
        Times in nutation periods of each run's own start.
    energy, phase_s, axis : tuple of (float or None), shape (k,)
        Of E' relative to max(|E'|, gMR), of the phase [s], and of the axis; None where the
        formulation does not determine it, and of the phase from where a run is off by a twentieth
        of a period: beyond that the phase error measures nothing.
    invariants : dict from str to tuple
        The same of the formulation's other invariants, relative.
    """

    periods: tuple[float, ...] = ()
    energy: Values = ()
    phase_s: Values = ()
    axis: Values = ()
    invariants: Mapping[str, Values] = field(default_factory=dict)

    @property
    def columns(self) -> dict[str, Values]:
        """All of them by name."""
        return {name: getattr(self, name) for name in COLUMNS} | dict(self.invariants)

    def lists(self) -> dict[str, Any]:
        """Return them for JSON; None for momenta that cannot change."""
        found = {name: list(values) for name, values in self.columns.items()}
        others = {name: found[name] for name in self.invariants if name not in MOMENTA}
        none: list[float | None] = [None] * len(self.periods)
        return {
            "periods": found["periods"],
            "energy": found["energy"],
            **{name: found.get(name, none) for name in MOMENTA},
            "invariants": others,
            "phase_s": found["phase_s"],
            "axis": found["axis"],
        }


@dataclass(frozen=True, kw_only=True)
class MemberDrift(ErrorSeries):
    """The errors of one run, with their signs, at the times that it reached.

    Attributes
    ----------
    steps : int
        How many it took. What else there is: `ErrorSeries`.
    """

    steps: int


@dataclass(frozen=True, slots=True)
class Growth:
    """An error that grows as a power of the time.

    Attributes
    ----------
    exponent : float or None
        1/2 for a random walk, 1 for a steady drift, 3/2 for the integral of a random walk; None
        where there is nothing to fit.
    stderr : float or None
        Standard error of the exponent, from how far the points lie off the line. ErrorSeries at
        neighbouring times are not independent, so it is rather too small.
    points : int
        How many times were fitted.
    """

    exponent: float | None
    stderr: float | None
    points: int


@dataclass(frozen=True, kw_only=True)
class MethodDrift(ErrorSeries):
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
        The runs, in the order of `Drift.starts`.
    spread : ErrorSeries or None
        Standard deviations over the starts, of the errors with their signs.
    steps : float
        Mean number of steps of a run.
    us_per_period : float or None
        Time in the integrator, mean over the runs [µs]; None where runs were begun by another
        process.
    ended : dict from int to str
        Why runs ended early, by the number of the start.
    skipped : str or None
        Why the method was not run.
    """

    method: Method
    period: float
    members: tuple[MemberDrift, ...] = ()
    spread: ErrorSeries | None = None
    steps: float | None = None
    us_per_period: float | None = None
    ended: Mapping[int, str] = field(default_factory=dict)
    skipped: str | None = None

    @cached_property
    def energy_growth(self) -> Growth:
        """With which power of the time the energy error grows."""
        return growth(self.periods, self.energy)

    @cached_property
    def phase_growth(self) -> Growth:
        """With which power of the time the phase error grows."""
        return growth(self.periods, self.phase_s)

    def document(self, *, costs: bool = True) -> dict[str, Any]:
        """Return the method for JSON.

        Parameters
        ----------
        costs : bool
            Whether with what a period took; without it there are no wall-clock values.
        """
        return {
            "name": self.method.text,
            "formulation": self.method.formulation,
            "language": self.method.language,
            "setting": {self.method.set_by: self.method.setting},
            **({"us_per_period": self.us_per_period} if costs else {}),
            "steps": self.steps,
            **self.lists(),
            "energy_exponent": self.energy_growth.exponent,
            "phase_exponent": self.phase_growth.exponent,
            "stderr": {"energy": self.energy_growth.stderr, "phase": self.phase_growth.stderr},
            "ended": {str(number): why for number, why in self.ended.items()},
            "skipped": self.skipped,
            "spread": self.spread and self.spread.lists(),
            "members": [{**each.lists(), "steps": each.steps} for each in self.members],
        }


@dataclass(frozen=True)
class Drift:
    """The result of a drift study; ``drift["strang"]`` is one method.

    Attributes
    ----------
    parameters : dict
        What was asked, for JSON: the scene, the methods, how far; and the versions.
    methods : tuple of MethodDrift
        What was found of each, in the order asked.
    """

    parameters: Parameters
    methods: tuple[MethodDrift, ...]

    def __getitem__(self, name: str) -> MethodDrift:
        """Return one method by its name."""
        return next(each for each in self.methods if each.method.text == name)

    @property
    def starts(self) -> list[dict[str, float]]:
        """The initial conditions of every start, as doubles; the first is the scene's own."""
        start, asked = scene_of(self.parameters["scene"]).start, self.parameters
        states = (neighbour(start, asked["seed"], k) for k in range(asked["ensemble"]))
        return [{name: float(getattr(state, name)) for name in STARTS} for state in states]

    def document(self, *, costs: bool = True, files: Mapping[str, str] | None = None) -> Any:
        """Return the document heavytop/drift/1.

        Parameters
        ----------
        costs : bool
            Whether with what runs took; without it there are no wall-clock values.
        files : mapping, optional
            Names of the files that were written, by what they are.
        """
        names = ("scene", "periods", "ensemble", "samples", "seed")
        return {
            "schema": SCHEMA,
            **{name: self.parameters[name] for name in names},
            "spread": SPREAD,
            "starts": self.starts,
            "methods": [each.document(costs=costs) for each in self.methods],
            "files": dict(files or {}),
            "versions": self.parameters["versions"],
        }

    def to_xarray(self) -> xarray.Dataset:
        """Return errors over ``scheme`` and ``mark``, nan where there are none.

        ``energy`` and the others are root mean squares over the starts, ``energy_spread`` standard
        deviations, and ``member_energy``, over ``start`` too, the errors of each run; ``theta`` and
        the others over ``start`` are the initial conditions.

        (A dimension called method could not be selected: xarray has an option of that name.)
        """
        import xarray

        asked, each = self.parameters, self.methods
        alone = [run for one in each for run in one.members or [ErrorSeries()] * asked["ensemble"]]
        spread = [one.spread or ErrorSeries() for one in each]
        width = max(len(run.periods) for run in alone)
        shape = (len(each), asked["ensemble"], width)
        others = {name: None for one in each for name in one.invariants}
        columns = COLUMNS | {name: (f"error of {name}, relative", "1") for name in others}
        table: dict[str, Any] = {
            name: ("start", [one[name] for one in self.starts], _about(f"initial {name}", unit))
            for name, unit in STARTS.items()
        }
        for name, (what, unit) in columns.items():
            for key, axes, values, over in (
                (name, (), _padded(each, name, width), ""),
                (f"member_{name}", ("start",), _padded(alone, name, width).reshape(shape),
                 ", of each start"),
                (f"{name}_spread", (), _padded(spread, name, width),
                 ", standard deviation over the starts"),
            ):  # fmt: skip
                table[key] = ("scheme", *axes, "mark"), values, _about(what + over, unit)
        del table["periods_spread"]
        schemes = [one.method.text for one in each]
        return xarray.Dataset(
            table,
            coords={"scheme": ("scheme", schemes, _about("method that was followed", "1"))},
            attrs={"schema": SCHEMA, "title": asked["scene"]["title"], "spread": SPREAD,
                   **{name: asked[name] for name in ("ensemble", "samples", "seed")}},
        )  # fmt: skip


def collect(store: MemoryStore) -> Drift:
    """Return the drift that the runs of a study add up to, all at their end."""
    asked = store.parameters
    period = float(closed_form_of(scene_of(asked["scene"])).period or 0.0)
    return Drift(asked, tuple(_method(store, text, period) for text in asked["methods"]))


def task_name(text: str, number: int) -> str:
    """Return the name of a run: its method and the number of its start."""
    return f"{text}/{number:04d}"


def growth(periods: Sequence[float], errors: Sequence[float | None]) -> Growth:
    """Return the growth over the last three decades.

    Parameters
    ----------
    periods : sequence of float, shape (k,)
    errors : sequence of (float or None), shape (k,)
        RMS errors; zeros and None are left out, and the last of the others ends the decades.

    Examples
    --------
    >>> n = [10.0, 100.0, 1000.0, 10000.0]
    >>> found = growth(n, [1e-15 * x**1.5 for x in n])
    >>> round(found.exponent, 6), found.points
    (1.5, 4)
    >>> growth(n, [0.0, None, 1e-15, 2.0])
    Growth(exponent=None, stderr=None, points=2)
    """
    known = [(n, e) for n, e in zip(periods, errors, strict=True) if e]
    from_here = max((n for n, _ in known), default=0.0) / 10**LAST_DECADES * 0.999
    fitted = [(np.log(n), np.log(e)) for n, e in known if n >= from_here]
    if len(fitted) < LEAST_POINTS:
        return Growth(None, None, len(fitted))
    x, y = np.array(fitted).T
    spread = x - x.mean()
    slope = float(spread @ y / (spread @ spread))
    residual = y - y.mean() - slope * spread
    variance = float(residual @ residual) / (len(fitted) - 2) / float(spread @ spread)
    return Growth(slope, float(np.sqrt(variance)), len(fitted))


def _method(store: MemoryStore, text: str, period: float) -> MethodDrift:
    chosen = method(text)
    if chosen.absent:
        why = str(MissingPackage(chosen.name, chosen.absent))
        return MethodDrift(method=chosen, period=period, skipped=why)
    tasks = [task_name(text, number) for number in range(store.parameters["ensemble"])]
    records = [store.load(task) for task in tasks]
    if failed := [record.failed for record in records if record.failed]:
        return MethodDrift(method=chosen, period=period, skipped=failed[0])
    members = tuple(_member(record, LOST * period) for record in records)
    gone = sum(record.checkpoint["periods"] for record in records)
    spent = [store.seconds[task] for task in tasks if task in store.seconds]
    ended = [record.checkpoint["ended"] for record in records]
    return MethodDrift(
        **_over(members, lambda x: np.sqrt(np.mean(np.square(x)))),
        method=chosen,
        period=period,
        members=members,
        spread=ErrorSeries(**_over(members, lambda x: np.sqrt(np.mean(np.square(x - np.mean(x)))))),
        steps=float(np.mean([each.steps for each in members])),
        us_per_period=sum(spent) / gone * 1e6 if gone and len(spent) == len(tasks) else None,
        ended={number: why for number, why in enumerate(ended) if why},
    )


def _member(record: Record, lost: float) -> MemberDrift:
    """The errors of a run, without phases from where the first is lost."""
    rows = record.rows
    phases = [row["phase_s"] for row in rows]
    known = [*takewhile(lambda phase: abs(phase) < lost, phases)]
    names = rows[0]["invariants"] if rows else ()
    return MemberDrift(
        periods=tuple(row["periods"] for row in rows),
        energy=tuple(row["energy"] for row in rows),
        phase_s=(*known, *[None] * (len(rows) - len(known))),
        axis=tuple(row["axis"] for row in rows),
        invariants={name: tuple(row["invariants"][name] for row in rows) for name in names},
        steps=record.checkpoint["state"]["steps"],
    )


def _over(members: Sequence[ErrorSeries], mean: Callable[[Any], Any]) -> dict[str, Any]:
    """Errors over all runs, at the times that all of them reached."""

    def column(name: str) -> Values:
        every = zip(*(each.columns[name] for each in members), strict=False)
        return tuple(None if None in each else float(mean(np.array(each))) for each in every)

    periods = min((each.periods for each in members), key=len)
    names = members[0].invariants if periods else ()
    return {
        "periods": periods,
        **{name: column(name) for name in COLUMNS if name != "periods"},
        "invariants": {name: column(name) for name in names},
    }


def _padded(rows: Iterable[ErrorSeries], name: str, width: int) -> Any:
    """A column of each of several runs, filled up with nan."""
    columns = [each.columns.get(name, ()) for each in rows]
    return np.array([[*column, *[None] * (width - len(column))] for column in columns], float)


def _about(what: str, units: str) -> dict[str, str]:
    return {"long_name": what, "units": units}
