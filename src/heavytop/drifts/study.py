"""A study: what is to be run, as values that can be written down and read again."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

from heavytop import scene_text
from heavytop.drifts.marks import marks
from heavytop.drifts.members import member
from heavytop.drifts.methods import DEFAULT, Method, NoMethod, method
from heavytop.errors import BadScene, Fault
from heavytop.machine import versions
from heavytop.planning import closed_form_of, plan
from heavytop.scene import Scene, read_scene

KIND: Final = "drift"
FORMAT: Final = 1
BOUNDS: Final = {  # of the options, each with the rule in words
    "periods": (1, 1e12),
    "ensemble": (1, 10_000),
    "samples": (2, 10_000),
    "seed": (0, 2**63 - 1),
}


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
            Nothing nutates; there is no such method; an option is out of its bounds. Every fault
            is listed.
        """
        options = {"periods": periods, "ensemble": ensemble, "samples": samples, "seed": seed}
        faults = [*_out_of_bounds(scene, options), *_no_nutation(scene)]
        found, wrong = _methods(scene, methods)
        if faults := faults + wrong:
            raise BadScene(tuple(faults))
        concrete = tuple(_concrete(scene, each, periods) for each in found)
        return cls(scene, _without_twins(concrete), periods, ensemble, samples, seed)

    @classmethod
    def of(cls, identity: Mapping[str, Any]) -> Study:
        """Return the study that an identity describes."""
        return cls(
            _scene(identity["scene"]),
            tuple(method(text) for text in identity["methods"]),
            identity["periods"],
            identity["ensemble"],
            identity["samples"],
            identity["seed"],
        )

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


def _scene(tables: Mapping[str, Any]) -> Scene:
    """Return a scene from its tables; numbers are texts or decimals that say them exactly."""
    whole = {"format": 1, "title": tables["title"], "source": tables["source"]}
    text = scene_text.written(
        {**whole, "top": tables["top"], "start": tables["start"], "span": {"periods": 1}}
    )
    return read_scene(text, where=tables["name"])


def _methods(scene: Scene, texts: Sequence[str]) -> tuple[list[Method], list[Fault]]:
    found, faults = [], []
    for text in texts:
        try:
            found.append(method("taylor-axis") if text == "auto" else method(text))
            if text == "auto":
                found[-1] = replace(found[-1], name="auto")
        except NoMethod as wrong:
            shown = scene_text.harmless(text[:60])
            faults.append(Fault(scene.name, None, "methods", shown, wrong.rule, wrong.hint))
    if not texts:
        faults.append(Fault(scene.name, None, "methods", "", "at least one method"))
    return found, faults


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


def _out_of_bounds(scene: Scene, options: Mapping[str, float]) -> Iterator[Fault]:
    for name, value in options.items():
        least, most = BOUNDS[name]
        if not least <= value <= most:  # nan too
            yield Fault(scene.name, None, name, str(value), f"from {least:g} to {most:g}")


def _no_nutation(scene: Scene) -> Iterator[Fault]:
    motion = closed_form_of(scene)
    if motion.period is None:
        rule = f"no nutation period to count: {motion.kind}"
        yield Fault(scene.name, None, "start", "", rule, "a drift study takes a top that nutates")
