"""What is asked of a work–precision diagram, and everything that is wrong with it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from heavytop import scene_text
from heavytop.drifts.methods import NoMethod, method
from heavytop.errors import BadScene, Fault
from heavytop.planning import closed_form_of
from heavytop.scene import Scene
from heavytop.workprecs.ladder import AUTO, Trial, trials

BOUNDS: Final = {"periods": (1, 1e6), "budget": (1, 1e6)}


def asked(scene: Scene, methods: Sequence[str], options: Mapping[str, float]) -> tuple[Trial, ...]:
    """Return what is to be tried, none of it twice.

    Parameters
    ----------
    scene : Scene
    methods : sequence of str
    options : mapping from str to float
        ``periods`` and ``budget``.

    Raises
    ------
    BadScene
        Nothing nutates; there is no such method; an option is out of its bounds. Every fault is
        listed.
    """
    faults = [*_out_of_bounds(scene, options), *_no_nutation(scene)]
    found: dict[Trial, None] = {}
    for text in methods:
        try:
            found |= dict.fromkeys(_tried(scene, text, options["periods"], faulty=bool(faults)))
        except NoMethod as wrong:
            shown = scene_text.harmless(text[:60])
            faults.append(Fault(scene.name, None, "methods", shown, wrong.rule, wrong.hint))
    if not methods:
        faults.append(Fault(scene.name, None, "methods", "", "at least one method"))
    if faults:
        raise BadScene(tuple(faults))
    return tuple(found)


def _tried(scene: Scene, text: str, periods: float, *, faulty: bool) -> Sequence[Trial]:
    """Return the trials of a text; of a faulty question only whether there are any."""
    if not faulty:
        return trials(scene, text, periods)
    if text.partition("=")[0] != AUTO:
        method(text)
    return ()


def _out_of_bounds(scene: Scene, options: Mapping[str, float]) -> Iterator[Fault]:
    for name, value in options.items():
        least, most = BOUNDS[name]
        if not least <= value <= most:  # nan too
            yield Fault(scene.name, None, name, str(value), f"from {least:g} to {most:g}")


def _no_nutation(scene: Scene) -> Iterator[Fault]:
    motion = closed_form_of(scene)
    if motion.period is None:
        rule = f"no nutation period to count: {motion.kind}"
        hint = "a work-precision diagram takes a top that nutates"
        yield Fault(scene.name, None, "start", "", rule, hint)
