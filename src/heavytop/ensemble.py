"""Many tops at once: arrays of starts, integrated in the lanes of vector registers."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from heavytop import options
from heavytop.errors import BadScene, ImpossibleStart, NotANumber, Outcome
from heavytop.models import lagrangian as lag
from heavytop.models.formulation import Formulation
from heavytop.models.ladder import LADDER
from heavytop.models.numeric import numpy_function
from heavytop.planning import EPSILON
from heavytop.quantities import Sample, sample
from heavytop.state import broken_spin
from heavytop.taylor.batch import Arrived, Lane, Zeros, batch_integrator

Array = NDArray[np.float64]

OUTCOMES = {
    Lane.REACHED: Outcome.FINISHED,
    Lane.SINGULAR: Outcome.SINGULAR,
    Lane.STEP_LIMIT: Outcome.STEP_LIMIT,
}
KIND = "propagate_many"
FORMULATIONS = {"formulation": options.one_of(LADDER)}
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
        Zeros of the events asked for: which top, which event, time and state.
    """

    shape: tuple[int, ...]
    formulation: Formulation
    parameters: Mapping[str, Array]
    events: tuple[str, ...]
    end: Array
    states: Array
    ending: NDArray[np.int64]
    zeros: Zeros

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
        Steps after which a top is given up; those that share its registers are, too.
    longest : array_like
        The longest step [s]. A step longer than the half of a nutation may pass over a turning
        point next to a start on one.
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
        Something is not an array of numbers, which is named, or the shapes do not broadcast.
    BadScene
        No formulation has this name, or it has no such event.

    Notes
    -----
    Starts are formed in doubles, where a scene's are rounded once from exact numbers; apart from
    that a top moves as in `propagate`, to rounding. ``validation/12_many_tops.py`` measures both.

    Accuracy: ``tests/two_ways/test_many_tops.py`` holds θ to 3e-12 and times of events to 1e-11 s
    of those of `propagate`.

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
    form, events = _asked(formulation, events)
    shape, columns = _columns(given)
    *start, end, bounds = columns
    if omega3 is not None:
        start[8] = start[8] - start[7] * np.cos(start[3])
    states, parameters = _binary(form, start)
    arrived = _arrived(form, events, states, parameters, (end, bounds), step_limit, jobs)
    return Ensemble(
        shape, form, parameters, events, end, arrived.states, arrived.ending, arrived.zeros
    )


def _asked(formulation: str, events: Sequence[str]) -> tuple[Formulation, tuple[str, ...]]:
    """The formulation of a name, and events that it has, if they are."""
    rung, faults = options.taken(KIND, {"formulation": formulation}, FORMULATIONS)
    form = rung["formulation"].build(None) if rung else None
    known = LADDER["axis"].build(None) if form is None else form
    if events:
        each = options.one_of({name: name for name in known.events})
        events, wrong = options.named(KIND, "events", events, each)
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
    return numpy_function((*form.start, *form.parameters.values()), _SYMBOLS)


def _arrived(
    form: Formulation, events: tuple[str, ...], states: Array, parameters: dict[str, Array],
    spans: tuple[Array, Array], step_limit: int | None, jobs: int | None,
) -> Arrived:  # fmt: skip
    """All tops at their ends, in equal shares for the threads."""

    def share(part: slice) -> Arrived:
        engine = batch_integrator(form, events, EPSILON)
        used = [parameters[name][part] for name in engine.parameters]
        end, longest = (each[part] for each in spans)
        return engine.run(states[part], np.stack(used, axis=-1), end, step_limit, longest)

    size = spans[0].size
    count = max(1, min(jobs or os.cpu_count() or 1, size // 64))
    bounds = np.linspace(0, size, count + 1).astype(int) // 64 * 64  # whole batches
    bounds[-1] = size
    parts = [slice(*pair) for pair in pairwise(bounds)]
    if count == 1:
        return share(parts[0])
    with ThreadPoolExecutor(count) as pool:
        return _joined(list(pool.map(share, parts)), bounds)


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
