"""How far a run may be from the exact motion, over all times of its steps.

At some times, the anchors, both the polynomial of a step and the exact solution are known to more
digits than doubles have, and so is their difference d. Between two anchors, w apart, it obeys
d' = J d + defect, where J is the Jacobian half way between the two, exactly, for the equations are
quadratic. With m >= mu(J), its logarithmic norm, and D >= |defect|, |d| is at most

    min(a exp(m s) + D (exp(m s) - 1)/m,  b exp(m (w - s)) + D (exp(m (w - s)) - 1)/m)

s after the first anchor, where |d| = a, and w - s before the second, where |d| = b. The largest of
these minima is at most

    N = sqrt((a + D/m)(b + D/m)) exp(m w/2) - D/m.

A quantity q(y) with |grad q| <= G and |Hess q| <= H is then off by at most

    (|q(p) - q(x)| at the one anchor + that at the other + w (G (M N + D) + H V N))/2 + H N^2,

or what it is at the worse one, where M bounds |J| and V the speed of the motion. So an interval
that is cut in two has a smaller bound; intervals whose bound is more than the largest error found
are cut until it is near it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from heavytop.certificate.balls import UNIT
from heavytop.certificate.flow import MARGIN, READ, Flow, Quadrature
from heavytop.certificate.steps import UP, Steps, defects, residuals
from heavytop.exact.pairs import add

Array = NDArray[np.float64]
Words = tuple[Array, Array]

# A bound so near the largest error found is not made better; psi is rounded the most later on.
NEAR: Final = {"axis": 1.45, "theta": 1.45, "phi": 1.45, "psi": 1.3}
DEEPEST: Final = 24  # halvings of a step: less than 28, or `EDGE` is too little
SETTLED: Final = 14  # after so many, what is not bounded in many parts is not bounded at all
MOST: Final = 200_000  # parts of steps at a time: more are not cut
NEARER: Final = 1.05  # as `NEAR`, beside what no cut makes smaller,
SHARE: Final = 0.25  # and beside this share of what the outputs are rounded by
SAME: Final = 2.0**-100  # of a time: what `Flow.at` takes it to be off is more
EDGE: Final = 1 + 2.0**-20  # of an interval, more than twice what `BEYOND` adds to a part of a step
ROOT: Final = 1.4143  # |arccos a - arccos b| is less than this times the root of |a - b| < 1e-4
ROUNDED: Final = 6 * UNIT  # relative: theta from a state, by roots and by the library's atan2
PRODUCTS: Final = 5 * UNIT  # of a squared length: the axis from a quaternion, by sums of products
ARC: Final = 1 + 1e-7  # of an angle below 1e-4 rad, to its sine


@dataclass
class Anchors:
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
    plain, aside : ndarray, shape (m,)
        What is lost, in the norm, when a state is evaluated in doubles, and what in the quadrature.
    size : ndarray, shape (m,)
        Of `apart` in the norm, `off` included.
    states : ndarray, shape (n, m)
    """

    step: NDArray[np.intp]
    since: Array
    apart: Array
    off: Array
    plain: Array
    aside: Array
    size: Array
    states: Array

    @classmethod
    def at(
        cls,
        flow: Flow,
        steps: Steps,
        step: NDArray[np.intp],
        since: Array,
        known: tuple[Words, Array, Array] | None = None,
    ) -> Anchors:
        """Return those at times since the beginning of steps; `known` is the solution there."""
        weights = np.array(flow.system.weights)[:, None]
        n = len(weights)
        p, arithmetic, plain = steps.at(step, since)
        if known is None:
            label = steps.label[0][step], steps.label[1][step]
            known = flow.at(add(label, (since, np.zeros_like(since))))
        x, lost, lost_aside = known
        high, low = add(p, (-x[0], -x[1]))
        apart = high + low

        def norm(y: Array) -> Array:
            found: Array = UP * np.sqrt(((weights * y[:n]) ** 2).sum(axis=0))
            return found

        # errors to first order are made of it by fewer than thirty roundings
        off = UP * (lost + norm(arithmetic) + 32 * UNIT * norm(apart))
        aside = arithmetic[n:].sum(axis=0) + plain[n:].sum(axis=0) + lost_aside
        aside = aside + 4 * UNIT * np.abs(apart[n:]).sum(axis=0)
        size = norm(apart) + off
        return cls(step, since, apart, off, norm(plain), aside, size, p[0])


@dataclass(frozen=True, slots=True)
class QuantityBound:
    """A quantity at anchors: its change to first order, and what bounds it beside them.

    Attributes
    ----------
    error : ndarray, shape (m,)
    gradient, hessian : ndarray, shape (m,)
        Bounds of its derivatives in the norm, `room` around the anchor; inf at a pole.
    rounding : ndarray, shape (m,) or 0
        Of its value, when it is computed from a state.
    aside, factor : ndarray, shape (m,) or 0
        How fast the part of it that is a quadrature can come off, by an error of the states, and
        by its own defect.
    """

    error: Array
    gradient: Array
    hessian: Array
    rounding: Array | float = 0.0
    aside: Array | float = 0.0
    factor: Array | float = 0.0


def between(a: Array, b: Array, width: Array, m: float, D: Array) -> Array:
    """Return the bound N of the difference between two anchors."""
    rest = D / m
    grown = np.sqrt((a + rest) * (b + rest)) * _exp(m * width / 2)
    found: Array = UP * (grown - rest * (1 - 1e-14))
    return found


def _exp(x: Array) -> Array:
    """Return an upper bound of exp(x), x >= 0, from sums and products alone."""
    halvings = max(0, int(np.ceil(np.log2(max(float(x.max()), 1e-300)))) + 1)
    y = x / 2**halvings  # at most a half
    found = 1 + y / 6 * (1 + y / 3)  # the rest of the series is below a geometric one
    for n in (5, 4, 3, 2, 1):
        found = 1 + y / n * found
    for _ in range(halvings):
        found = found * found
    bound: Array = UP * found
    return bound


def quantities(
    flow: Flow, states: Array, change: Array, room: Array
) -> Mapping[str, QuantityBound]:
    """Return the quantities that states give, to first order in a change of them.

    `room` is how far, in the norm, states may be from those given. At a pole some are not finite.
    """
    of = {"axis": _of_axis, "attitude": _of_attitude, "cubic": _of_cubic}[flow.form.name]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        found = of(states, change, room)
        if flow.quadrature:
            found["psi"] = _beside(flow.quadrature, states, change, room, found["phi"])
        return found


def _of_axis(states: Array, change: Array, room: Array) -> dict[str, QuantityBound]:
    (x, y, z), (dx, dy, dz) = states[:3], change[:3]
    r, length = np.sqrt(x * x + y * y), np.sqrt(x * x + y * y + z * z)
    near, least = np.maximum(r - room, 0.0) * (1 - 1e-14), (length - room) * (1 - 1e-14)
    own = np.sqrt(dx * dx + dy * dy + dz * dz)
    along = (x * dx + y * dy) / r  # of the horizontal part
    theta = np.abs(z * along - r * dz) / (length * length)
    phi = (x * dy - y * dx) / (r * r)
    return {
        "axis": QuantityBound(own, np.ones_like(r), np.zeros_like(r)),
        "theta": QuantityBound(theta, ARC / least, 1 / (least * near), ROUNDED * np.arctan2(r, z)),
        "phi": QuantityBound(phi, 1 / near, 1 / (near * near)),
    }


def _of_attitude(q: Array, d: Array, room: Array) -> dict[str, QuantityBound]:
    a, b = np.sqrt(q[0] ** 2 + q[3] ** 2), np.sqrt(q[1] ** 2 + q[2] ** 2)
    length = np.sqrt(a * a + b * b)
    near_a, near_b = (np.maximum(x - room, 0.0) * (1 - 1e-14) for x in (a, b))
    least = (length - room) * (1 - 1e-14)
    da, db = (q[0] * d[0] + q[3] * d[3]) / a, (q[1] * d[1] + q[2] * d[2]) / b
    theta = 2 * np.abs(a * db - b * da) / (length * length)
    plus = (q[0] * d[3] - q[3] * d[0]) / (a * a)
    minus = (q[1] * d[2] - q[2] * d[1]) / (b * b)
    x = q[1] * d[3] + q[3] * d[1] + q[0] * d[2] + q[2] * d[0]
    y = q[2] * d[3] + q[3] * d[2] - q[0] * d[1] - q[1] * d[0]
    z = q[0] * d[0] - q[1] * d[1] - q[2] * d[2] + q[3] * d[3]
    nearest = np.minimum(near_a, near_b)
    slope, bend = np.sqrt(1 / near_a**2 + 1 / near_b**2), 1 / nearest**2
    axis = 2 * np.sqrt(x * x + y * y + z * z)
    return {
        "axis": QuantityBound(
            axis, 2 * (length + room), np.full_like(a, 2.0), PRODUCTS * (length + room) ** 2
        ),
        "theta": QuantityBound(
            theta, 2 * ARC / least, 2 / (least * nearest), 2 * ROUNDED * np.arctan2(b, a)
        ),
        "phi": QuantityBound(plus + minus, slope, bend),
        "psi": QuantityBound(plus - minus, slope, bend),
    }


def _of_cubic(states: Array, change: Array, room: Array) -> dict[str, QuantityBound]:
    w, d = states[0], change[0]
    low, high = (np.maximum(x - room, 0.0) * (1 - 1e-14) for x in (w, 2 - w))
    theta = np.abs(d) / np.sqrt(w * (2 - w))
    squared = low * high
    root = np.sqrt(squared)
    return {"theta": QuantityBound(theta, 1 / root, 1 / (squared * root), ROUNDED * np.pi)}


def _beside(
    quadrature: Quadrature, states: Array, change: Array, room: Array, phi: QuantityBound
) -> QuantityBound:
    """Return psi of the axis form: the quadrature less phi, or its negative."""
    side, momentum, _ = quadrature
    least = np.maximum(1 + side * states[2] - room, 0.0) * (1 - 1e-14)
    aside = abs(momentum) / (least * least)
    psi = change[-1] - phi.error
    return QuantityBound(psi, phi.gradient, phi.hessian, 0.0, aside, (1 + 1e-14) / least)


@dataclass
class Bound:
    """The largest error found of each quantity, and the proved bound of it."""

    found: dict[str, float]
    proved: dict[str, float]


def bound(
    flow: Flow,
    steps: Steps,
    floor: Mapping[str, float],
    rounding: Mapping[str, float],
    deepest: int = DEEPEST,
) -> Bound:
    """Return what is found and proved over some steps, cutting them where it is worth it.

    Parameters
    ----------
    flow : Flow
    steps : Steps
    floor : mapping from str to float
        An error that is known to occur, of each quantity: what is smaller need not be sharp.
    rounding : mapping from str to float
        What each quantity is rounded by later on; that is not in the bound.
    deepest : int
        How often a step is halved at most.
    """
    D, k = defects(flow.system, steps), np.arange(steps.length.size)
    R = residuals(flow.quadrature, steps) if flow.quadrature else np.zeros_like(D)
    begun, ended = _at_both_ends(flow, steps)
    left = Anchors.at(flow, steps, k, np.zeros(k.size), begun)
    right = Anchors.at(flow, steps, k, steps.length, ended)
    found: dict[str, float] = dict(floor)
    proved: dict[str, float] = {}
    for depth in range(deepest + 1):
        last, cut = depth == deepest, np.zeros(left.step.size, dtype=bool)
        last = last or 2 * cut.size > MOST
        for name, (error, all_of_it, least) in _bounded(flow, steps, (D, R), left, right).items():
            found[name] = max(found.get(name, 0.0), float(error.max(initial=0.0)))
            endless = ~np.isfinite(all_of_it)
            if depth >= SETTLED and endless.sum() > 4 * k.size + 64:  # it stays at a pole
                proved[name] = np.inf
                continue
            least = least + SHARE * rounding[name]
            enough = np.maximum(NEAR[name] * found[name], NEARER * found[name] + least)
            wide = ~(all_of_it <= enough) | endless
            cut |= wide
            counts = all_of_it if last else all_of_it[~wide]
            proved[name] = max(proved.get(name, 0.0), float(counts.max(initial=0.0)))
            if last and np.isnan(all_of_it).any():
                proved[name] = np.inf
        if last or not cut.any():
            break
        left, right = _taken(left, cut), _taken(right, cut)
        middle = Anchors.at(flow, steps, left.step, (left.since + right.since) / 2)
        left, right = _joined(left, middle), _joined(middle, right)
    return Bound(found, proved)


def _at_both_ends(
    flow: Flow, steps: Steps
) -> tuple[tuple[Words, Array, Array], tuple[Words, Array, Array]]:
    """Return the solution where steps begin, and where they end: there the next one begins."""
    begun, k = steps.label, np.arange(steps.length.size)
    ended = add(begun, (steps.length, np.zeros_like(steps.length)))
    gap = np.abs(ended[0][:-1] - begun[0][1:] + (ended[1][:-1] - begun[1][1:]))
    apart = np.ones(k.size, dtype=bool)
    apart[:-1] = ~(gap <= SAME * np.abs(begun[0][1:]))
    high, low = (np.concatenate((a, b[apart])) for a, b in zip(begun, ended, strict=True))
    (x_high, x_low), *off = flow.at((high, low))
    place = k + 1
    place[apart] = k.size + np.arange(apart.sum())

    def taken(places: NDArray[np.intp]) -> tuple[Words, Array, Array]:
        return (x_high[:, places], x_low[:, places]), off[0][places], off[1][places]

    return taken(k), taken(place)


def _bounded(
    flow: Flow, steps: Steps, defect: tuple[Array, Array], left: Anchors, right: Anchors
) -> dict[str, tuple[Array, Array, Array]]:
    """Return what each quantity is off at the anchors, its bound between, and a part of that.

    The part is what the run itself rounds: no cut makes it smaller.
    """
    D, R, clock, V, A = (
        each[left.step] for each in (*defect, steps.clock, steps.speed, steps.bend)
    )
    width, b = EDGE * np.abs(right.since - left.since), flow.bounds
    m = max(b.growth, 1e-3 * b.jacobian, 1e-9)
    N = between(left.size, right.size, width, m, D)
    plain, off = np.maximum(left.plain, right.plain), np.maximum(left.off, right.off)
    aside = np.maximum(left.aside, right.aside)
    if not (N.max(initial=0.0) < MARGIN / 10 and not np.isnan(N).any()):
        return _nothing(flow, left)
    spare = 2 * N + plain + V * clock
    room, rates = _room(flow, left, width, (V, A), spare)
    first = quantities(flow, left.states, left.apart, room)
    moving = quantities(flow, left.states, rates, room)
    room, _ = _room(flow, right, width, (V, A), spare)
    second = quantities(flow, right.states, right.apart, room)
    found = {}
    with np.errstate(invalid="ignore", over="ignore"):
        for name, q in first.items():
            other = second[name]
            G, H = np.maximum(q.gradient, other.gradient), np.maximum(q.hessian, other.hessian)
            aside_rate = np.maximum(q.aside, other.aside)
            own = np.maximum(np.abs(q.error), np.abs(other.error))
            step = G * (b.jacobian * N + D) + H * V * N
            crude, extra, wrong = G * N, np.zeros_like(N), G * D
            if name == "psi" and flow.quadrature:
                beside = R * np.maximum(q.factor, other.factor)
                step, wrong = step + aside_rate * N + beside, wrong + beside
                crude, extra = np.full_like(N, np.inf), aside
            half = (np.abs(q.error) + np.abs(other.error) + width * step) / 2
            sharp = UP * np.maximum(own, half) + G * off + H * (N + plain) ** 2
            speed = np.abs(moving[name].error)
            # p moves as the field there does, but for `wrong`, and x as p, but for `step`
            late = (speed + wrong + step + width * (G * A + H * V**2 + aside_rate * V)) * clock
            fastest = G * (V + b.jacobian * N + D) * clock
            late = late if name == "psi" else np.fmin(late, fastest)
            rounding = np.maximum(q.rounding, other.rounding)
            if name == "theta" and flow.form.name != "cubic":  # it may be larger in between
                rounding = rounding + ROUNDED * G * V * width / 2
            rounded = UP * (G * plain + extra + rounding)
            total = UP * (np.fmin(sharp, crude) + rounded + late)
            if flow.form.name == "cubic":  # at a pole the tilt is the root of a height
                off_by = N + plain + (V + b.jacobian * N + D) * clock
                total = np.fmin(total, ROOT * np.sqrt(off_by) + rounding)
            there = np.isfinite(own) & np.isfinite(G)
            stays = np.where(there, UP * (rounded + speed * clock), 0.0)
            found[name] = np.where(there, own, 0.0), total, stays
    return found


def _room(
    flow: Flow, anchors: Anchors, width: Array, derivatives: tuple[Array, Array], spare: Array
) -> tuple[Array, Array]:
    """Return how far states come from those at anchors over half of an interval, and their rates.

    Half of one takes the states that outputs read as far as their speed there and its greatest
    change can, and all errors that much farther. (The speed is that of the field: the polynomial's
    differs by D at most, and D width/2 < N.)
    """
    fastest, bend = derivatives
    rates = flow.system.field(anchors.states[: len(flow.system.weights)])
    own = rates[: READ[flow.form.name]]
    half, speed = width / 2, np.sqrt((own * own).sum(axis=0))
    gone = np.minimum(fastest * half, speed * half + bend * half**2 / 2)
    if flow.quadrature:
        side, momentum, frame = flow.quadrature
        rates = np.concatenate((rates, [momentum / (1 + side * anchors.states[2]) - frame]))
    return UP * (gone + spare), rates


def _nothing(flow: Flow, left: Anchors) -> dict[str, tuple[Array, Array, Array]]:
    """Return that nothing is bounded: the run is too far from the exact motion."""
    zero = np.zeros_like(left.size)
    names = quantities(flow, left.states, left.apart, zero)
    return dict.fromkeys(names, (zero, np.full_like(zero, np.inf), zero))


def _taken(anchors: Anchors, keep: NDArray[np.bool_]) -> Anchors:
    return Anchors(*(each[..., keep] for each in vars(anchors).values()))


def _joined(a: Anchors, b: Anchors) -> Anchors:
    pairs = zip(vars(a).values(), vars(b).values(), strict=True)
    return Anchors(*(np.concatenate(pair, axis=-1) for pair in pairs))
