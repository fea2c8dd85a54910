"""Many tops at once: arrays of starts, integrated in the lanes of vector registers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from heavytop.classification.arrays import InputArrays, with_spin
from heavytop.classification.many import impossible
from heavytop.equations import lagrangian as lag
from heavytop.equations.formulation import FORMULATIONS, Formulation
from heavytop.equations.gradients import invariants_of
from heavytop.equations.lambdify import lambdified
from heavytop.errors import Impossible, Outcome, refuse
from heavytop.integration.batch import Journey, Lane, Zeros, joined
from heavytop.integration.outputs import Sample, event_function, invariants, sample
from heavytop.run.estimates import DOUBLE_DIGITS
from heavytop.run.outlook import Outlook, outlook
from heavytop.scene.arguments import one_of, parse_names, parse_options, whole, wrong_type

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Columns = Mapping[str, Array]

ENSEMBLE_NAME = "propagate_many"
OUTCOMES = (Outcome.FINISHED, Outcome.SINGULAR, Outcome.STEP_LIMIT)  # by the codes of `Lane`
MOST_JOBS = 1024
MOST_STEPS = 10_000_000  # some ten seconds: then a top is given up
TOLD = 100  # units of rounding by which a motion must have an event for its number to be told
BY_HEIGHT = 100  # the cubic form, whose state is a height, in units of the others
LEAST_SIZE = float(np.finfo(np.float64).tiny)
SMALL_NUTATION = 1e-3  # rad: of a nutation that is larger, a step never holds two turning points
SHORT = 0.1  # of the fastest time in a motion: in such a step from one event there is no other
_SYMBOLS = (lag.A, lag.C, lag.gMR, *lag.COORDINATES, *lag.VELOCITIES)


@dataclass(frozen=True, eq=False, repr=False)
class Ensemble:
    """Many tops at the ends of their spans.

    Attributes
    ----------
    shape : tuple of int
        The common shape of what was given; everything else is in a row of its length, k.
    formulation : Formulation
        The equations.
    parameters : mapping from str to ndarray
        The parameters in them, by name, each of shape (k,).
    events : tuple of str
        Which zeros were looked for.
    end : ndarray, shape (k,)
        Ends [s].
    states : ndarray, shape (k, n)
        States of the formulation there; nan where the end was not reached.
    ending : ndarray of int, shape (k,)
        Codes of how each ended; `outcomes` has the words.
    zeros : Zeros
        Zeros of the events asked for: which top, which event, and when; a start or an end exactly
        on an event counts.
    digits : int
        How many are asked for.
    start : mapping from str to ndarray
        The starts, by name, each of shape (k,).
    """

    shape: tuple[int, ...]
    formulation: Formulation
    parameters: Columns
    events: tuple[str, ...]
    end: Array
    states: Array
    ending: NDArray[np.int64]
    zeros: Zeros
    digits: int
    start: Columns

    def __repr__(self) -> str:
        missed = f"{np.count_nonzero(self.missed)} missed"
        return f"<Ensemble: {self.shape} tops, {self.formulation.name}, {missed}>"

    @cached_property
    def error(self) -> Array:
        """About how far off the axis is at the end at most, and so θ [rad], shape (k,).

        From the rounding of the steps, by how much the invariants have moved, and how errors grow
        from such a start; nan where the end was not reached.
        """
        ahead = self._ahead
        with np.errstate(all="ignore"):
            error = (ahead.rounding + self._moved()) * ahead.growth
            if not self.formulation.starts_at_pole:  # it is singular there
                error /= ahead.near
            if "w" in self.formulation.reading:  # its state is a height
                sine = np.minimum(np.sin(self.start["theta"]), np.sin(self.final.theta))
                error *= BY_HEIGHT * ahead.growth / sine**2
        theta = self.final.theta
        error = np.where((theta < 0) | (theta > np.pi), np.inf, np.fmin(error, np.pi))
        error[self.ending != Lane.REACHED] = np.nan
        return error

    @cached_property
    def missed(self) -> NDArray[np.bool_]:
        """Which tops do not have what is asked, or may not, shape (k,).

        Their end was not reached, `error` is more than 10^-digits max(1, θ), or the number of an
        event asked for is beyond doubles.
        """
        unsure = np.zeros(self.end.shape, dtype=bool)
        for event in self.events:
            clear = abs(_clear(event, self._ahead))
            unsure |= (clear != 0) & ~(clear > TOLD * self._ahead.rounding)
        return unsure | ~(self.error <= 10.0**-self.digits * np.fmax(1.0, self.final.theta))

    @cached_property
    def _ahead(self) -> Outlook:
        return outlook(self.start, self.end)

    def _moved(self) -> Array:
        """By how much the invariants have moved, each beside the size of its terms."""
        form, known = self.formulation, invariants_of(self.formulation)
        named: Any = self.parameters
        constants = [named[c.name] for c in known.constants]
        first, _ = _binary(form, self.start)
        ends = first, self.states
        before, after = ([*invariants(form, y, named, self.end).values()] for y in ends)
        sizes = np.max([known.sizes(*y.T, *constants) for y in ends], axis=0)
        moved: Array = abs(np.subtract(after, before)) / np.maximum(sizes, LEAST_SIZE)
        return moved.max(axis=0)  # type: ignore[no-any-return]

    @property
    def outcomes(self) -> tuple[Outcome, ...]:
        """How each top ended."""
        return tuple(OUTCOMES[code] for code in self.ending.tolist())

    @cached_property
    def final(self) -> Sample:
        """The motion at the ends; φ and ψ are modulo 2π, or nan where the equations have none."""
        parameters: Any = self.parameters
        return sample(self.formulation, self.states, parameters, self.end)

    def count(self, event: str) -> NDArray[np.int64]:
        """How many zeros of an event function each top met, shape (k,).

        Parameters
        ----------
        event : str
            One of `events`.

        Raises
        ------
        Impossible
            It was not looked for.
        """
        if event not in self.events:
            raise Impossible([("event", f"{event!r}: none of those looked for, {self.events}")])
        mine = self.zeros.which[self.zeros.event == self.events.index(event)]
        return np.bincount(mine, minlength=self.end.size)


def propagate_many(
    *,
    A: ArrayLike,
    C: ArrayLike,
    gMR: ArrayLike,
    theta: ArrayLike,
    time: ArrayLike,
    phi: ArrayLike = 0.0,
    psi: ArrayLike = 0.0,
    thetadot: ArrayLike = 0.0,
    phidot: ArrayLike = 0.0,
    psidot: ArrayLike | None = None,
    omega3: ArrayLike | None = None,
    formulation: str = "axis",
    events: Sequence[str] = (),
    digits: int = 12,
    jobs: int | None = None,
) -> Ensemble:
    """Integrate many tops in double precision, each over its own span.

    Parameters
    ----------
    A, C, gMR : array_like
        Moments of inertia [kg m²] and weight times distance [kg m² s⁻²].
    theta, phi, psi, thetadot, phidot : array_like
        Angles [rad] and rates [rad/s].
    time : array_like
        Spans [s]; negative ones run backwards.
    psidot, omega3 : array_like, optional
        The spin, as ψ̇ or as ω3 [rad/s]; not both.
    formulation : str
        The equations to integrate, by name.
    events : sequence of str
        Which zeros to find: turning, reversal.
    digits : int
        Decimal digits of θ and the axis that are wanted at the ends: those that miss them, or may
        have a wrong number of events, are marked in `Ensemble.missed`; `propagate` computes one
        such top in as many bits as it takes.
    jobs : int, optional
        Threads; by default one per processor. The results do not depend on it.

    Returns
    -------
    Ensemble
        Each top has its own outcome; what is singular, impossible (A not above 0, C below 0, θ
        outside [0, π]) or no number is singular, and spoils only itself.

    Raises
    ------
    ImpossibleStart
        Both psidot and omega3 are given.
    NotANumber
        Something is not an array of numbers, which is named, or an option is no whole number.
    Impossible
        The shapes do not broadcast; digits that doubles cannot have, or no threads.
    WrongType
        `events` are no names in a row.
    BadScene
        No formulation has this name, or it has no such event.

    Notes
    -----
    Starts are formed in doubles, where a scene's are rounded once from exact numbers; apart from
    that a top moves as in `propagate`, to rounding. ``validation/03_benchmarks.py`` measures both.

    Accuracy: ``tests/run/test_ensemble.py`` holds θ to 3e-12 and times of events to 1e-11 s
    of those of `propagate`. It holds the axis to `Ensemble.error`
    of the closed form, and every number of events that is not marked; ``validation/43_fuzz.py``
    does it for thousands of tops.

    Examples
    --------
    >>> import numpy as np
    >>> kicks = np.array([-15.0, 0.0, np.nan])
    >>> found = propagate_many(A=3.28e-4, C=6.6e-5, gMR=0.0456, theta=0.1, phidot=kicks,
    ...                        psidot=140.0, time=2.0, events=("turning",), jobs=1)
    >>> found.final.theta.round(9), [str(outcome) for outcome in found.outcomes]
    (array([0.42694371, 0.10034198,        nan]), ['finished', 'finished', 'singular'])
    >>> found.count("turning")
    array([ 8, 10,  0])
    >>> found.missed
    array([False, False,  True])
    """
    digits = whole("digits", digits, 1, DOUBLE_DIGITS)
    jobs = None if jobs is None else whole("jobs", jobs, 1, MOST_JOBS)
    form, events = _asked(formulation, events)
    given = {
        "A": A, "C": C, "gMR": gMR, "theta": theta, "phi": phi, "psi": psi,
        "thetadot": thetadot, "phidot": phidot, "time": time,
    }  # fmt: skip
    columns = InputArrays(with_spin(given, psidot, omega3))
    start = columns.full()
    end = start.pop("time")
    if "omega3" in start:
        start["psidot"] = start.pop("omega3") - start["phidot"] * np.cos(start["theta"])
    broken = impossible(start["A"], start["C"], start["theta"])
    start["theta"] = np.where(broken, np.nan, start["theta"])  # such a lane is singular
    begun, parameters = _binary(form, start)
    ahead = outlook(start, end) if events else None
    zeros = [_Expected.of(event, start, ahead) for event in events] if ahead else []
    first = np.full(end.shape, np.inf)
    for each in zeros:
        first = np.where(each.risky, np.minimum(first, each.short), first)
    journey = Journey(form, events, begun, parameters, (end, first), MOST_STEPS)
    run = Ensemble(columns.shape, form, parameters, events, end, *journey.run(jobs), digits, start)
    if ahead:
        margin = ahead.rounding * ahead.growth / ahead.rate
        run = replace(run, zeros=_counted(run, zeros, margin))
    return run


def _asked(formulation: str, events: Sequence[str]) -> tuple[Formulation, tuple[str, ...]]:
    """The formulation of a name, and events that it has, if they are."""
    if not isinstance(events, Sequence):
        raise wrong_type("events", "names of events, in a row", events)
    entry, faults = parse_options(
        ENSEMBLE_NAME, {"formulation": formulation}, {"formulation": one_of(FORMULATIONS)}
    )
    if events:
        known = {event: event for event in ("turning", "reversal")}
        events, wrong = parse_names(ENSEMBLE_NAME, "events", events, one_of(known))
        faults += wrong
    refuse(faults)
    return entry["formulation"].build(), tuple(events)


def _binary(form: Formulation, start: Columns) -> tuple[Array, dict[str, Array]]:
    """States at the start (k, n) and constants (k,) by name."""
    with np.errstate(all="ignore"):  # what is no number is found out lane by lane
        values = _start_function(form)(*(start[symbol.name] for symbol in _SYMBOLS))
    rows = [np.broadcast_to(np.asarray(x, dtype=float), start["A"].shape) for x in values]
    count = len(form.states)
    names = (p.name for p in form.parameters)
    return np.stack(rows[:count], axis=-1), dict(zip(names, rows[count:], strict=True))


@cache
def _start_function(form: Formulation) -> Any:
    return lambdified((*form.start, *form.parameters.values()), _SYMBOLS)


# --- events at the start and at the end --------------------------------------------------------


def _clear(event: str, ahead: Outlook) -> Array:
    """How clearly motions have an event, as angle or height; not above 0 where they have none."""
    return ahead.nods if event == "turning" else ahead.turns_back


class _Expected(NamedTuple):
    """What is known of an event before anything is integrated.

    Attributes
    ----------
    never, begins : ndarray of bool, shape (k,)
        Where there is none, and where the start is exactly one.
    risky : ndarray of bool, shape (k,)
        Where from the start a step may reach another one.
    short : ndarray, shape (k,)
        A time after the start in which there is no other [s].
    """

    never: Mask
    begins: Mask
    risky: Mask
    short: Array

    @classmethod
    def of(cls, event: str, start: Columns, ahead: Outlook) -> _Expected:
        clear, short = _clear(event, ahead), SHORT / ahead.rate
        if event == "turning":
            begins = (clear > 0) & ((start["thetadot"] == 0) | (start["theta"] == 0))
            return cls(clear <= 0, begins, begins & (clear < SMALL_NUTATION), short)
        begins = (clear > 0) & (start["phidot"] == 0)
        sine, falling = np.sin(start["theta"]), abs(start["thetadot"])  # beside a pole or a cusp
        with np.errstate(all="ignore"):
            again = sine * falling / (falling**2 + abs(start["gMR"] / start["A"]) * sine**2)
        return cls(clear <= 0, begins, begins, np.fmin(short, again / 2))


def _counted(run: Ensemble, expected: list[_Expected], margin: Array) -> Zeros:
    """The zeros that count: those exactly at the start or the end too, each once, and no others.

    What is at the start is known from the numbers given; it may be found beside it, or not at all.
    One that the error does not tell from the end, by a margin [s], is at the end.
    """
    found, parts, named = run.zeros, [], cast(Any, run.parameters)
    for code, (event, known) in enumerate(zip(run.events, expected, strict=True)):
        echo = known.begins[found.which]
        echo &= abs(found.t) <= known.short[found.which] / 2
        here = found.at((found.event == code) & ~known.never[found.which] & ~echo)
        last = np.zeros(run.end.size)
        np.maximum.at(last, here.which, abs(here.t))
        zero, slope = event_function(run.formulation, event, run.states, named, run.end)
        with np.errstate(all="ignore"):
            late = -zero / slope * np.sign(run.end)
            ends = (late > 0) & (late <= margin) & (last < abs(run.end) - margin) & ~known.never
        parts.append(here)
        for where, t in ((known.begins, 0 * run.end), (ends, run.end)):
            which = np.flatnonzero(where)
            parts.append(Zeros(which, np.full(which.size, code), t[which]))
    return joined(parts)
