"""What is asked of a work–precision diagram, and everything that is wrong with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Final

from heavytop.errors import BadScene
from heavytop.scene.arguments import Range, parse_names, parse_options
from heavytop.scene.scene import Scene
from heavytop.studies.drifts.options import no_nutation
from heavytop.studies.methods import method
from heavytop.studies.workprecs.ladder import Trial, auto_digits, trials

NUMBERS: Final = {"periods": Range(1, 1e6), "budget": Range(1, 1e6)}


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
    file = str(getattr(scene, "name", "workprec"))
    values, faults = parse_options(file, options, NUMBERS)
    faults += no_nutation(file, scene, "a work-precision diagram")
    read = _none if faults else partial(trials, scene, periods=values["periods"])
    found, wrong = parse_names(file, "methods", methods, read)
    if faults or wrong:
        raise BadScene((*faults, *wrong))
    return tuple(dict.fromkeys(trial for each in found for trial in each))


def _none(text: str) -> tuple[()]:
    """Return no trials of a text that names some: for a faulty question none can be planned."""
    if auto_digits(text) is None:
        method(text)
    return ()
