"""A study: what is to be run, as values that can be written down and read again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

from heavytop.errors import BadScene, ForeignFile, HeavyTopError
from heavytop.machine import versions
from heavytop.run.planning import plan
from heavytop.scene.arguments import parse_names, parse_options
from heavytop.scene.scene import Scene
from heavytop.studies import recorded
from heavytop.studies.drifts.marks import marks
from heavytop.studies.drifts.members import STARTS, member
from heavytop.studies.drifts.options import NUMBERS, no_nutation
from heavytop.studies.methods import DEFAULT, Method, NoMethod, method

KIND: Final = "drift"
WHO: Final = "a drift study"
FORMAT: Final = 1


@dataclass(frozen=True)
class Study:
    """Methods, starts and times of a drift study.

    Attributes
    ----------
    scene : Scene
        Its top and start; its span and its wants are not used.
    methods : tuple of Method
    periods : float
        Nutation periods to go.
    ensemble : int
        Starts: the scene's own, and neighbouring ones.
    samples : int
        Times, spread evenly over the decades, at which errors are measured.
    seed : int
        Of the neighbouring starts.
    """

    scene: Scene
    methods: tuple[Method, ...]
    periods: float
    ensemble: int
    samples: int
    seed: int

    @classmethod
    def asked(
        cls,
        scene: Scene,
        methods: Sequence[str] = DEFAULT,
        periods: float = 10_000,
        ensemble: int = 1,
        samples: int = 25,
        seed: int = 0,
    ) -> Study:
        """Return the study that is asked for.

        Raises
        ------
        BadScene
            Nothing nutates; there is no such method; an option is of the wrong kind or out of
            its bounds. Every fault is listed.
        """
        file = str(getattr(scene, "name", "drift"))
        given = {"periods": periods, "ensemble": ensemble, "samples": samples, "seed": seed}
        values, faults = parse_options(file, given, NUMBERS)
        found, wrong = parse_names(file, "methods", methods, _asked)
        if faults := [*faults, *no_nutation(file, scene, WHO), *wrong]:
            raise BadScene(tuple(faults))
        concrete = tuple(_concrete(scene, each, values["periods"]) for each in found)
        return cls(scene, _without_twins(concrete), **values)

    @classmethod
    def of(cls, identity: Mapping[str, Any]) -> Study:
        """Return the study that an identity describes.

        Raises
        ------
        ForeignFile
            It describes none; the message names what is wrong.
        """
        found = recorded.table("identity", identity, ("scene", "methods", *NUMBERS))
        scene = _scene(found["scene"])
        methods = tuple(map(_kept_method, recorded.texts("methods", found["methods"])))
        return cls(scene, methods, **recorded.numbers(found, NUMBERS))

    @cached_property
    def identity(self) -> dict[str, Any]:
        """Everything that the results depend on, for JSON."""
        tables = self.scene.document()
        return {
            "kind": KIND,
            "format": FORMAT,
            "scene": {key: tables[key] for key in ("name", "title", "source", "top", "start")},
            "methods": [each.text for each in self.methods],
            "periods": self.periods,
            "ensemble": self.ensemble,
            "samples": self.samples,
            "seed": self.seed,
            "versions": versions(),
        }

    @property
    def starts(self) -> list[dict[str, float]]:
        """The initial conditions of every start, as doubles; the first is the scene's own."""
        states = (member(self.scene.start, self.seed, k) for k in range(self.ensemble))
        return [{name: float(getattr(state, name)) for name in STARTS} for state in states]

    @property
    def tasks(self) -> tuple[str, ...]:
        """Names of the runs: a method and the number of a start."""
        return tuple(
            self.task_name(each, number)
            for each in self.methods
            if not each.absent
            for number in range(self.ensemble)
        )

    @staticmethod
    def task_name(method: Method, number: int) -> str:
        """Return the name of a run."""
        return f"{method.text}/{number:04d}"

    def task(self, name: str) -> tuple[Method, Scene]:
        """Return the method and the start of a run."""
        text, _, number = name.rpartition("/")
        found = next(each for each in self.methods if each.text == text)
        start = member(self.scene.start, self.seed, int(number))
        return found, Scene(self.scene.top, start, periods=1, name=self.scene.name)

    def marks(self, chosen: Method) -> tuple[float, ...]:
        """Return the times at which a method is looked at, in nutation periods."""
        return marks(min(self.periods, chosen.reach), self.samples)


def _scene(found: object) -> Scene:
    """Return the scene of an identity, whose top nutates."""
    scene = recorded.scene(found)
    try:
        faults = tuple(no_nutation(scene.name, scene, WHO))
    except HeavyTopError as wrong:
        raise ForeignFile(f"scene: {wrong}") from None
    if faults:
        raise ForeignFile(f"scene: {faults[0]}")
    return scene


def _kept_method(text: str) -> Method:
    try:
        return method(text)
    except NoMethod as wrong:
        raise recorded.refused("methods", text, wrong.rule) from None


def _asked(text: str) -> Method:
    """Return a method; auto waits for its periods under its name."""
    return replace(method("taylor-axis"), name="auto") if text == "auto" else method(text)


def _concrete(scene: Scene, asked: Method, periods: float) -> Method:
    """Return what auto stands for in a run of this length."""
    if asked.name != "auto":
        return asked
    wanted = Scene(scene.top, scene.start, periods=periods, quantities=("axis",), events=(),
                   samples=2, name=scene.name)  # fmt: skip
    chosen = plan(wanted)
    form = "axis" if chosen.folded else chosen.formulation
    name = f"taylor-{form}-projected" if chosen.projected or chosen.folded else f"taylor-{form}"
    return method(name)


def _without_twins(found: Sequence[Method]) -> tuple[Method, ...]:
    return tuple({each.text: each for each in found}.values())
