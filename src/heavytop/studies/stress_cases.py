"""The cases: motions at which methods are known to fail, and why each is hard.

Numbers are exact texts, so that the truth of a case is the same for every method. Spans end
between turning points, where an error in time shows.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import Any, Final

from heavytop.scene.scene import Scene, load_scene
from heavytop.scene.state import State
from heavytop.scene.top import Top

BOOK: Final = ("3.28e-4", "6.60e-5", "0.0456")  # A, C and gMR of SICM's top
UNIT: Final = (1, "0.5", 1)
BETSCH: Final = ("6.375e-3", "7.5e-4", "0.73575")
Start = dict[str, object]
SPAN: Final = "2.618"  # nutation periods
EVENTS: Final = ("turning", "reversal", "cusp")


@dataclass(frozen=True, slots=True)
class Case:
    """One case.

    Attributes
    ----------
    name : str
    hard : str
        Why it is hard.
    scene : Scene
        It wants the axis.
    counted : bool
        Whether events are counted and held against the exact numbers.
    first_order : bool
        Whether it is solved as u' = sqrt(f(u)), by solvers for equations of the first order.
    """

    name: str
    hard: str
    scene: Scene
    counted: bool = False
    first_order: bool = False

    def document(self) -> dict[str, Any]:
        """Return the case as a row of the document heavytop/stress-cases/1."""
        scene = self.scene
        span = f"{scene.time} s" if scene.periods is None else f"{scene.periods} periods"
        return {
            "name": self.name,
            "top": {name: str(getattr(scene.top, name)) for name in ("A", "C", "gMR")},
            "start": {name: str(value) for name, value in scene.start.given},
            "span": span,
            "why": self.hard,
            "events": self.counted,
        }


@cache
def cases() -> Mapping[str, Case]:
    """Return all cases by name, in their order."""
    found = [*_poles(), *_sleepers(), *_separatrices(), *_reversals(), *_spins(), *_others()]
    return MappingProxyType({case.name: case for case in found})


def _case(
    name: str,
    hard: str,
    top: Any,
    start: Any,
    *,
    counted: bool = False,
    first_order: bool = False,
    **span: Any,
) -> Case:
    scene = Scene(
        Top(*top),
        State(**start),
        quantities=("axis",),
        events=EVENTS if counted else (),
        samples=2,
        name=name,
        digits=10,
        **(span or {"periods": SPAN}),
    )
    return Case(name, hard, scene, counted, first_order)


def _shipped(name: str, hard: str, scene: str, **more: Any) -> Case:
    read = load_scene(scene)
    top = (read.top.A, read.top.C, read.top.gMR)
    return _case(name, hard, top, dict(read.start.given), **more)


def _poles() -> Iterator[Case]:
    hard = "the angles turn as fast as 1/θ beside a pole, and exactly there they jump"
    yield _case("through-top", hard, UNIT, _falling("0"))
    yield _case("through-bottom", hard, UNIT, _falling("0", "-"))
    yield _shipped("planar-rotating", hard, "planar-rotating")
    for power in (2, 4, 6, 8, 10, 12):
        near = f"1e-{power}"
        yield _case(f"near-top-{near}", f"it passes {near} rad from the top", UNIT, _falling(near))
    near = "1e-6"
    bottom = _falling(near, "-")
    yield _case(f"near-bottom-{near}", f"it passes {near} rad from the bottom", UNIT, bottom)
    benchmark = "it passes 7e-7 rad from the bottom in every period, by construction"
    yield _shipped("lie-group", benchmark, "lie-group-benchmark", time=2)
    at_pole = "φ and ψ do not exist apart where it starts"
    yield _case("start-at-top", at_pole, UNIT, {"theta": 0, "thetadot": 1, "omega3": 2})
    beside = "p_φ − p_ψ cosθ cancels: 2e-6 is left of 1e-2"
    yield _shipped("beside-the-top", beside, "sicm-forward-spin-held")


def _falling(near: str, side: str = "") -> Start:
    """A start that passes about `near` rad from the top, or from the bottom with a minus.

    At cosθ = ½ on the side that is passed, p_φ ∓ p_ψ is near times the speed of the pass, which is
    about 1.01 at the top and 1.74 at the bottom.
    """
    if side:
        speed, theta, thetadot = "1.74", "2*pi/3", "1.3"
    else:
        speed, theta, thetadot = "1.01", "pi/3", "-1.3"
    phidot = f"({near}*{speed} {side or '+'} 1/2)*4/3"
    return {"theta": theta, "thetadot": thetadot, "phidot": phidot, "omega3": 2}


def _sleepers() -> Iterator[Case]:
    for sign in "+-":
        for power in (1, 4, 8, 12):
            off = f"1{sign}1e-{power}"
            hard = f"nearly asleep and pushed, its spin {off} times the threshold"
            spins = {"phidot": off, "omega3": f"4*({off})"}
            start: Start = {"theta": "1e-6", "thetadot": "1e-6", **spins}
            yield _case(f"sleeping-{off}", hard, UNIT, start, time=20)
    slow = "a tilt of 1e-6 grows as exp(0.97 t) and falls over: errors grow with it"
    still = {"theta": "1e-6", "phidot": "0.25", "omega3": 1}
    yield _case("falling-asleep", slow, UNIT, still, time=25)
    small = "absolute tolerances are larger than the whole motion"
    yield _case("asleep-1e-6", small, BOOK, {"theta": "1e-6", "psidot": 140}, time=5)
    grows = "a tilt of 1e-6 grows a millionfold"
    yield _case("falling-1e-6", grows, BOOK, {"theta": "1e-6", "psidot": 20}, time=5)


def _separatrices() -> Iterator[Case]:
    hard = "rounding grows as exp(t/2) beside the vertical, which it nears for ever"
    start = {"theta": "pi/3", "phidot": "2/sqrt(3)", "omega3": "2*sqrt(3)"}
    for time in (10, 20, 40, 80, 3000):
        yield _case(f"separatrix-{time}", hard, UNIT, start, time=time)
    slow = "it rests for long beside the vertical, where errors grow"
    yield _shipped("near-separatrix", slow, "near-separatrix", time=45)


def _reversals() -> Iterator[Case]:
    hard = "a cusp is a double root of φ̇: its sign may be seen to change twice, once, or not"
    dropped = {"theta": "0.1", "psidot": 140}
    yield _case("cusp", hard, BOOK, dropped, counted=True)
    for power in (3, 6, 9, 12, 15):
        for sign in "+-":
            kick = f"{sign}1e-{power}"
            near = f"φ̇ = {kick} rad/s at the start: two near zeros of φ̇ or none, and no cusp"
            start = dropped | {"phidot": kick}
            yield _case(f"kick{kick}", near, BOOK, start, counted=True)


def _spins() -> Iterator[Case]:
    for power in range(2, 8):
        spin = f"1e{power}"
        top = (1, f"4/{spin}", 1)
        start = {"theta": "0.5", "phidot": 1, "omega3": spin}
        hard = f"ω3 = {spin} rad/s at the same p_ψ: what sees the spin must follow it"
        yield _case(f"spin-{spin}", hard, top, start)
    for power in range(2, 8):
        spin = f"1e{power}"
        start = {"theta": "0.5", "psidot": spin}
        hard = f"ψ̇ = {spin} rad/s at the same C: a nutation of 4e-{2 * power} rad and no larger"
        yield _case(f"fast-{spin}", hard, UNIT, start, counted=True)
    for power in (4, 6, 8, 10):
        spin = f"1e{power}"
        start = {"theta": "0.5", "thetadot": 1, "phidot": -1, "omega3": spin}
        hard = f"l = {spin} rad/s beside e = 1: a step that is held to the larger loses the axis"
        yield _case(f"kicked-fast-{spin}", hard, (1, 1, 1), start, periods="99.618")


def _others() -> Iterator[Case]:
    for off in ("1e-3", "1e-6", "1e-9", "1e-12", "1e-15", "0"):
        hard = "two roots of the cubic are nearly one: turning points drown in rounding"
        start = {"theta": "pi/3", "phidot": f"10+{off}", "omega3": "140.6"}
        yield _case(f"steady+{off}", hard, BETSCH, start, time=3, counted=True)
    kicked = {"theta": "0.1", "phidot": -15, "psidot": 140}
    yield _case(
        "ten-periods",
        "it is not: only defaults are too loose for it",
        BOOK,
        kicked,
        periods="9.618",
    )
    long = "errors of every step add up: energy says nothing of phase"
    yield _case("hundred-periods", long, BOOK, kicked, periods="99.618")
    yield _case("1e5-periods", long, BOOK, kicked, periods="99999.618")
    first = "θ̇ = ±√f is not Lipschitz at a turning point, and resting there solves it too"
    falling = {"theta": "0.3", "thetadot": 1, "phidot": -2, "psidot": 140}
    yield _case("first-order", first, BOOK, falling, periods="0.8", first_order=True)
