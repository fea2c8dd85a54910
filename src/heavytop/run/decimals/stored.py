"""Decimals in a file: texts for everybody, and all the bits for this package to read back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from heavytop.hdf5 import array
from heavytop.integration.orbit import Orbit
from heavytop.integration.precise import Found
from heavytop.numbers import Exact
from heavytop.run.decimals.polish import Polisher
from heavytop.run.decimals.reader import DecimalSample
from heavytop.run.decimals.result import Decimals
from heavytop.run.decimals.run import PreciseRun
from heavytop.run.events import Events
from heavytop.run.planning import Plan

SHOWN = ("t", "theta", "phi", "psi", "thetadot", "phidot", "psidot")
Variables = dict[str, Any]


def text_variables(decimals: Decimals) -> Variables:
    """Return samples and events as decimal texts, with the digits that are wanted.

    Over ``t`` they are called ``t_text``, ``theta_text`` and so on, over ``event``
    ``event_t_text``; a text is empty where there is no value.
    """
    samples = [decimals.samples, [event.sample for event in decimals.events]]
    return {
        f"{prefix}{name}_text": (over, _array([decimals.text(getattr(s, name)) for s in each]))
        for prefix, over, each in zip(("", "event_"), ("t", "event"), samples, strict=True)
        for name in SHOWN
    }


def kept_variables(decimals: Decimals) -> Variables:
    """Return the times and states of samples and events with all their bits."""
    samples = [decimals.samples, [event.sample for event in decimals.events]]
    kept: Variables = {"decimal_steps": ((), decimals.steps)}
    for over, each in zip(("t", "event"), samples, strict=True):
        kept[f"decimal_{over}_time"] = (over, _array([_whole(decimals, s.t) for s in each]))
        rows = [[_whole(decimals, x) for x in _own(decimals, s)] for s in each]
        width = len(_own(decimals, decimals.samples[0]))
        states = _array([x for row in rows for x in row]).reshape(-1, width)
        kept[f"decimal_{over}_states"] = ((over, "decimal_state"), states)
        turned = np.array([s.turned for s in each]).reshape(-1, 2)
        kept[f"decimal_{over}_turned"] = ((over, "decimal_angle"), turned)
    return kept


def restored(
    file: Any,
    digits: int,
    chosen: Plan,
    named: Mapping[str, Exact],
    orbit: Orbit,
    events: Events,
    at_poles: Mapping[str, Exact],
) -> Decimals:
    """Return the decimals of a file.

    Parameters
    ----------
    file : h5py.File
    digits : int
    chosen : Plan
    named : mapping from str to Exact
        The scene's numbers, by the symbols of the Lagrangian.
    orbit, events : Orbit and Events
        In double precision.
    at_poles : mapping from str to Exact
        What `rates_at_poles` says of the motion.
    """
    run = PreciseRun.of(chosen, named, orbit)
    samples = tuple(map(run.reader.sample, _found(file, "t")))
    polisher = Polisher(run, at_poles)
    found = _found(file, "event")
    every = zip(events.kind, found, strict=True)
    return Decimals(
        digits=digits,
        run=run,
        samples=samples,
        events=tuple(polisher.event(*each) for each in every),
        steps=int(array(file, "decimal_steps")),
        integrate_s=0.0,
    )


def _found(file: Any, over: str) -> list[Found]:
    names = ("time", "states", "turned")
    times, states, turns = (array(file, f"decimal_{over}_{name}").tolist() for name in names)
    turned = map(tuple, turns)
    every = zip(times, states, turned, strict=True)
    return [Found(str(t), tuple(map(str, row)), angles) for t, row, angles in every]


def _own(decimals: Decimals, sample: DecimalSample) -> tuple[Any, ...]:
    """Return the states that are integrated; angles behind them are read off these."""
    return sample.states[: len(decimals.run.engine.formulation.states)]


def _whole(decimals: Decimals, x: Any) -> str:
    ctx = decimals.run.reader.ctx
    return str(ctx.nstr(x, ctx.dps + 3))  # by which every bit comes back


def _array(texts: Sequence[str | None]) -> Any:
    return np.array([text or "" for text in texts], dtype=str)
