"""The growth of errors of data: phase, order, constants of the motion, events, its condition."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from typing import Any, Final, NamedTuple

import numpy as np

from heavytop.checking.comparison import FIRST_ERROR, MOMENT_NAMES, Comparison, wrap
from heavytop.errors import HeavyTopError
from heavytop.exact.pairs import Array
from heavytop.scene.quantities import ANGLES
from heavytop.scene.scene_file import EVENTS

ULP: Final = Fraction(1, 2**53)
WINDOWS: Final = 100  # of time, at most, in each of which there is one phase
LEAST_GROWTH: Final = 1e-15  # errors that are no larger do not show a power of time
CERTAIN: Final = 3.0  # standard errors: a phase above that is not 0
LEAST_SWING: Final = 1e-9  # rad: a smaller swing of the tilt is no nutation
LOST_PHASE: Final = 0.05  # of a period: with a larger error the phase is lost
LEAST_TURN: Final = 1e-3  # of the whole swing: a smaller turn is noise
NOISE: Final = 1e-12  # rad: a smaller turn is noise too
HELD: Final = 0.02  # of its exact variation: if it varies less, ψ̇ is constant
ROUNDED: Final = 2.0  # times the effect of rounding, RMS: a smaller error is due to rounding
STAYS: Final = "if the error stays, compare A, C, gMR and start"
REMEDY: Final = f"halve the step or the tolerance; {STAYS}"


class Phase(NamedTuple):
    """The phase error: by how much the data run ahead of the exact motion.

    Attributes
    ----------
    last, rms, max : float
        The one near the end, the root mean square, the one of largest magnitude [s].
    t : float
        The time of the last one [s].
    lost : float or None
        The time when it first exceeds a twentieth of a period [s].
    """

    last: float
    rms: float
    max: float
    t: float
    lost: float | None = None


class Count(NamedTuple):
    """The number of events of a kind.

    Attributes
    ----------
    data : int or None
        In the data; None where their rows are too far apart to count.
    exact, exact_most : int
        In the exact motion, proved; they differ where an event may lie at an end of the data.
    """

    data: int | None
    exact: int
    exact_most: int


# --- phase and growth ----------------------------------------------------------------------------


class PhaseCurve(NamedTuple):
    """The phase error [s] at some times, its summary and power of time; or why there is none."""

    why: str = ""
    t: Array = np.empty(0)
    shifts: Array = np.empty(0)
    phase: Phase | None = None
    growth: float | None = None


def nutates(c: Comparison) -> bool:
    """Whether the exact tilt swings by more than rounding."""
    roots = c.motion.roots
    tilts = c.exact.theta if roots is None else np.arccos(np.clip(roots[:2], -1, 1))
    return bool(np.ptp(tilts) > LEAST_SWING)


def measure_phase(c: Comparison) -> PhaseCurve:
    """The phase error of the data.

    In each window of whole periods it is the shift in time with which the exact tilt fits best, by
    Newton's method from the shift of the window before.
    """
    theta, period = c.derived.get("theta"), c.motion.period
    if theta is None:
        return PhaseCurve("the data have no tilt")
    if not nutates(c) or not period:
        return PhaseCurve("no nutation: no phase")
    if abs(np.exp(2j * np.pi * c.elapsed / period).mean()) > 0.98:
        return PhaseCurve("not told by these rows, which show one phase of the period")
    shift, found = 0.0, []
    for rows in _windows(c.elapsed, period):
        before = shift
        for _ in range(20):
            shifted = c.motion.at(c.elapsed[rows] + shift)
            off, slope = wrap(theta[rows] - shifted.theta), shifted.thetadot
            weight = (slope * slope).sum() or np.inf
            step = float((off * slope).sum() / weight)
            shift += step
            if abs(step) <= 1e-6 * abs(shift) or abs(shift - before) > period / 4:
                break
        if abs(shift - before) > LOST_PHASE * period or abs(shift) > np.ptp(c.elapsed):
            return PhaseCurve("not told by these rows: they fit no shift in time")
        spread = np.sqrt(((off - step * slope) ** 2).mean() / weight)
        found.append((float(c.t[rows].mean()), shift, spread))
    t, shifts, spreads = np.array(found).T
    after, largest = abs(t - c.t[0]), float(shifts[abs(shifts).argmax()])
    growth = _fit_power(after, abs(shifts), np.maximum(spreads, 1e-14 * after))  # rounding
    lost = next(iter(t[abs(shifts) > LOST_PHASE * period].tolist()), None)
    phase = Phase(float(shifts[-1]), rms(shifts), largest, float(t[-1]), lost)
    return PhaseCurve("", t, shifts, phase, growth)


def measure_growth(c: Comparison, curve: Array | None) -> float | None:
    """The power of time with which the RMS of an error in windows of whole periods grows."""
    if curve is None:
        return None
    rows = _windows(c.elapsed, c.motion.period)
    after = np.array([abs(c.elapsed[each].mean()) for each in rows])
    return _fit_power(after, np.array([rms(curve[each]) for each in rows]), LEAST_GROWTH)


def _windows(t: Array, period: float | None) -> list[slice]:
    """Windows of whole periods, or of equal parts of the span; the last has the remaining rows."""
    span = float(t[-1] - t[0])
    unit = period or span / WINDOWS
    count = max(1, min(WINDOWS, int(span / unit), t.size // 5))  # of five rows at least
    width = unit * max(1, int(span / unit / count))
    edges = np.searchsorted(t, t[0] + width * np.arange(1, count))
    return [slice(a, b) for a, b in pairwise(np.unique([0, *edges, t.size]))]


def _fit_power(t: Array, size: Array, spread: Any) -> float | None:
    """The power of time with which sizes grow; None where its standard error is 0.2 or more.

    At least five sizes must be clearly above 0, at times in a ratio of at least four.
    """
    clear = (size > CERTAIN * spread) & (t > 0)
    if clear.sum() < 5 or t[clear].max() < 4 * t[clear].min():
        return None
    line, errors = np.polyfit(np.log(t[clear]), np.log(size[clear]), 1, cov=True)
    return float(line[0]) if np.sqrt(errors[0, 0]) < 0.2 else None


def _fit_line(part: Array, y: Array) -> tuple[float, float]:
    """The rise of a straight line from 0 to 1, and the RMS distance from it."""
    line = np.polyfit(part, y, 1)
    return float(line[0]), rms(y - np.polyval(line, part))


def rms(x: Array) -> float:
    """The root mean square of the numbers that are not nan."""
    return float(np.sqrt(np.nanmean(x**2)))


# --- what acts on the body, and the method -------------------------------------------------------


def find_agent(c: Comparison) -> tuple[str, str] | None:
    """A motor that holds ψ̇, or friction that reduces the spin: a name and a sentence, or None."""
    if c.first_error > FIRST_ERROR:
        return None
    exact, t = c.exact, c.t - c.t[0]
    angles = {name: np.unwrap(c.derived[name]) for name in ANGLES if name in c.derived}
    rates: dict[str, Array] = {f"{name}dot": np.gradient(x, t) for name, x in angles.items()}
    moving = c.replace_values(**rates | dict(c.arrays))  # with differences for missing rates
    theta, psidot = c.derived.get("theta"), moving.arrays.get("psidot")
    omega3 = None
    if "omega_body" in c.values:
        omega3 = c.values["omega_body"][:, 2]
    elif spin := c.spin or moving.spin:
        omega3 = (spin[0] * spin[1]).sum(axis=1)
    if psidot is not None and theta is not None:
        varies, off = float(np.ptp(exact.psidot)), abs(wrap(theta - exact.theta)).max()
        least = HELD * (varies if omega3 is None else min(varies, np.ptp(omega3)))
        held = np.ptp(psidot) < least and abs(psidot[0] - exact.psidot[0]) < HELD * varies
        if held and varies > 1e-3 * abs(exact.psidot).max() and off > HELD * np.ptp(exact.theta):
            words = f"ψ̇ is constant ({psidot.mean():.6g} rad/s) where p_ψ should be"
            return "motor", f"{words}: a motor holds the spin"
    if omega3 is None:
        return None
    if (omega3 * omega3[0] > 0).all():
        slope, off = _fit_line(t / t[-1], np.log(omega3 / omega3[0]))
        begins = abs(omega3[0] / float(exact.omega3[0]) - 1) < HELD
        if begins and slope < -0.01 and off < 0.03 * -slope:  # by 1 % at least, exponentially
            words = f"p_ψ falls as e^(−{-slope / t[-1]:.4g} t) (fit)"
            lost = f"{-100 * np.expm1(slope):.3g} % in all"
            return "friction", f"{words}, {lost}: friction, which this model has not"
    return None


def describe_method(
    c: Comparison,
    curves: dict[str, Array],
    agent: str,
    condition: float,
    shaken: dict[str, Array],
    alone: str = "",
) -> dict[str, Any]:
    """The order of the method, what it conserves, and the floor of the precision of the data.

    `shaken` are the curves of data with random roundings added; `alone` says which rate alone has
    an error.
    """
    momenta = [name for name in ("energy", "p_phi", "p_psi") if name in curves]
    kept: dict[str, Any] = {name: _trend(curves[name]) for name in momenta}
    name = next((x for x in ("axis", "theta") if x in curves), next(iter(curves)))
    if "psi" in curves and np.nanstd(curves["psi"]) > 1e3 * np.nanstd(curves[name]):
        name = "psi"
    error = curves[name][np.isfinite(curves[name])]
    rounding = rms(shaken[name] - curves[name]) if name in shaken else 0.0
    size, first = rms(error), rms(error[: 3 + error.size // 20])
    last = abs(error[-1 - error.size // 10 :]).max()
    early = first > size / 2 and c.origin != "fitted"  # a fit spreads an error over all rows
    floor = -float(np.log10(size)) if LEAST_GROWTH < size < 1e-3 and early else None
    order, sentence = None, REMEDY
    if alone and not agent:
        sentence = alone
    elif size < max(1e-12, condition):
        sentence = "the error is that of rounding"
    elif agent:
        sentence = agent
    elif size < ROUNDED * rounding < np.inf:
        sentence = f"that is the rounding of the numbers, {rounding:.2g}: write more digits"
    elif floor is not None:
        sentence = f"they have {floor:.1f} digits from the first row on, which is their precision"
    elif early:
        begins = c.elapsed[0] == 0 and c.first_error < FIRST_ERROR
        other = "the step is coarse, or the clock, rates of the start or A, C, gMR are others"
        why = other if begins else "the start is another one"
        sentence = f"they are off by {first:.2g} from the first rows on: {why}"
    elif _is_first_order(c, last):
        order = 1
        halves = f"halve the step, and the error at the end, {last:.2g}, halves"
        sentence = f"first order: {halves}; {STAYS}"
    elif kept.get("p_psi") == "kept" != kept["energy"]:
        sentence = f"E {kept['energy']} while p_ψ is kept: {REMEDY}"
    found = {"order": order, "floor_digits": floor, "rounding": rounding or None}
    return found | kept | {"sentence": sentence}


def _is_first_order(c: Comparison, last: float) -> bool:
    """Whether the error per unit of time is about the step, in units of the nutation."""
    if not 0 < last < 1 or not nutates(c) or not c.motion.period:
        return False
    turn = 2 * np.pi / c.motion.period
    step, span = turn * np.diff(c.elapsed).max(), turn * np.ptp(c.elapsed)
    return bool(step < 0.5 and last / max(1.0, span) > step**1.6)


def _trend(curve: Array) -> str:
    """A word for an error of a constant."""
    slope, off = _fit_line(np.linspace(0, 1, curve.size), curve)
    if abs(slope) < max(CERTAIN * off, 1e-12):
        return "kept"
    return "rises" if slope > 0 else "falls"


# --- events --------------------------------------------------------------------------------------


def count_events(c: Comparison) -> dict[str, Count]:
    """The numbers of events of the data and of the exact motion.

    Events of the exact motion are counted from the same rows too: where that count is not the
    proved one, the rows are too far apart, and those of the data are not counted.
    """
    mine = _count_turns(c, *map(c.derived.get, ("theta", "phi")))
    t, period = c.elapsed, c.motion.period
    if not nutates(c):
        return {"turning": Count(mine["turning"], 0, 0)}
    exact, found = _count_turns(c, c.exact.theta, c.exact.phi_mod), {}
    dense = not period or (np.diff(t) < period / 6).all()
    before = 2 * t[0] - t[1] if t[0] < 0 else max(0.0, 2 * t[0] - t[1])
    try:
        c.motion.require_proof()
        for event in EVENTS:  # from the first row to the last, give or take a row
            times = c.motion.events(event)
            least, most = times.count(t[1], t[-2]), times.count(before, 2 * t[-1] - t[-2])
            counted = dense and least <= (exact[event] or 0) <= most
            found[event] = Count(mine[event] if counted else None, least, most)
    except HeavyTopError:
        return {}
    return found


def _count_turns(c: Comparison, theta: Any, phi: Any) -> dict[str, int | None]:
    """The numbers of turns of θ and of φ; a turn of θ where the axis is at rest is a cusp."""
    t, exact, found = c.elapsed, c.exact, dict[str, int | None].fromkeys(EVENTS)
    if theta is not None:
        swing = max(LEAST_TURN * float(np.ptp(exact.theta)) + NOISE, LEAST_SWING * (not nutates(c)))
        tops = _turns(theta, swing)
        found["turning"] = len(tops)
    if phi is not None:
        phi, part = np.unwrap(phi), (t - t[0]) / (t[-1] - t[0])
        swing = np.ptp(exact.phi - np.polyval(np.polyfit(part, exact.phi, 1), part))
        found["reversal"] = len(_turns(phi, LEAST_TURN * swing + NOISE))
        if theta is not None:
            rate = abs(np.gradient(phi, t)[tops])
            found["cusp"] = int((rate < 0.01 * abs(exact.phidot).max()).sum())
    return found


def _turns(x: Array, least: float) -> Any:
    """The rows where x turns, but for turns smaller than `least`."""
    from scipy.signal import find_peaks

    return np.sort(np.concatenate([find_peaks(way * x, prominence=least)[0] for way in (1, -1)]))


# --- the motion's own condition ------------------------------------------------------------------


def measure_condition(c: Comparison) -> float:
    """The largest change of the axis, RMS, when each number changes by half an ulp [rad]."""
    times = c.elapsed[np.linspace(0, c.elapsed.size - 1, 8).astype(int)].tolist()
    rounded = c.with_numbers(theta=float(c.start.theta)).with_numbers(A=float(c.top.A))
    numbers = {name: getattr(rounded.top, name) for name in MOMENT_NAMES}
    held = ("theta", "thetadot", "phidot", c.start.held)
    numbers |= {name: getattr(rounded.start, name) for name in held}

    def axes(c: Comparison) -> Any:
        records: Any = c.motion.at(times, 40)
        return np.array([record.axis for record in records])

    unchanged, moved = axes(rounded), np.zeros(len(times))
    for name, value in numbers.items():
        if value.sign():  # A grows and the others shrink, so that C ≤ 2A and θ ≤ π still hold
            factor = 1 + (ULP if name == "A" else -ULP)
            change = (axes(rounded.with_numbers(**{name: value * factor})) - unchanged) * 2**53
            moved += (change.astype(float) ** 2).sum(axis=1)
    return float(ULP) * float(np.sqrt(moved.max()))
