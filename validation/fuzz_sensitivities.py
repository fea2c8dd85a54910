"""Derivatives of random scenes against differences of the closed form at 130 digits."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache, partial
from typing import Any

import fuzz
import mpmath
import numpy as np

import heavytop as ht
from heavytop.equations import lagrangian as lag
from heavytop.equations.formulation import FORMULATIONS
from heavytop.equations.lambdify import lambdified
from heavytop.errors import BadScene, DoubtfulWarning, EndedEarly
from heavytop.run.planning import start_values

DIGITS, STEP = 130, ht.Exact.of("1e-40")  # the steps in natural sizes
FACTOR = 2  # by which an error may be larger than what is said of it
mp = mpmath.mp.clone()
mp.dps = DIGITS
MP = {"sin": mp.sin, "cos": mp.cos, "sqrt": mp.sqrt}
GIVEN = (lag.A, lag.C, lag.gMR, *lag.COORDINATES, *lag.VELOCITIES)
Values = dict[str, ht.Exact]


def misses(seed: int, count: int, forms: tuple[str, ...] = tuple(FORMULATIONS)) -> list[str]:
    """Return a line for each scene whose derivatives of T, Δφ, Δψ are off by more than they say."""
    found = []
    for scene in fuzz.scenes(seed, count):
        if ht.Motion(scene.top, scene.start).period is None:
            continue
        exact = None
        for form in forms:
            try:
                ours = ht.sensitivities(scene, form)
            except (BadScene, EndedEarly) as refused:
                if form == "attitude":
                    found.append(f"{scene.name}: attitude: {refused}")
                continue
            exact = exact or of_the_closed_form(scene)
            found += [f"{scene.name}: {form}: {wrong}" for wrong in _wrong(ours, exact, scene)]
    return found


def misses_of_matrices(
    seed: int, count: int, forms: tuple[str, ...] = tuple(FORMULATIONS)
) -> list[str]:
    """Return a line for each scene whose state-transition matrix is off by more than it says."""
    found = []
    for scene in fuzz.scenes(seed, count):
        tilt = replace(scene, quantities=("theta",), events=())
        times = [float(scene.time) * part for part in (0.3, 1)]
        course = cache(partial(_neighbours, scene))
        for form in forms:
            try:
                with warnings.catch_warnings(record=True) as told:
                    warnings.simplefilter("always", DoubtfulWarning)
                    ours = ht.state_transition(tilt, form, t=times)
            except (BadScene, EndedEarly):
                continue
            wrong = _wrong_matrix(ours, tilt, form, course)
            if (ours.error > 1e-8).any() and not told:
                wrong.append("no warning")
            found += [f"{scene.name}: {form}: {each}" for each in wrong]
    return found


def _wrong(ours: ht.Sensitivities, exact: dict[str, list[float]], scene: ht.Scene) -> Iterator[str]:
    T = ht.Motion(scene.top, scene.start).period
    for name, truths in exact.items():
        whats = zip(("period", "precession", "spin"), truths, (T, 1, 1), strict=True)
        for what, truth, natural in whats:
            rates = getattr(ours, what)
            if rates is None:
                continue
            size = max(abs(truth), 1e-3 * natural / _size(scene, name, T))
            off = abs(rates[name] - truth) / size
            if not off <= FACTOR * ours.error:
                yield f"d{what}/d{name} {rates[name]}, {truth}: {off:.1e}, says {ours.error:.1e}"


def _size(scene: ht.Scene, name: str, T: float) -> float:
    """Return the natural size of a change: its own, and what is natural where that is zero."""
    least = {"A": 0, "C": 0, "gMR": float(scene.top.A) / T**2, "theta": 1}
    own = getattr(scene.start, name, None) if name != "theta" else 0
    own = getattr(scene.top, name) if own is None else own
    return max(abs(float(own)), least.get(name, 1 / T))


def of_the_closed_form(scene: ht.Scene) -> dict[str, list[float]]:
    """Return the derivatives of T, Δφ, Δψ by everything that a scene gives."""
    start = scene.start
    names = ("theta", "thetadot", "phidot", start.held)
    given = {name: getattr(scene.top, name) for name in ("A", "C", "gMR")}
    given |= {name: getattr(start, name) for name in names}
    T, found = ht.Motion(scene.top, start).period, {}
    for name in given:
        (low, high), step = _ends(given, name, _size(scene, name, T), _turning)
        rise = [b - a for a, b in zip(low, high, strict=True)]
        rise[1:] = [x - 2 * mp.pi * mp.nint(x / (2 * mp.pi)) for x in rise[1:]]
        found[name] = [float(x / step) for x in rise]
    return found


def _turning(values: Values) -> tuple[Any, Any, Any]:
    form = _form(values)
    return form.period, form.precession, form.spin


def _form(values: Values) -> Any:
    v = dict(values)
    top = ht.Top(v.pop("A"), v.pop("C"), v.pop("gMR"))
    return ht.Motion(top, ht.State(**v)).form(DIGITS)


def _ends(
    given: Values, name: str, size: float, value: Callable[[Values], Any]
) -> tuple[list[Any], Any]:
    """Return what stands on either side, or on one where the other is impossible; and how far."""
    step, found, width = ht.Exact.of(size) * STEP, [], -1
    for sign in (-1, 1):
        try:
            found.append(value(given | {name: given[name] + sign * step}))
            width += 1
        except ht.HeavyTopError:
            found.append(value(given))
    return found, (1 + width) * step.mpf(mp)


def _neighbours(scene: ht.Scene, name: str) -> tuple[list[Any], Any]:
    """Return the closed forms on either side of a scene, one of its numbers moved."""
    T = ht.Motion(scene.top, scene.start).period or abs(float(scene.time))
    size = 1.0 if name in ("phi", "psi") else _size(scene, name, T)
    return _ends(start_values(scene), name, size, lambda values: (values, _form(values)))


def _wrong_matrix(ours: ht.Transition, scene: ht.Scene, name: str, course: Any) -> list[str]:
    form = FORMULATIONS[name].build(ht.plan(scene, name).variant)
    form = form.integrated or form
    function = lambdified([form.start, list(form.parameters.values())], GIVEN, mp.mpf, MP)
    kept = [i for i, p in enumerate(form.parameters) if p.name in ours.parameters]
    moved = [(s.name, *course(s.name)) for s in GIVEN]
    _, values = function(*(x.mpf(mp) for x in start_values(scene).values()))
    sizes = abs(np.array([values[i] for i in kept], dtype=float))
    found = []
    for i, t in enumerate(ours.times):
        whole = np.hstack((ours.matrix[i], ours.by_parameters[i]))
        columns = abs(whole).max(axis=0)
        if sizes.any():  # a column counts as a thousandth of the largest, each times its parameter
            least = 1e-3 * (columns[-sizes.size :] * sizes).max()
            rest = np.divide(least, sizes, out=np.zeros_like(sizes), where=sizes > 0)
            columns[-sizes.size :] = np.maximum(columns[-sizes.size :], rest)
        for x, ends, width in moved:
            one, other = (_exactly(function, kept, form.name, *end, t) for end in ends)
            first, later = ((b - a) / width for a, b in zip(one, other, strict=True))
            first, later = first.astype(float), later.astype(float)
            off = abs(whole @ first - later).max()
            rounding = 8 * 2.0**-52 * (abs(whole) @ abs(first)).max()  # of this sum itself
            allowed = FACTOR * ours.error[i] * (columns @ abs(first)) + rounding
            if not off <= allowed:
                found.append(f"d/d{x} at {t:.3g}: off {off:.1e} of {allowed:.1e} allowed")
    return found


def _exactly(
    function: Any, kept: list[int], name: str, values: Values, form: Any, t: float
) -> tuple[Any, Any]:
    """Return states and parameters at the start, and the states at a time."""
    start = {key: x.mpf(mp) for key, x in values.items()}
    record = form(ht.Exact.of(t))
    now = start | {key: mp.mpf(getattr(record, key)) for key in list(start)[3:]}
    if name == "attitude":
        spin = start["C"] * (start["psidot"] + start["phidot"] * mp.cos(start["theta"]))
        now["psi"] -= spin * (1 / start["C"] - 1 / start["A"]) * mp.mpf(t)
    states, parameters = function(*(start[s.name] for s in GIVEN))
    later, _ = function(*(now[s.name] for s in GIVEN))
    return np.array([*states, *(parameters[i] for i in kept)]), np.array(later)
