"""The cases of stress tests: motions at which methods are known to fail, and why each is hard.

Numbers are exact texts, the same for every method; spans end between turning points, where an error
in time shows. The condition of a case is the change of the exact axis at the end by relative
changes of axis, angular momentum and gravity at the worst of several times, from the start on.
Beyond a hundred periods it is taken to grow as the time.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from heavytop.analytic.form import Record
from heavytop.analytic.motion import ClosedForm, Motion
from heavytop.classification.reduced import AxisMotion
from heavytop.exact.number import rational_value
from heavytop.exact.pairs import UNIT
from heavytop.run.counts import Counts, count_events
from heavytop.run.plan import closed_form_of, span
from heavytop.scene.scene import Scene, load_scene
from heavytop.scene.scene_file import EVENTS
from heavytop.scene.state import State
from heavytop.scene.top import Top

Start = dict[str, Any]

BOOK: Final = ("3.28e-4", "6.60e-5", "0.0456")  # A, C and gMR of SICM's top
SIMPLE: Final = (1, "0.5", 1)
BETSCH: Final = ("6.375e-3", "7.5e-4", "0.73575")
SPAN: Final = "2.618"  # nutation periods

ROUNDINGS: Final = 16  # of the start, of constants and of steps, that every method may make
FOLLOWED: Final = 100  # periods over which conditions are computed
RESTARTS: Final = 8  # times at which the state is changed for the condition
TRUTH_DIGITS: Final = 60  # of the closed form
CONDITION_STEP: Final = 1e-30  # the relative change
AXIS: Final = 2.0  # how far apart two axes can be


@cache
def cases() -> Mapping[str, Scene]:
    """Return all cases by name, in their order: scenes, whose title says why each is hard.

    Those that want events are judged by them too.
    """
    return MappingProxyType({case.name: case for case in (*_near_poles(), *_other_cases())})


def _case(
    name: str, hard: str, top: Any, *, counted: bool = False, time: Any = None,
    periods: Any = SPAN, **start: Any,
) -> Scene:  # fmt: skip
    """Return a case: a scene that wants the axis, and events too where these are counted."""
    about: Any = {"periods": periods} if time is None else {"time": time}
    about |= {"name": name, "title": hard, "events": EVENTS if counted else ()}
    return Scene(Top(*top), State(**start), quantities=("axis",), samples=2, digits=10, **about)


def _shipped(name: str, hard: str, scene: str, **more: Any) -> Scene:
    """Return a case with top and start of a shipped scene."""
    read = load_scene(scene)
    top = (read.top.A, read.top.C, read.top.gMR)
    return _case(name, hard, top, **dict(read.start.given), **more)


def _near_poles() -> Iterator[Scene]:
    """Yield the cases at the vertical: passes, sleeping tops, separatrices."""
    hard = "φ and ψ turn as fast as 1/θ near a pole, and jump at the pole"
    yield _case("through-top", hard, SIMPLE, **_fall("0"))
    yield _case("through-bottom", hard, SIMPLE, **_fall("0", "-"))
    yield _shipped("planar-rotating", hard, "planar-rotating")
    for near in ("1e-2", "1e-4", "1e-6", "1e-8", "1e-10", "1e-12"):
        hard = f"the axis passes {near} rad from the top"
        yield _case(f"near-top-{near}", hard, SIMPLE, **_fall(near))
    hard = "the axis passes 1e-6 rad from the bottom"
    yield _case("near-bottom-1e-6", hard, SIMPLE, **_fall("1e-6", "-"))
    hard = "the axis passes 7e-7 rad from the bottom in every period, by construction"
    yield _shipped("lie-group", hard, "lie-group-benchmark", time=2)
    hard = "the start is at a pole, where φ and ψ are not defined separately"
    yield _case("start-at-top", hard, SIMPLE, theta=0, thetadot=1, omega3=2)
    hard = "cancellation in p_φ − p_ψ cosθ: 2e-6 is left of 1e-2"
    yield _shipped("beside-the-top", hard, "sicm-forward-spin-held")
    for off in (f"1{sign}1e-{power}" for sign in "+-" for power in (1, 4, 8, 12)):
        hard = f"a pushed, almost sleeping top: its spin is {off} times the threshold"
        pushed: Start = {"thetadot": "1e-6", "phidot": off, "omega3": f"4*({off})"}
        yield _case(f"sleeping-{off}", hard, SIMPLE, time=20, theta="1e-6", **pushed)
    hard = "a tilt of 1e-6 grows as exp(0.97 t) until the top falls; errors grow with it"
    yield _case("falling-asleep", hard, SIMPLE, time=25, theta="1e-6", phidot="0.25", omega3=1)
    hard = "absolute tolerances are larger than the motion itself"
    yield _case("asleep-1e-6", hard, BOOK, time=5, theta="1e-6", psidot=140)
    hard = "a tilt of 1e-6 grows a millionfold"
    yield _case("falling-1e-6", hard, BOOK, time=5, theta="1e-6", psidot=20)
    hard = "the axis approaches the vertical for ever; rounding errors grow as exp(t/2)"
    start: Start = {"theta": "pi/3", "phidot": "2/sqrt(3)", "omega3": "2*sqrt(3)"}
    for time in (10, 20, 40, 80, 3000):
        yield _case(f"separatrix-{time}", hard, SIMPLE, time=time, **start)
    hard = "the axis stays near the vertical for a long time, and errors grow there"
    yield _shipped("near-separatrix", hard, "near-separatrix", time=45)


def _fall(near: str, side: str = "") -> Start:
    """A start that passes about `near` rad from the top, or from the bottom with a minus.

    At cosθ = ½ on the side that is passed, p_φ ∓ p_ψ is near times the speed of the pass, which is
    about 1.01 at the top and 1.74 at the bottom.
    """
    speed, theta, thetadot = ("1.74", "2*pi/3", "1.3") if side else ("1.01", "pi/3", "-1.3")
    phidot = f"({near}*{speed} {side or '+'} 1/2)*4/3"
    return {"theta": theta, "thetadot": thetadot, "phidot": phidot, "omega3": 2}


def _other_cases() -> Iterator[Scene]:
    """Yield the other cases: reversals of φ, fast spins, steady precession, long runs."""
    hard = "a cusp is a double root of φ̇: a sign test may find two changes, one or none"
    yield _case("cusp", hard, BOOK, counted=True, theta="0.1", psidot=140)
    for kick in (f"{sign}1e-{power}" for power in (3, 6, 9, 12, 15) for sign in "+-"):
        hard = f"φ̇ = {kick} rad/s at the start: two close zeros of φ̇ or none, but no cusp"
        yield _case(f"kick{kick}", hard, BOOK, counted=True, theta="0.1", psidot=140, phidot=kick)
    follow = "a method with the spin in its state must follow it"
    for spin in (f"1e{power}" for power in range(2, 8)):
        hard = f"ω3 = {spin} rad/s at the same p_ψ: {follow}"
        yield _case(f"spin-{spin}", hard, (1, f"4/{spin}", 1), theta="0.5", phidot=1, omega3=spin)
    for power in range(2, 8):
        spin = f"1e{power}"
        hard = f"ψ̇ = {spin} rad/s at the same C: the nutation is at most 4e-{2 * power} rad"
        yield _case(f"fast-{spin}", hard, SIMPLE, counted=True, theta="0.5", psidot=spin)
    for spin in ("1e4", "1e6", "1e8", "1e10"):
        hard = f"l = {spin} rad/s and |e| = 1: a step chosen for the larger one loses the axis"
        thrown: Start = {"thetadot": 1, "phidot": -1, "omega3": spin}
        yield _case(f"kicked-fast-{spin}", hard, (1, 1, 1), periods="99.618", theta="0.5", **thrown)
    hard = "two roots of the cubic almost coincide: rounding hides the turning points"
    for off in ("1e-3", "1e-6", "1e-9", "1e-12", "1e-15", "0"):
        start: Start = {"theta": "pi/3", "phidot": f"10+{off}", "omega3": "140.6"}
        yield _case(f"steady+{off}", hard, BETSCH, time=3, counted=True, **start)
    kicked: Start = {"theta": "0.1", "phidot": -15, "psidot": 140}
    hard = "not hard: only loose default tolerances fail"
    yield _case("ten-periods", hard, BOOK, periods="9.618", **kicked)
    hard = "the errors of all steps add up; the energy does not show the phase error"
    yield _case("hundred-periods", hard, BOOK, periods="99.618", **kicked)
    yield _case("1e5-periods", hard, BOOK, periods="99999.618", **kicked)


# --- the truth of a case ---------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class CaseReference:
    """The exact end of a case, and how accurately it can be computed in doubles.

    Attributes
    ----------
    end : float
        The end of the span [s].
    theta : float
        Tilt at the end [rad].
    axis : tuple of 3 float
    condition : float
        The error of the axis at the end in units of a relative error on the way, at least 1.
    counts : mapping from str to (int, int), or None
        The least and the greatest number of events.
    period : float or None
        Nutation period [s].
    angles : tuple of 2 float
        phi and psi at the end [rad].
    rounding : float
        The relative error that every method may make.
    """

    end: float
    theta: float
    axis: tuple[float, float, float]
    condition: float
    counts: Counts | None
    period: float | None
    angles: tuple[float, ...] = (0.0, 0.0)
    rounding: float = ROUNDINGS * UNIT

    def of_angles(self) -> CaseReference:
        """Return the same with the condition of phi and psi in place of that of the axis.

        It is the axis' condition over sinθ, plus the size of the angles: what a rounding of the
        spin does to them.
        """
        sine = math.hypot(*self.axis[:2])
        growth = self.condition / sine if sine else math.inf
        return replace(self, condition=growth + sum(map(abs, self.angles)))

    @property
    def allowed(self) -> float:
        """The error of the axis that is inevitable in doubles."""
        return min(self.rounding * self.condition, AXIS)

    @property
    def digits(self) -> float:
        """Decimal digits of the axis that the condition leaves; with 0 agreement is chance."""
        return math.log10(AXIS / self.allowed)

    def digits_lost(self, error: float) -> float:
        """Return the decimal digits that an error loses beyond the condition, at least 0.

        Examples
        --------
        >>> here = CaseReference(1.0, 0.1, (0.0, 0.1, 1.0), 1.0, None, None)
        >>> here.digits_lost(0.0), round(here.digits_lost(1.776e-13), 2)
        (0.0, 2.0)
        """
        return max(0.0, math.log10(error / self.allowed)) if error > 0 else 0.0


@cache
def reference(name: str) -> CaseReference:
    """Return the truth of a case, by its name."""
    case = cases()[name]
    motion = closed_form_of(case)
    end = span(case, motion)
    exact = motion.at(end, TRUTH_DIGITS)
    x, y, z = map(float, exact.axis)
    condition = max(1.0, _condition(case, motion, end))
    counts = count_events(motion, end) if case.events else None
    theta, *angles = map(float, (exact.theta, exact.phi, exact.psi))
    return CaseReference(end, theta, (x, y, z), condition, counts, motion.period, tuple(angles))


def _condition(scene: Scene, motion: Motion, end: float) -> float:
    """Return the condition of the axis at the end."""
    longest = FOLLOWED * motion.period if motion.period else math.inf
    reach = math.copysign(min(abs(end), longest), end)
    times = (reach * k / RESTARTS for k in range(RESTARTS))
    growths = (_growth(scene.top, motion.at(t, TRUTH_DIGITS), reach - t) for t in times)
    return max(growths) * end / reach


def _growth(top: Top, now: Record, span: float) -> float:
    """Return the norm of the change of the axis after a span, over relative changes of a state.

    Axis, angular momentum and gravity are changed, relative to their sizes.
    """
    ctx = now.theta.context
    A, C, gMR = (x.mpf(ctx) for x in (top.A, top.C, top.gMR))
    axis = np.array(now.axis)
    momentum = np.array(now.omega) + (C / A - 1) * now.omega3 * axis

    def end(numbers: Any) -> Any:
        e, phi = numbers[:3] / ctx.norm(numbers[:3]), ctx.atan2(numbers[0], -numbers[1])
        *known, g, phi0 = map(rational_value, (*e, *numbers[3:], phi))
        source = AxisMotion(known[:3], known[3:], g, phi0=phi0)
        return np.array(ClosedForm(source).at(span, TRUTH_DIGITS).axis)

    here = np.array([*axis, *momentum, gMR / A])
    here[0] += CONDITION_STEP  # off a pole, where phi is not defined
    there, size = end(here), ctx.norm(momentum)
    moves = CONDITION_STEP * np.diag([1, 1, 1, size, size, size, gMR / A])
    moved = ((end(here + move) - there) / CONDITION_STEP for move in moves)
    return math.sqrt(sum(float(x) ** 2 for each in moved for x in each))
