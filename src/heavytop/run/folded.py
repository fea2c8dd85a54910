"""A motion folded onto half a nutation: known at any time, past or future, at the same cost.

theta is periodic, and phi and psi gain the same in every period. Half a nutation is integrated in
extended precision, and any other time is reduced to it in arithmetic that loses nothing. Where
theta is constant there is nothing to integrate: phi and psi turn uniformly, as they start.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heavytop.errors import BadScene, Fault, Impossible, NotANumber
from heavytop.numbers.decimals import Number, number
from heavytop.run.estimates import LEAST_FOLDED, MOST_TURNS
from heavytop.run.folds.making import Cost, Made, nodding, uniform
from heavytop.run.folds.nodding import Nodding
from heavytop.run.folds.sample import FoldedSample, joined
from heavytop.run.folds.uniform import Uniform
from heavytop.run.planning import closed_form_of, span
from heavytop.scene.arguments import whole
from heavytop.scene.scene import Scene
from heavytop.scene.scene_file import MAX_DIGITS

CHUNK = 4096  # times at once: what is worked on stays in the processor's cache

_WHY_NOT = {
    "asymptotic": "it tends to the vertical and never comes back: there is no period to fold by",
    None: "not proved to nutate: there may be no period to fold by",
}


@dataclass(frozen=True, eq=False, repr=False)
class Folded:
    """The motion of a scene at any time, made by `fold`.

    Call it with a time [s], or with an array of doubles, shape (k,), and it returns a
    `FoldedSample` in doubles. Texts, exact numbers and integers mean what they say, doubles their
    binary value.

    Attributes
    ----------
    scene : Scene
        What was folded.
    digits : int
        Decimal digits: `decimals` is off by at most 10^-digits, and doubles by their rounding.
    course : Nodding or Uniform
        What the motion is folded onto.
    span : mpf
        The end of the scene [s]; its periods are the fold's own, to all digits.
    reach : float
        The farthest time that has these digits, past or future [s]; an array of doubles reaches
        no farther than 2^50 half-periods.
    cost : Cost
        Bits, steps and times that it took.

    Examples
    --------
    >>> import heavytop as ht
    >>> folded = ht.fold(ht.load_scene("sicm-kicked"))
    >>> far = folded("1000000000000.1")
    >>> far.phi_turns, round(far.phi_mod, 12)
    (1165068846382, 2.458574588461)
    """

    scene: Scene
    digits: int
    course: Nodding | Uniform
    span: Number
    reach: float
    cost: Cost

    def __repr__(self) -> str:
        name = self.scene.title or self.scene.name
        return f"<Folded {name!r}: {self.digits} digits up to {self.reach:.3g} s>"

    @property
    def period(self) -> Number | None:
        """T [s], the period of theta; None where it is constant."""
        return self.course.period

    @property
    def precession(self) -> Number | None:
        """What phi gains in a period [rad]; None where theta is constant."""
        return self.course.gains[0]

    @property
    def spin(self) -> Number | None:
        """What psi gains in a period [rad]; None where theta is constant."""
        return self.course.gains[1]

    @property
    def end(self) -> FoldedSample:
        """The motion at the end of the scene, in doubles."""
        return self(self.span)

    def __call__(self, t: Any) -> FoldedSample:
        """Return the motion at a time, or at times of shape (k,) [s], in doubles.

        Raises
        ------
        NotANumber
            A time that is no finite number, or more than one dimension of them.
        Impossible
            A time beyond `reach`.
        """
        if not np.ndim(t):
            return self.course.at(self._time(t))
        times = _doubles(t)
        farthest = min(self.reach, self.course.reach_of_doubles)
        if times.size and np.abs(times).max() > farthest:
            raise _too_far(farthest)
        parts = np.split(times, range(CHUNK, times.size, CHUNK))
        return joined([self.course.at_many(part) for part in parts])

    def decimals(self, t: Any) -> FoldedSample:
        """Return the motion at a time [s], in mpmath numbers of so many digits.

        Parameters
        ----------
        t : number
            Time since the start [s]; texts and integers mean what they say.

        Returns
        -------
        FoldedSample

        Raises
        ------
        NotANumber
            A time that is no finite number.
        Impossible
            A time beyond `reach`.
        """
        return self.course.decimals(self._time(t))

    def _time(self, t: Any) -> Number:
        exact = number(self.course.ctx, t.item() if isinstance(t, np.ndarray) and not t.ndim else t)
        if abs(exact) > self.reach:
            raise _too_far(self.reach)
        return exact


def _too_far(reach: float) -> Impossible:
    rule = f"at most {reach:.3g} s from the start: farther off, digits or turns are lost"
    return Impossible([("t", rule)])


def _doubles(t: Any) -> NDArray[np.float64]:
    given = np.asarray(t)
    if given.dtype.kind not in "fiu" or given.ndim > 1:
        raise NotANumber("t: a number, or an array of doubles of shape (k,)")
    times = given.astype(np.float64)
    rounded = np.abs(times) >= 2.0**53 if given.dtype.kind in "iu" else times != given
    if not np.isfinite(times).all() or rounded.any():
        raise NotANumber("t: finite doubles; what is no double goes one by one, as a text")
    return times


def fold(scene: Scene, digits: int | None = None) -> Folded:
    """Integrate half a nutation, which tells the motion at any time.

    Parameters
    ----------
    scene : Scene
        Its span says how far the digits have to reach, where that is beyond 8e12 periods.
    digits : int, optional
        Decimal digits wanted, from 1 to 10 000 and never fewer than 16; by default the scene's.

    Returns
    -------
    Folded
        The motion at any time, and where its digits end.

    Raises
    ------
    BadScene
        There is no period to fold by: the motion tends to the vertical, or is not proved not to.
        Or half a nutation takes too many bits or steps, or the span holds too many turns.
    NotANumber, Impossible
        Digits that are no whole number from 1 to 10 000.

    Notes
    -----
    Accuracy: ``tests/two_ways/test_folding.py`` holds axis, phi_mod and psi_mod to 1e-13 of the
    closed form 1e12 periods from the start, for every shipped scene that has a period.

    References
    ----------
    Whittaker, *Analytical Dynamics*, sections 71 to 73: the motion repeats itself, but for the
    angles that φ and ψ gain.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> folded = fold(load_scene("sicm-kicked"), digits=16)
    >>> round(folded.period, 12), round(folded(2.0).theta, 12)
    (0.542895518188, 0.42694370531)
    """
    motion = closed_form_of(scene)
    if faults := tuple(_too_far_round(scene)):
        raise BadScene(faults)
    asked = scene.digits if digits is None else whole("digits", digits, 1, MAX_DIGITS)
    wanted = max(LEAST_FOLDED, asked)
    regime = motion.regime if motion.certified else None
    if regime == "steady":
        span(scene, motion)  # refuses periods
        return _folded(scene, wanted, uniform(scene, wanted))
    if regime == "nutating":
        return _folded(scene, wanted, nodding(scene, wanted))
    raise BadScene((Fault(scene.name, None, "fold", str(motion.kind), _WHY_NOT[regime]),))


def _too_far_round(scene: Scene) -> Iterator[Fault]:
    for name in ("phi", "psi"):
        angle = getattr(scene.start, name)
        if abs(float(angle)) > MOST_TURNS:
            rule = f"at most {MOST_TURNS:.3g}: beyond, turns are not counted"
            yield Fault(scene.name, None, f"start.{name}", str(angle), rule)


def _folded(scene: Scene, digits: int, made: Made) -> Folded:
    """Return it, if it reaches to the end of its scene."""
    if abs(made.span) > made.reach:
        key, value = ("time", scene.time) if scene.periods is None else ("periods", scene.periods)
        rule = f"at most {made.reach:.3g} s: farther off, turns are not counted"
        raise BadScene((Fault(scene.name, None, f"span.{key}", str(value), rule),))
    return Folded(scene, digits, made.course, made.span, made.reach, made.cost)
