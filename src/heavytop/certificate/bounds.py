"""How far a run may be from the exact motion, over all times of its steps.

At some points in time both the polynomial of a step and the exact solution are known to more digits
than doubles have, and so is their difference d. Between two points, w apart, it obeys
d' = J d + defect, where J is the Jacobian half way between the two, exactly, for the equations are
quadratic. With m >= mu(J), its logarithmic norm, and D >= |defect|, |d| is at most

    min(a exp(m s) + D (exp(m s) - 1)/m,  b exp(m (w - s)) + D (exp(m (w - s)) - 1)/m)

s after the first point, where |d| = a, and w - s before the second, where |d| = b. The largest of
these minima is at most

    N = sqrt((a + D/m)(b + D/m)) exp(m w/2) - D/m.

A quantity q(y) with |grad q| <= G and |Hess q| <= H is then off by at most

    (|q(p) - q(x)| at the one point + that at the other + w (G (M N + D) + H V N))/2 + H N^2,

or what it is at the worse one, where M bounds |J| and V the speed of the motion. So an interval
that is cut in two has a smaller bound; intervals whose bound is more than the largest error found
are cut until it is near it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from heavytop.certificate.flow import Flow
from heavytop.certificate.steps import Steps, defects
from heavytop.certificate.system import CERTIFIED, UP
from heavytop.certificate.table import MARGIN
from heavytop.exact.pairs import UNIT, Array, Words, add

Indices = NDArray[np.intp]
ByName = Mapping[str, float]
Solution = tuple[Array, Array]  # the solution, and how far it is off

NEAR: Final = 1.3  # a bound so near the largest error found is not made better
MOST_HALVINGS: Final = 24  # halvings of a step: less than 28, or `INTERVAL_EDGE` is too little
SETTLED: Final = 14  # after so many, what is not bounded in many parts is not bounded at all
NORMS_HOLD: Final = MARGIN / 10  # so near the exact motion a run has to be
MOST_PARTS: Final = 200_000  # parts of steps at a time: more are not cut
NEARER: Final = 1.05  # as `NEAR`, beside what no cut makes smaller,
ROUNDING_SHARE: Final = 0.15  # and beside this share of what the outputs are rounded by
SAME: Final = 2.0**-100  # of a time: what `Flow.at` takes it to be off is more
# of an interval, more than twice what `STEP_MARGIN` adds to a part of a step
INTERVAL_EDGE: Final = 1 + 2.0**-20
# relative: theta from a state, by roots and by the library's atan2
THETA_ROUNDING: Final = 6 * UNIT
PRODUCTS: Final = 5 * UNIT  # of a squared length: the axis from a quaternion, by sums of products
ARC: Final = 1 + 1e-7  # of an angle below 1e-4 rad, to its sine


class Points(NamedTuple):
    """Polynomials and the exact solution at some times.

    Attributes
    ----------
    step : ndarray of int, shape (m,)
    since : ndarray, shape (m,)
        The time since the beginning of the step.
    apart : ndarray, shape (n, m)
        What the states are off.
    off : ndarray, shape (m,)
        How well this is known, in the norm.
    plain : ndarray, shape (m,)
        What is lost, in the norm, when a state is evaluated in doubles.
    size : ndarray, shape (m,)
        Of `apart` in the norm, `off` included.
    states : ndarray, shape (n, m)
    """

    step: Indices
    since: Array
    apart: Array
    off: Array
    plain: Array
    size: Array
    states: Array

    @classmethod
    def at(cls, flow: Flow, steps: Steps, step: Indices, since: Array, known: Solution) -> Points:
        """Return those at times since the beginning of steps; `known` is the solution there."""
        p, arithmetic, plain = steps.at(step, since)
        x, lost = known
        high, low = add(p, (-x[0], -x[1]))
        apart, norm = high + low, flow.system.norms
        # errors to first order are made of it by fewer than thirty roundings
        off = UP * (lost + norm(arithmetic) + 32 * UNIT * norm(apart))
        return cls(step, since, apart, off, norm(plain), norm(apart) + off, p[0])


class ErrorModel(NamedTuple):
    """A quantity at some points: its change to first order, and what bounds it beside them.

    Attributes
    ----------
    error : ndarray, shape (m,)
    gradient, hessian : ndarray, shape (m,)
        Bounds of its derivatives in the norm, `room` around the point; inf at a pole.
    rounding : ndarray, shape (m,) or 0
        Of its value, when it is computed from a state.
    """

    error: Array
    gradient: Array
    hessian: Array
    rounding: Array | float = 0.0


def difference_bound(a: Array, b: Array, width: Array, m: float, D: Array) -> Array:
    """Return the bound N of the difference between two points."""
    rest = D / m
    grown = np.sqrt((a + rest) * (b + rest)) * _exp(m * width / 2)
    return np.asarray(UP * (grown - rest * (1 - 1e-14)))


def _exp(x: Array) -> Array:
    """Return an upper bound of exp(x) from sums and products alone, or inf where x > 1."""
    found = 1 + x / 12 * (1 + x)  # the rest of the series is below a geometric one
    for n in range(11, 0, -1):
        found = 1 + x / n * found
    return np.where(x <= 1, UP * found, np.inf)


def _axis_outputs(states: Array, change: Array, room: Array) -> dict[str, ErrorModel]:
    """Return the quantities that states give, to first order in a change of them.

    `room` is how far, in the norm, states may be from those given. At a pole some are not finite.
    """
    (x, y, z), (dx, dy, dz) = states[:3], change[:3]
    r, length = np.sqrt(x * x + y * y), np.sqrt(x * x + y * y + z * z)
    near, least = np.maximum(r - room, 0.0) * (1 - 1e-14), (length - room) * (1 - 1e-14)
    own = np.sqrt(dx * dx + dy * dy + dz * dz)
    along = (x * dx + y * dy) / r  # of the horizontal part
    theta, rounding = np.abs(z * along - r * dz) / length**2, THETA_ROUNDING * np.arctan2(r, z)
    phi = (x * dy - y * dx) / (r * r)
    return {
        "axis": ErrorModel(own, np.ones_like(r), np.zeros_like(r)),
        "theta": ErrorModel(theta, ARC / least, 1 / (least * near), rounding),
        "phi": ErrorModel(phi, 1 / near, 1 / (near * near)),
    }


def _attitude_outputs(q: Array, d: Array, room: Array) -> dict[str, ErrorModel]:
    """Return the quantities of the attitude form, as `_axis_outputs` does."""
    a, b = np.sqrt(q[0] ** 2 + q[3] ** 2), np.sqrt(q[1] ** 2 + q[2] ** 2)
    length = np.sqrt(a * a + b * b)
    near_a, near_b = (np.maximum(x - room, 0.0) * (1 - 1e-14) for x in (a, b))
    least, most = (length - room) * (1 - 1e-14), length + room
    da, db = (q[0] * d[0] + q[3] * d[3]) / a, (q[1] * d[1] + q[2] * d[2]) / b
    theta = 2 * np.abs(a * db - b * da) / (length * length)
    plus = (q[0] * d[3] - q[3] * d[0]) / (a * a)
    minus = (q[1] * d[2] - q[2] * d[1]) / (b * b)
    x = q[1] * d[3] + q[3] * d[1] + q[0] * d[2] + q[2] * d[0]
    y = q[2] * d[3] + q[3] * d[2] - q[0] * d[1] - q[1] * d[0]
    z = q[0] * d[0] - q[1] * d[1] - q[2] * d[2] + q[3] * d[3]
    nearest = np.minimum(near_a, near_b)
    slope, bend = np.sqrt(1 / near_a**2 + 1 / near_b**2), 1 / nearest**2
    axis, rounding = 2 * np.sqrt(x * x + y * y + z * z), 2 * THETA_ROUNDING * np.arctan2(b, a)
    return {
        "axis": ErrorModel(axis, 2 * most, np.full_like(a, 2.0), PRODUCTS * most**2),
        "theta": ErrorModel(theta, 2 * ARC / least, 2 / (least * nearest), rounding),
        "phi": ErrorModel(plus + minus, slope, bend),
        "psi": ErrorModel(plus - minus, slope, bend),
    }


OUTPUTS = {"axis": _axis_outputs, "attitude": _attitude_outputs}


def bound(
    flow: Flow, steps: Steps, floor: ByName, rounding: ByName, deepest: int = MOST_HALVINGS
) -> tuple[dict[str, float], dict[str, float]]:
    """Return the largest errors found, and their proved bounds, over some steps.

    They are cut where it is worth it.

    Parameters
    ----------
    flow : Flow
    steps : Steps
    floor : mapping from str to float
        An error that is known to occur, of each quantity: what is smaller need not be sharp.
    rounding : mapping from str to float
        What each quantity is rounded by later on; that is not in the bound. Others are left out.
    deepest : int
        How often a step is halved at most.
    """
    D, k = defects(flow.system, steps), np.arange(steps.length.size)
    begun, ended = _step_ends(flow, steps)
    left = Points.at(flow, steps, k, np.zeros(k.size), begun)
    right = Points.at(flow, steps, k, steps.length, ended)
    if not max(ends.size.max(initial=0.0) for ends in (left, right)) < NORMS_HOLD:
        deepest = 0  # it is too far from the exact motion, wherever steps are cut
    found, proved = dict(floor), dict[str, float]()
    for depth in range(deepest + 1):
        cut = np.zeros(left.step.size, dtype=bool)
        last = depth == deepest or 2 * cut.size > MOST_PARTS
        here = _errors_at(flow, steps, D, left, right, rounding)
        for name, (error, all_of_it, least) in here.items():
            found[name] = max(found.get(name, 0.0), float(error.max(initial=0.0)))
            endless = ~np.isfinite(all_of_it)
            if depth >= SETTLED and endless.sum() > 4 * k.size + 64:  # it stays at a pole
                proved[name] = np.inf
                continue
            least = least + ROUNDING_SHARE * rounding[name]
            enough = np.maximum(NEAR * found[name], NEARER * found[name] + least)
            wide = ~(all_of_it <= enough) | endless
            cut |= wide
            counts = all_of_it if last else all_of_it[~wide]
            proved[name] = max(proved.get(name, 0.0), float(counts.max(initial=0.0)))
            if last and np.isnan(all_of_it).any():
                proved[name] = np.inf
        if last or not cut.any():
            break
        left, right = (Points._make(x[..., cut] for x in ends) for ends in (left, right))
        since = (left.since + right.since) / 2
        middle = Points.at(flow, steps, left.step, since, flow.at(steps.times(left.step, since)))
        left, right = _join(left, middle), _join(middle, right)
    return found, proved


def _join(a: Points, b: Points) -> Points:
    return Points._make(np.concatenate(pair, axis=-1) for pair in zip(a, b, strict=True))


def _step_ends(flow: Flow, steps: Steps) -> tuple[Solution, Solution]:
    """Return the solution where steps begin, and where they end: there the next one begins."""
    k, length = np.arange(steps.length.size), steps.length
    begun, ended = steps.times(k, np.zeros_like(length)), steps.times(k, length)
    gap = np.abs(ended[0][:-1] - begun[0][1:] + (ended[1][:-1] - begun[1][1:]))
    if not np.all(gap <= SAME * np.abs(begun[0][1:])):
        raise ArithmeticError("steps that do not follow one another")
    high, low = (np.append(a, b[-1:]) for a, b in zip(begun, ended, strict=True))
    x, off = flow.at((high, low))
    return (x[..., :-1], off[:-1]), (x[..., 1:], off[1:])


def _errors_at(
    flow: Flow, steps: Steps, defect: Array, left: Points, right: Points, names: Iterable[str]
) -> dict[str, tuple[Array, Array, Array]]:
    """Return what quantities are off at some points, its bound between, and a part of that.

    The part is what the run itself rounds: no cut makes it smaller.
    """
    D, clock, V, A = (x[left.step] for x in (defect, steps.clock, steps.speed, steps.bend))
    width, b = INTERVAL_EDGE * np.abs(right.since - left.since), flow.bounds
    m = max(b.growth, 1e-3 * b.jacobian, 1e-9)
    N = difference_bound(left.size, right.size, width, m, D)
    plain, off = np.maximum(left.plain, right.plain), np.maximum(left.off, right.off)
    spare, outputs, found = 2 * N + plain + V * clock, OUTPUTS[flow.form.name], {}
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        room, rates = _excursion(flow, left, width, V, A, spare)
        first = outputs(left.states, left.apart, room)
        moving = outputs(left.states, rates, room)
        room, _ = _excursion(flow, right, width, V, A, spare)
        second = outputs(right.states, right.apart, room)
        for name in names:
            q, other = first[name], second[name]
            G, H = np.maximum(q.gradient, other.gradient), np.maximum(q.hessian, other.hessian)
            own = np.maximum(np.abs(q.error), np.abs(other.error))
            step = G * (b.jacobian * N + D) + H * V * N
            half = (np.abs(q.error) + np.abs(other.error) + width * step) / 2
            sharp = UP * np.maximum(own, half) + G * off + H * (N + plain) ** 2
            speed = np.abs(moving[name].error)
            # p moves as the field there does, but for G D, and x as p, but for `step`
            late = (speed + G * D + step + width * (G * A + H * V**2)) * clock
            late = np.fmin(late, G * (V + b.jacobian * N + D) * clock)
            rounding = np.maximum(q.rounding, other.rounding)
            if name == "theta":  # it may be larger in between
                rounding = rounding + THETA_ROUNDING * G * V * width / 2
            rounded = UP * (G * plain + rounding)
            total = UP * (np.fmin(sharp, G * N) + rounded + late)
            total = np.where(N < NORMS_HOLD, total, np.inf)
            there = np.isfinite(own) & np.isfinite(G)
            stays = np.where(there, UP * (rounded + speed * clock), 0.0)
            found[name] = np.where(there, own, 0.0), total, stays
    return found


def _excursion(flow: Flow, points: Points, width: Array, V: Array, A: Array, spare: Array) -> Words:
    """Return how far states come from those at points over half of an interval, and their rates.

    Half of one takes the states that outputs read as far as their speed there and its greatest
    change can, and all errors that much farther. (The speed is that of the field: the polynomial's
    differs by D at most, and D width/2 < N.)
    """
    rates = np.array(flow.system.rates([*points.states], np.ones_like(points.since)))
    own = rates[: CERTIFIED[flow.form.name].read]
    half, speed = width / 2, np.sqrt((own * own).sum(axis=0))
    gone = np.minimum(V * half, speed * half + A * half**2 / 2)
    return UP * (gone + spare), rates
