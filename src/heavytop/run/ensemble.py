"""Many tops at once: arrays of starts, integrated in the lanes of vector registers."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from itertools import pairwise
from threading import Event
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from heavytop.equations import lagrangian as lag
from heavytop.equations.formulation import FORMULATIONS, Formulation
from heavytop.equations.gradients import invariants_of
from heavytop.equations.lambdify import lambdified
from heavytop.errors import BadScene, HeavyTopError, ImpossibleStart, NotANumber, Outcome
from heavytop.integration.batch import Arrived, Lane, Zeros, batch_integrator
from heavytop.integration.outputs import Sample, event_function, invariants, sample
from heavytop.run.error_growth import Outlook, outlook
from heavytop.run.estimates import MOST_DIGITS
from heavytop.run.planning import EPSILON
from heavytop.run.propagation import propagate
from heavytop.scene import arguments
from heavytop.scene.arguments import whole, wrong_type
from heavytop.scene.scene import Scene
from heavytop.scene.state import State, broken_spin
from heavytop.scene.top import Top

Array = NDArray[np.float64]

OUTCOMES = {
    Lane.REACHED: Outcome.FINISHED,
    Lane.SINGULAR: Outcome.SINGULAR,
    Lane.STEP_LIMIT: Outcome.STEP_LIMIT,
}
Starts = Mapping[str, Array]

KIND = "propagate_many"
MOST_JOBS = 1024
MOST_STEPS = 10_000_000  # unless told otherwise: some ten seconds
TOLD = 100  # units of rounding by which a motion must have an event for its number to be told
BY_HEIGHT = 100  # the cubic form, whose state is a height, in units of the others
OPTIONS = {"formulation": arguments.one_of(FORMULATIONS)}
TINY = float(np.finfo(np.float64).tiny)
SMALL = 1e-3  # rad: of a nutation that is larger, a step never holds two turning points
SHORT = 0.1  # of the fastest time in a motion: in such a step from one event there is no other
_SYMBOLS = (
    lag.A, lag.C, lag.gMR, lag.theta, lag.phi, lag.psi, lag.thetadot, lag.phidot, lag.psidot,
)  # fmt: skip


@dataclass(frozen=True, eq=False)
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
        Zeros of the events asked for: which top, which event, time and state; a start or an end
        exactly on an event counts.
    digits : int
        How many are asked for.
    start : mapping from str to ndarray
        The starts, by name, each of shape (k,).
    recomputed : mapping from int to float
        Tops that were recomputed by `propagate`, and by how much they are off the closed form.
    """

    shape: tuple[int, ...]
    formulation: Formulation
    parameters: Mapping[str, Array]
    events: tuple[str, ...]
    end: Array
    states: Array
    ending: NDArray[np.int64]
    zeros: Zeros
    digits: int
    start: Starts
    recomputed: Mapping[int, float] = field(default_factory=dict)

    @cached_property
    def error(self) -> Array:
        """About how far off the axis is at the end at most, and so θ [rad], shape (k,).

        From the rounding of the steps, by how much the invariants have moved, and how errors grow
        from such a start; nan where the end was not reached.
        """
        with np.errstate(all="ignore"):
            error = (self._ahead.rounding + self._moved()) * self._ahead.growth
            if not self.formulation.starts_at_pole:  # it is singular there
                error /= self._ahead.near
            if self.formulation.name == "cubic":
                sine = np.minimum(np.sin(self.start["theta"]), np.sin(self.final.theta))
                error *= BY_HEIGHT * self._ahead.growth / sine**2
        theta = self.final.theta
        error = np.where((theta < 0) | (theta > np.pi), np.inf, np.fmin(error, np.pi))
        error[self.ending != Lane.REACHED] = np.nan
        error[list(self.recomputed)] = list(self.recomputed.values())
        return error

    @cached_property
    def missed(self) -> NDArray[np.bool_]:
        """Which tops do not have what is asked, or may not, shape (k,).

        Their end was not reached, `error` is more than 10^-digits max(1, θ), or the number of an
        event asked for is beyond doubles.
        """
        ahead, unsure = self._ahead, np.zeros(self.end.shape, dtype=bool)
        for event in self.events:
            clear = abs(ahead.nods if event == "turning" else ahead.turns_back)
            unsure |= (clear != 0) & ~(clear > TOLD * ahead.rounding)
        unsure[list(self.recomputed)] = False
        return unsure | ~(self.error <= 10.0**-self.digits * np.fmax(1.0, self.final.theta))

    @cached_property
    def _ahead(self) -> Outlook:
        return outlook(self.start, self.end)

    def _moved(self) -> Array:
        """By how much the invariants have moved, each beside the size of its terms."""
        form, known = self.formulation, invariants_of(self.formulation)
        constants = [self.parameters[c.name] for c in known.constants]
        first, _ = _binary(form, [self.start[symbol.name] for symbol in _SYMBOLS])
        values, sizes = [], []
        for states in (first, self.states):
            parameters = cast(Any, self.parameters)
            values.append(invariants(form, states, parameters, self.end).values())
            sizes.append(known.sizes(*states.T, *constants))
        pairs = zip(*values, *sizes, strict=True)
        moved = [abs(b - a) / np.maximum(np.maximum(x, y), TINY) for a, b, x, y in pairs]
        return np.asarray(np.max(moved, axis=0))

    @property
    def outcomes(self) -> tuple[Outcome, ...]:
        """How each top ended."""
        return tuple(OUTCOMES[Lane(code)] for code in self.ending.tolist())

    @cached_property
    def final(self) -> Sample:
        """The motion at the ends, with theta, axis, rates …; φ and ψ are not followed, and nan."""
        return self._sampled(np.arange(self.end.size), self.states, self.end)

    @cached_property
    def met(self) -> Sample:
        """The motion at the zeros."""
        return self._sampled(self.zeros.which, self.zeros.states, self.zeros.t)

    def count(self, event: str) -> NDArray[np.int64]:
        """How many zeros of an event function each top met, shape (k,).

        Parameters
        ----------
        event : str
            One of `events`.
        """
        mine = self.zeros.which[self.zeros.event == self.events.index(event)]
        return np.bincount(mine, minlength=self.end.size)

    def _sampled(self, which: Any, states: Array, t: Array) -> Sample:
        parameters: Any = {name: values[which] for name, values in self.parameters.items()}
        return sample(self.formulation, states, parameters, t, np.full(t.shape, np.nan))


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
    step_limit: int | None = None,
    longest: ArrayLike = np.inf,
    digits: int = 12,
    recompute: bool = False,
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
    step_limit : int, optional
        Steps after which a top is given up; by default ten million, which take some ten seconds.
    longest : array_like
        The longest step [s]. A step longer than the half of a nutation may pass over a turning
        point next to a start on one.
    digits : int
        Decimal digits of θ and the axis that are wanted at the ends: those that miss them, or may
        have a wrong number of events, are marked in `Ensemble.missed`.
    recompute : bool
        Whether these are computed again, one by one, by `propagate`, in as many bits as it takes:
        milliseconds each, or seconds.
    jobs : int, optional
        Threads; by default one per processor. The results do not depend on it.

    Returns
    -------
    Ensemble
        Each top has its own outcome; what is singular or no number spoils only itself.

    Raises
    ------
    ImpossibleStart
        Both psidot and omega3 are given.
    NotANumber
        Something is not an array of numbers, which is named, or the shapes do not broadcast; or
        an option is no whole number.
    Impossible
        Digits that doubles cannot have, no steps, or no threads.
    WrongType
        `events` are no names in a row, or `recompute` is neither True nor False.
    BadScene
        No formulation has this name, or it has no such event.

    Notes
    -----
    Starts are formed in doubles, where a scene's are rounded once from exact numbers; apart from
    that a top moves as in `propagate`, to rounding. ``validation/12_many_tops.py`` measures both.

    Accuracy: ``tests/two_ways/test_many_tops.py`` holds θ to 3e-12 and times of events to 1e-11 s
    of those of `propagate`. ``tests/property/test_fuzz_many.py`` holds the axis to `Ensemble.error`
    of the closed form, and every number of events that is not marked; ``validation/fuzz_many.py``
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
    if psidot is not None and omega3 is not None:
        raise ImpossibleStart(broken_spin(("psidot", "omega3")))
    spin = psidot if omega3 is None else omega3
    rate = 0.0 if spin is None else spin
    given = {
        "A": A, "C": C, "gMR": gMR, "theta": theta, "phi": phi, "psi": psi,
        "thetadot": thetadot, "phidot": phidot, "psidot" if omega3 is None else "omega3": rate,
        "time": time, "longest": longest,
    }  # fmt: skip
    digits = whole("digits", digits, 1, MOST_DIGITS)
    step_limit = MOST_STEPS if step_limit is None else whole("step_limit", step_limit, 1, 10**15)
    jobs = None if jobs is None else whole("jobs", jobs, 1, MOST_JOBS)
    if not isinstance(recompute, bool):
        raise wrong_type("recompute", "True or False", recompute)
    form, events = _asked(formulation, events)
    shape, columns = _columns(given)
    *start, end, bounds = columns
    if omega3 is not None:
        start[8] = start[8] - start[7] * np.cos(start[3])
    states, parameters = _binary(form, start)
    begun = {symbol.name: each for symbol, each in zip(_SYMBOLS, start, strict=True)}
    ahead = outlook(begun, end) if events else None
    first = np.full(end.shape, np.inf)
    if ahead is not None:
        for each in events:
            begins = _at_start(each, begun, ahead) & ((each == "reversal") | (ahead.nods < SMALL))
            first[begins] = np.minimum(first, _short(each, begun, ahead))[begins]
    arrived = _arrived(form, events, states, parameters, (end, bounds, first), step_limit, jobs)
    run = Ensemble(
        shape, form, parameters, events, end, arrived.states, arrived.ending, arrived.zeros,
        digits, begun,
    )  # fmt: skip
    if ahead is not None:
        run = replace(run, zeros=_counted(run, begun, states, ahead))
    return _recomputed(run) if recompute else run


def _recomputed(run: Ensemble) -> Ensemble:
    """The run, with tops that miss what is asked computed one by one as far as `propagate` can."""
    states, ending, off = run.states.copy(), run.ending.copy(), {}
    zeros = [run.zeros]
    for i in np.flatnonzero(run.missed).tolist():
        given = {name: float(each[i]) for name, each in run.start.items()}
        try:
            scene = Scene(
                Top(*(given.pop(name) for name in ("A", "C", "gMR"))), State(**given),
                float(run.end[i]), quantities=("theta", "axis", "rates"), events=run.events,
                samples=2, digits=run.digits,
            )  # fmt: skip
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # `error` tells what is off all the same
                one = propagate(scene)
            exact = one.motion.double(run.end[i : i + 1])
        except HeavyTopError:
            continue
        states[i] = _states(run, i, one.samples)[-1]
        ending[i] = Lane.REACHED
        off[i] = float(np.linalg.norm(one.samples.axis[-1] - exact.axis[-1])) + EPSILON
        for code, event in enumerate(run.events):
            t = one.events.of(event).t
            if not t.size:
                continue
            which, what = (np.full(t.size, number) for number in (i, code))
            zeros.append(Zeros(which, what, t, _states(run, i, one(t))))
    kept = ~np.isin(run.zeros.which, list(off))
    zeros[0] = Zeros(*(getattr(run.zeros, name)[kept] for name in Zeros.__slots__))
    joined = (np.concatenate([getattr(z, n) for z in zeros]) for n in Zeros.__slots__)
    return replace(run, states=states, ending=ending, zeros=_sorted(*joined), recomputed=off)


def _states(run: Ensemble, i: int, at: Sample) -> Array:
    """States of the run's formulation, of the top with a number, where another one has been."""
    top = [np.full(at.t.shape, run.start[name][i]) for name in ("A", "C", "gMR")]
    phi = np.arctan2(at.axis[:, 0], -at.axis[:, 1])
    rates = [at.thetadot, at.phidot, at.psidot]
    return _binary(run.formulation, [*top, at.theta, phi, 0 * phi, *rates])[0]


def _sorted(which: Any, event: Any, t: Array, states: Array) -> Zeros:
    order = np.lexsort((np.abs(t), which))
    return Zeros(which[order], event[order], t[order], states[order])


def _at_start(event: str, start: Starts, ahead: Outlook) -> NDArray[np.bool_]:
    """Where a start is exactly an event."""
    if event == "turning":
        exactly = (ahead.nods > 0) & ((start["thetadot"] == 0) | (start["theta"] == 0))
    else:
        exactly = (ahead.turns_back > 0) & (start["phidot"] == 0)
    return np.asarray(exactly)


def _short(event: str, start: Starts, ahead: Outlook) -> Array:
    """A time after an event at the start, in which there is no other of its kind [s]."""
    short = SHORT / ahead.rate
    if event == "turning":
        return short
    sine, falling = np.sin(start["theta"]), abs(start["thetadot"])  # beside a pole or a cusp
    with np.errstate(all="ignore"):
        again = sine * falling / (falling**2 + abs(start["gMR"] / start["A"]) * sine**2)
    return np.asarray(np.fmin(short, again / 2))


def _counted(run: Ensemble, start: Starts, states: Array, ahead: Outlook) -> Zeros:
    """The zeros that count: those exactly at the start or the end too, each once, and no others.

    What is at the start is known from the numbers given; it may be found beside it, or not at all.
    One that the error does not tell from the end is at the end.
    """
    found, parts, known = run.zeros, [], cast(Any, run.parameters)
    margin = ahead.rounding * ahead.growth / ahead.rate
    for code, event in enumerate(run.events):
        begins = _at_start(event, start, ahead)
        never = (ahead.nods == 0) if event == "turning" else (ahead.turns_back <= 0)
        echo = begins[found.which]
        echo &= abs(found.t) <= _short(event, start, ahead)[found.which] / 2
        here = (found.event == code) & ~never[found.which] & ~echo
        last = np.zeros(run.end.size)
        np.maximum.at(last, found.which[here], abs(found.t[here]))
        zero, slope = event_function(run.formulation, event, run.states, known, run.end)
        with np.errstate(all="ignore"):
            late = -zero / slope * np.sign(run.end)
            ends = (late > 0) & (late <= margin) & (last < abs(run.end) - margin) & ~never
        parts += [(found.which[here], found.event[here], found.t[here], found.states[here])]
        for where, t, at in ((begins, 0 * run.end, states), (ends, run.end, run.states)):
            which = np.flatnonzero(where)
            parts.append((which, np.full(which.size, code), t[which], at[which]))
    return _sorted(*(np.concatenate(each) for each in zip(*parts, strict=True)))


def _asked(formulation: str, events: Sequence[str]) -> tuple[Formulation, tuple[str, ...]]:
    """The formulation of a name, and events that it has, if they are."""
    entry, faults = arguments.parse_options(KIND, {"formulation": formulation}, OPTIONS)
    form = entry["formulation"].build() if entry else None
    known = FORMULATIONS["axis"].build() if form is None else form
    if not isinstance(events, Sequence):
        raise wrong_type("events", "names of events, in a row", events)
    if events:
        each = arguments.one_of({name: name for name in known.events})
        events, wrong = arguments.parse_names(KIND, "events", events, each)
        faults += wrong
    if form is None or faults:
        raise BadScene(tuple(faults))
    return form, tuple(events)


def _columns(given: Mapping[str, ArrayLike]) -> tuple[tuple[int, ...], list[Array]]:
    numbers = [_doubles(*each) for each in given.items()]
    try:
        arrays = np.broadcast_arrays(*numbers)
    except ValueError as error:
        raise NotANumber(f"arrays of numbers that broadcast: {error}") from None
    return arrays[0].shape, [np.ascontiguousarray(each).reshape(-1) for each in arrays]


def _doubles(name: str, given: ArrayLike) -> Array:
    try:
        array = np.asarray(given)
    except ValueError as error:  # lists of different lengths
        raise NotANumber(f"{name}: {error}") from None
    if array.dtype.kind not in "iufb":
        raise NotANumber(f"{name}: numbers come as integers or doubles, not as {array.dtype}")
    return array.astype(np.float64, copy=False)


def _binary(form: Formulation, start: list[Array]) -> tuple[Array, dict[str, Array]]:
    """States at the start (k, n) and constants (k,) by name."""
    with np.errstate(all="ignore"):  # what is no number is found out lane by lane
        values = _start_function(form)(*start)
    rows = [np.broadcast_to(np.asarray(x, dtype=np.float64), start[0].shape) for x in values]
    count = len(form.states)
    names = (p.name for p in form.parameters)
    return np.stack(rows[:count], axis=-1), dict(zip(names, rows[count:], strict=True))


@cache
def _start_function(form: Formulation) -> Any:
    return lambdified((*form.start, *form.parameters.values()), _SYMBOLS)


def _arrived(
    form: Formulation, events: tuple[str, ...], states: Array, parameters: dict[str, Array],
    spans: tuple[Array, Array, Array], step_limit: int | None, jobs: int | None,
) -> Arrived:  # fmt: skip
    """All tops at their ends, in equal shares for the threads."""
    halt = Event()

    def share(part: slice) -> Arrived:
        engine = batch_integrator(form, events, EPSILON)
        used = [parameters[name][part] for name in engine.parameters]
        end, longest, first = (each[part] for each in spans)
        loaded = np.stack(used, axis=-1)
        return engine.run(states[part], loaded, end, step_limit, longest, first, halt)

    size = spans[0].size
    count = max(1, min(jobs or os.cpu_count() or 1, size // 64))
    bounds = np.linspace(0, size, count + 1).astype(int) // 64 * 64  # whole batches
    bounds[-1] = size
    parts = [slice(*pair) for pair in pairwise(bounds)]
    if count == 1:
        return share(parts[0])
    with ThreadPoolExecutor(count) as pool:
        try:
            return _joined(list(pool.map(share, parts)), bounds)
        except BaseException:  # the pool waits for its threads
            halt.set()
            raise


def _joined(shares: list[Arrived], bounds: NDArray[np.int64]) -> Arrived:
    zeros = [
        replace(each.zeros, which=each.zeros.which + first)
        for each, first in zip(shares, bounds, strict=False)
    ]
    return Arrived(
        np.concatenate([each.states for each in shares]),
        np.concatenate([each.ending for each in shares]),
        Zeros(*(np.concatenate([getattr(z, name) for z in zeros]) for name in Zeros.__slots__)),
    )
