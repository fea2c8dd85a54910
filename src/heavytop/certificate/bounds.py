"""Bounds of the distance of a run from the exact motion, over all times of its steps.

At some points in time both the polynomial of a step and the exact solution are known to more digits
than doubles have, and so is their difference d. Between two points, w apart, it obeys
d' = J d + defect, where J is the Jacobian half way between the two, exactly, for the equations are
quadratic. With m >= mu(J), its logarithmic norm, and D >= |defect|, |d| is at most

    min(a exp(m s) + D (exp(m s) - 1)/m,  b exp(m (w - s)) + D (exp(m (w - s)) - 1)/m)

s after the first point, where |d| = a, and w - s before the second, where |d| = b. The largest of
these minima is at most

    N = sqrt((a + D/m)(b + D/m)) exp(m w/2) - D/m.

The error of a quantity q(y) with |grad q| <= G and |Hess q| <= H is then at most

    (|q(p) - q(x)| at the one point + that at the other + w (G (M N + D) + H V N))/2 + H N^2,

or the larger of the two errors at the points plus H N^2, where M bounds |J| and V the speed of the
motion. An interval that is cut in two has a smaller bound; intervals with a bound above the largest
error found are cut until the bound is near it.
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
Solution = tuple[Array, Array]  # the solution, and a bound of its error

NEAR: Final = 1.3  # times the largest error found: a smaller bound is not improved
MOST_HALVINGS: Final = 24  # of a step: less than 28, so that `INTERVAL_EDGE` is enough
SETTLED: Final = 14  # halvings after which a quantity that is unbounded in many parts is unbounded
NORMS_HOLD: Final = MARGIN / 10  # distance of a run from the exact motion for which norms hold
MOST_PARTS: Final = 200_000  # parts of steps at once: more are not cut
NEARER: Final = 1.05  # as `NEAR`, where a part of the bound that no cut reduces is added,
ROUNDING_SHARE: Final = 0.15  # and this share of the rounding of outputs
SAME: Final = 2.0**-100  # relative: less than the error of a time that `Flow.at` allows for
# factor for an interval, more than twice what `STEP_MARGIN` adds to a part of a step
INTERVAL_EDGE: Final = 1 + 2.0**-20
# relative: theta from a state, by roots and by the library's atan2
THETA_ROUNDING: Final = 6 * UNIT
PRODUCTS: Final = 5 * UNIT  # of a squared length: the axis from a quaternion, by sums of products
ARC: Final = 1 + 1e-7  # bound of angle over sine, below 1e-4 rad


class Points(NamedTuple):
    """The difference of polynomials and exact solution at some times.

    Attributes
    ----------
    step : ndarray of int, shape (m,)
    since : ndarray, shape (m,)
        The time since the beginning of the step.
    difference : ndarray, shape (n, m)
        Polynomial minus exact solution.
    off : ndarray, shape (m,)
        A bound of the error of the difference, in the norm.
    plain : ndarray, shape (m,)
        A bound of the rounding error, in the norm, of a state that is evaluated in doubles.
    size : ndarray, shape (m,)
        The norm of the difference, plus `off`.
    states : ndarray, shape (n, m)
        The polynomials.
    """

    step: Indices
    since: Array
    difference: Array
    off: Array
    plain: Array
    size: Array
    states: Array

    @classmethod
    def at(cls, flow: Flow, steps: Steps, step: Indices, since: Array, known: Solution) -> Points:
        """Return the points at times since the beginnings of steps, by the known solution there."""
        p, arithmetic, plain = steps.at(step, since)
        x, lost = known
        high, low = add(p, (-x[0], -x[1]))
        difference, norm = high + low, flow.system.norms
        # fewer than thirty roundings give the errors to first order from the difference
        off = UP * (lost + norm(arithmetic) + 32 * UNIT * norm(difference))
        return cls(step, since, difference, off, norm(plain), norm(difference) + off, p[0])


class ErrorModel(NamedTuple):
    """The error of a quantity at some points, to first order, and bounds of it around them.

    Attributes
    ----------
    error : ndarray, shape (m,)
    gradient, hessian : ndarray, shape (m,)
        Bounds of its derivatives in the norm, up to `room` from the point; inf at a pole.
    rounding : ndarray, shape (m,) or 0
        A bound of the rounding error of its value, computed from a state.
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
    """Return the errors of quantities, to first order in a change of states.

    `room` is the distance, in the norm, from these states within which the bounds hold. At a pole
    some numbers are not finite.
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
    """Return the errors of quantities of the attitude form, as `_axis_outputs` does."""
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

    Steps are cut where that makes the bounds clearly smaller.

    Parameters
    ----------
    flow : Flow
    steps : Steps
    floor : mapping from str to float
        An error of each quantity that is known to occur: smaller bounds need not be sharp.
    rounding : mapping from str to float
        The rounding error of each quantity later on, which is not in the bound. Only quantities of
        this mapping are bounded.
    deepest : int
        The largest number of halvings of a step.
    """
    D, k = defects(flow.system, steps), np.arange(steps.length.size)
    begun, ended = _step_ends(flow, steps)
    left = Points.at(flow, steps, k, np.zeros(k.size), begun)
    right = Points.at(flow, steps, k, steps.length, ended)
    if not max(ends.size.max(initial=0.0) for ends in (left, right)) < NORMS_HOLD:
        deepest = 0  # the run is too far from the exact motion for any cut
    found, proved = dict(floor), dict[str, float]()
    for depth in range(deepest + 1):
        cut = np.zeros(left.step.size, dtype=bool)
        last = depth == deepest or 2 * cut.size > MOST_PARTS
        here = _errors_at(flow, steps, D, left, right, rounding)
        for name, (error, total, least) in here.items():
            found[name] = max(found.get(name, 0.0), float(error.max(initial=0.0)))
            unbounded = ~np.isfinite(total)
            if depth >= SETTLED and unbounded.sum() > 4 * k.size + 64:  # the axis stays at a pole
                proved[name] = np.inf
                continue
            least = least + ROUNDING_SHARE * rounding[name]
            enough = np.maximum(NEAR * found[name], NEARER * found[name] + least)
            wide = ~(total <= enough) | unbounded
            cut |= wide
            final = total if last else total[~wide]
            proved[name] = max(proved.get(name, 0.0), float(final.max(initial=0.0)))
            if last and np.isnan(total).any():
                proved[name] = np.inf
        if last or not cut.any():
            break
        left, right = (Points._make(x[..., cut] for x in ends) for ends in (left, right))
        since = (left.since + right.since) / 2
        middle = Points.at(flow, steps, left.step, since, flow.at(steps.times(left.step, since)))
        left, right = _join(left, middle), _join(middle, right)
    return found, proved


def _join(a: Points, b: Points) -> Points:
    """Return the points of both."""
    return Points._make(np.concatenate(pair, axis=-1) for pair in zip(a, b, strict=True))


def _step_ends(flow: Flow, steps: Steps) -> tuple[Solution, Solution]:
    """Return the solution at the beginnings and at the ends of steps, which follow one another."""
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
    """Return for each quantity its error at the points, a bound between them, and a part of that.

    The part is due to the roundings of the run itself, and no cut reduces it.
    """
    D, clock, V, A = (x[left.step] for x in (defect, steps.clock, steps.speed, steps.bend))
    width, b = INTERVAL_EDGE * np.abs(right.since - left.since), flow.bounds
    m = max(b.growth, 1e-3 * b.jacobian, 1e-9)
    N = difference_bound(left.size, right.size, width, m, D)
    plain, off = np.maximum(left.plain, right.plain), np.maximum(left.off, right.off)
    spare, outputs, found = 2 * N + plain + V * clock, OUTPUTS[flow.form.name], {}
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        room, rates = _excursion(flow, left, width, V, A, spare)
        first = outputs(left.states, left.difference, room)
        moving = outputs(left.states, rates, room)
        room, _ = _excursion(flow, right, width, V, A, spare)
        second = outputs(right.states, right.difference, room)
        for name in names:
            q, other = first[name], second[name]
            G, H = np.maximum(q.gradient, other.gradient), np.maximum(q.hessian, other.hessian)
            own = np.maximum(np.abs(q.error), np.abs(other.error))
            step = G * (b.jacobian * N + D) + H * V * N
            half = (np.abs(q.error) + np.abs(other.error) + width * step) / 2
            sharp = UP * np.maximum(own, half) + G * off + H * (N + plain) ** 2
            speed = np.abs(moving[name].error)
            # the rate of p is that of the field up to G D, that of x is the rate of p up to `step`
            late = (speed + G * D + step + width * (G * A + H * V**2)) * clock
            late = np.fmin(late, G * (V + b.jacobian * N + D) * clock)
            rounding = np.maximum(q.rounding, other.rounding)
            if name == "theta":  # theta may be larger between the points
                rounding = rounding + THETA_ROUNDING * G * V * width / 2
            rounded = UP * (G * plain + rounding)
            total = UP * (np.fmin(sharp, G * N) + rounded + late)
            total = np.where(N < NORMS_HOLD, total, np.inf)
            finite = np.isfinite(own) & np.isfinite(G)
            of_rounding = np.where(finite, UP * (rounded + speed * clock), 0.0)
            found[name] = np.where(finite, own, 0.0), total, of_rounding
    return found


def _excursion(flow: Flow, points: Points, width: Array, V: Array, A: Array, spare: Array) -> Words:
    """Return a bound of the change of states in half an interval from points, and their rates.

    The states that outputs read move at most by their speed at the point and the bound of its
    change; errors, `spare`, are added. (The speed is that of the field: that of the polynomial
    differs by at most D, and D width/2 < N.)
    """
    rates = np.array(flow.system.rates([*points.states], np.ones_like(points.since)))
    own = rates[: CERTIFIED[flow.form.name].read]
    half, speed = width / 2, np.sqrt((own * own).sum(axis=0))
    return UP * (np.minimum(V * half, speed * half + A * half**2 / 2) + spare), rates
