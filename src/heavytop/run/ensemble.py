"""Many tops at once: arrays of starts, integrated in the lanes of vector registers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from heavytop.analytic.ends import Ends, ends_many
from heavytop.analytic.many import motions_many
from heavytop.analytic.motion import Motion
from heavytop.classification.arrays import InputArrays, Mask, with_spin
from heavytop.classification.many import is_impossible
from heavytop.equations import lagrangian as lag
from heavytop.equations.formulation import FORMULATIONS, Formulation
from heavytop.equations.lambdify import lambdify
from heavytop.errors import Fault, HeavyTopError, Impossible, Outcome, refuse
from heavytop.exact.pairs import Array
from heavytop.integration.batch import Batch, Lane, Zeros
from heavytop.integration.outputs import Sample, sample
from heavytop.run.ensemble_events import Expected, count_bounds, filter_zeros, pole_momenta
from heavytop.run.estimates import DOUBLE_DIGITS
from heavytop.scene import arguments
from heavytop.scene.arguments import gather, integer, one_of, parse_names, parse_options

Arrays = Mapping[str, Array]

ENSEMBLE_NAME = "propagate_many"
OUTCOMES = (Outcome.FINISHED, Outcome.SINGULAR, Outcome.STEP_LIMIT)  # by the codes of `Lane`
MOST_STEPS = 10_000_000  # some ten seconds: then a top is given up
_SYMBOLS = (lag.A, lag.C, lag.gMR, *lag.COORDINATES, *lag.VELOCITIES)


@dataclass(frozen=True, eq=False, repr=False)
class Ensemble:
    """Many tops at the ends of their spans.

    Attributes
    ----------
    shape : tuple of int
        The common shape of the arguments; all other arrays are flat, of length k.
    formulation : Formulation
        The equations.
    parameters : mapping from str to ndarray
        The parameters in them, by name, each of shape (k,).
    events : tuple of str
        The event functions whose zeros were looked for.
    end : ndarray, shape (k,)
        Ends [s].
    states : ndarray, shape (k, n)
        States of the formulation there; nan where the end was not reached.
    ending : ndarray of int, shape (k,)
        Codes of how each ended; `outcomes` has the words.
    zeros : Zeros
        Zeros of these event functions: which top, which event, and when; a start or an end exactly
        on an event counts.
    digits : int
        How many decimal digits are wanted.
    start : mapping from str to ndarray
        The starts, by name, each of shape (k,).
    """

    shape: tuple[int, ...]
    formulation: Formulation
    parameters: Arrays
    events: tuple[str, ...]
    end: Array
    states: Array
    ending: NDArray[np.int64]
    zeros: Zeros
    digits: int
    start: Arrays

    def __repr__(self) -> str:
        ended = f"{np.count_nonzero(self.ending != Lane.REACHED)} ended early"
        return f"<Ensemble: {self.shape} tops, {self.formulation.name}, {ended}>"

    @cached_property
    def error(self) -> Array:
        """Distance from the closed form of the start at the end, shape (k,).

        It is the larger of the distance of the axis (a length) and that of θ [rad]; nan where the
        end was not reached, or there is no closed form. The closed form, which `final` and `missed`
        need too, is computed when one of them is first read: in arrays, whose own rounding leaves
        some 1e-15 in each period; where that leaves open whether a top has its `digits`, and where
        it has not, by `heavytop.Motion`, one by one, which takes far longer.
        """
        return self._error_of(self.final, self._exact)

    @cached_property
    def missed(self) -> Mask:
        """Which tops miss their digits or events, shape (k,).

        The end was not reached, `error` is more than 10^-digits max(1, θ), φ or ψ lacks a turn, the
        number of an event is not that of the closed form, or there is no closed form. An event
        within a billionth of the span and of a period of the end may be on either side. Times of
        events are not compared, nor digits of φ and ψ but for those of the axis.
        """
        run, exact = self.final, self._exact
        missed = ~self._has_digits(self.error + exact.doubt, run)
        turned = np.fmax(abs(run.phi - exact.phi), abs(run.psi - exact.psi)) > 1
        missed |= turned & (np.sin(exact.theta) > self.error)  # so far from a pole
        for event in self.events:
            bounds, count = exact.counts[event].copy(), self.count(event)
            for i in np.flatnonzero(np.isnan(bounds[0]) & ~missed).tolist():
                bounds[:, i] = count_bounds(self._motion(i), float(self.end[i]), event)
            missed |= ~((bounds[0] <= count) & (count <= bounds[1]))
        return missed

    @cached_property
    def _exact(self) -> Ends:
        """The closed form at the ends, by `Motion` where the arrays do not show a run to be right.

        A top is therefore called wrong only by numbers that are known to all their digits.
        """
        found, run = ends_many(self.start, self.end), self._sample()
        shown = self._has_digits(self._error_of(run, found) + found.doubt, run)
        for i in np.flatnonzero(~shown & (self.ending == Lane.REACHED)).tolist():
            with suppress(HeavyTopError):  # there may be no closed form
                there = self._motion(i).at(self.end[i])
                found.theta[i], found.phi[i], found.psi[i] = there.theta, there.phi, there.psi
                found.doubt[i] = 0.0
        return found

    def _motion(self, i: int) -> Motion:
        """The exact motion of one top."""
        return Motion(*InputArrays(self.start).one(i))

    def _has_digits(self, error: Array, run: Sample) -> Mask:
        """Where a run has its digits; False where the error is nan."""
        return error <= 10.0**-self.digits * np.fmax(1.0, run.theta)

    def _error_of(self, run: Sample, exact: Ends) -> Array:
        """The larger of the errors of the axis, a length, and of θ [rad]."""
        sine, phi = np.sin(exact.theta), exact.phi
        axis = np.stack((sine * np.sin(phi), -sine * np.cos(phi), np.cos(exact.theta)), axis=-1)
        across: Array = np.linalg.norm(run.axis - axis, axis=-1)
        return np.fmax(abs(run.theta - exact.theta), across)

    def _sample(self, near: Any = None) -> Sample:
        return sample(self.formulation, self.states, self.parameters, self.end, near)

    @property
    def outcomes(self) -> tuple[Outcome, ...]:
        """How each top ended."""
        return tuple(OUTCOMES[code] for code in self.ending.tolist())

    @cached_property
    def final(self) -> Sample:
        """The motion at the ends; φ and ψ are continuous from the start.

        The forms ``axis`` and ``attitude`` have them modulo 2π, and whole turns are those of the
        closed form. The axis form does not integrate ψ: with its attitude it is the closed form's,
        less by as much as φ is more. Other forms integrate both, but ``cubic``, of which they are
        nan.
        """
        form, near = self.formulation, self._exact if self.formulation.phi_wraps else None
        run = self._sample(near)
        if near is None or "psi" in form.outputs:
            return run
        psi = near.psi - np.where(run.axis[:, 2] > 0, 1, -1) * (run.phi - near.phi)
        return replace(run, psi=psi)

    def count(self, event: str) -> NDArray[np.int64]:
        """The number of zeros of an event function, for each top, shape (k,).

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
        Decimal digits of θ and the axis that are wanted at the ends: those that miss them, or have
        a wrong number of events, are marked in `Ensemble.missed`; `propagate` computes one such top
        in as many bits as it takes.
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
    BadScene
        No formulation has this name; `events` are no names of its events; several things are
        wrong, all of which are listed.

    Notes
    -----
    Starts are formed in doubles, where a scene's are rounded once from exact numbers; apart from
    that a top moves as in `propagate`, to rounding. From `omega3` ψ̇ = ω3 − φ̇ cosθ is formed so too,
    and is what `Ensemble.error` knows: where φ̇ is large, beside a pole, its rounding counts.
    ``validation/03_benchmarks.py`` measures both.

    Accuracy: ``tests/run/test_ensemble.py`` holds θ to 3e-12 and times of events to 1e-11 s
    of those of `propagate`; ``validation/43_fuzz.py`` holds the axis, every number of events and
    the turns of thousands of tops, and `Ensemble.error`, to the closed form in balls.

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
    >>> found.missed, found.final.phi.round(6)
    (array([False, False,  True]), array([15.116964, 12.723297,       nan]))
    """
    given = {
        "A": A, "C": C, "gMR": gMR, "theta": theta, "phi": phi, "psi": psi,
        "thetadot": thetadot, "phidot": phidot, "time": time,
    }  # fmt: skip
    with gather() as attempt:
        digits = attempt(integer, "digits", digits, 1, DOUBLE_DIGITS)
        if jobs is not None:
            jobs = attempt(arguments.read_argument, "jobs", jobs, arguments.JOBS)
        form_and_events = attempt(_choose_form, formulation, events)
        given = attempt(with_spin, given, psidot, omega3)
    (form, watched), columns = form_and_events, InputArrays(given)
    start = columns.full()
    end = start.pop("time")
    broken = is_impossible(start["A"], start["C"], start["theta"])
    broken |= ~np.isfinite([*start.values()]).all(axis=0)
    start = {name: np.where(broken, np.nan, x) for name, x in start.items()}  # which is singular
    if "omega3" in start:
        start["psidot"] = start.pop("omega3") - start["phidot"] * np.cos(start["theta"])
    begun, parameters = _binary(form, start)
    expected = [Expected.of(event, start) for event in watched]
    shorts = (np.where(each.risky, each.short, np.inf) for each in expected)
    first = np.min([np.full(end.shape, np.inf), *shorts], axis=0)
    batch = Batch(form, watched, begun, parameters, (end, first), MOST_STEPS)
    run = Ensemble(columns.shape, form, parameters, watched, end, *batch.run(jobs), digits, start)
    return replace(run, zeros=filter_zeros(run, expected)) if watched else run


def _choose_form(formulation: str, events: Sequence[str]) -> tuple[Formulation, tuple[str, ...]]:
    """The formulation of a name, with φ and ψ where it can have them, and the names of events."""
    forms = {"formulation": one_of(FORMULATIONS)}
    found, faults = parse_options(ENSEMBLE_NAME, {"formulation": formulation}, forms)
    known = {event: event for event in ("turning", "reversal")}
    names, wrong = parse_names(ENSEMBLE_NAME, "events", events, one_of(known), least=0)
    if len(names) > len({*names}):
        wrong.append(Fault(ENSEMBLE_NAME, None, "events", ", ".join(names), "each at most once"))
    refuse(faults + wrong)
    entry = found["formulation"]
    return entry.build("angles" if "angles" in entry.variants else None), tuple(names)


def _binary(form: Formulation, start: Arrays) -> tuple[Array, dict[str, Array]]:
    """States at the start, shape (k, n), and constants by name, shape (k,)."""
    with np.errstate(all="ignore"):  # `Batch` finds out lane by lane what is no number
        values = _start_function(form)(*(start[symbol.name] for symbol in _SYMBOLS))
        momenta = pole_momenta(start) if form.phi_wraps else {}
    rows = [np.broadcast_to(np.asarray(x, dtype=float), start["A"].shape) for x in values]
    count = len(form.states)
    names = (p.name for p in form.parameters)
    constants = dict(zip(names, rows[count:], strict=True)) | momenta | _frame(form, start)
    return np.stack(rows[:count], axis=-1), constants


@cache
def _start_function(form: Formulation) -> Any:
    return lambdify((*form.start, *form.parameters.values()), _SYMBOLS)


def _frame(form: Formulation, start: Arrays) -> dict[str, Array]:
    """Mean rates, subtracted from the quadratures of φ and ψ; without them the rates of the start.

    Any rates give the same motion, as in `propagate`.
    """
    if not form.given:
        return {}
    nutating: Any = {name: x for name, x in start.items() if name not in ("phi", "psi")}
    found = motions_many(**nutating)
    means = {"phidot": found.precession / found.period, "psidot": found.spin / found.period}
    rates = (np.where(np.isfinite(x), x, start[name]) for name, x in means.items())
    return dict(zip((rate.name for rate in form.given), rates, strict=True))
