"""A motion at any time, past or future, from half a nutation: the cost is always the same.

theta is periodic, and phi and psi gain the same in every period. Half a nutation is integrated in
extended precision, and any other time is reduced to it in arithmetic that loses nothing. Where
theta is constant there is nothing to integrate: phi and psi turn uniformly, as they start.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from heavytop.errors import BadScene, Fault, Impossible, NotANumber
from heavytop.integration.bits import SPARE_DIGITS, digits_of, enough
from heavytop.integration.half_nutation import HalfNutation
from heavytop.integration.high_precision import Unfinished
from heavytop.numbers import PI, Exact
from heavytop.numbers.decimals import Context, Number, context, number
from heavytop.numbers.double_double import less_multiples, whole_multiples
from heavytop.run.estimates import FOLDED_REACH, LEAST_FOLDED, MOST_TURNS, needed_to_fold
from heavytop.run.planning import (
    Plan,
    closed_form_of,
    refusal,
    rounded_start,
    span,
    span_fault,
    start_values,
)
from heavytop.scene.arguments import whole
from heavytop.scene.scene import Scene
from heavytop.scene.scene_file import MAX_DIGITS

Array = NDArray[np.float64]
Real = Any  # doubles in arrays, or mpmath's numbers
Reals = Iterable[Real]

CHUNK = 4096  # times at once: what is worked on stays in the processor's cache
TOLD_APART = 2.0**50  # half-periods that doubles tell from their neighbours, with room
MOST_HALVES = 2.0**52  # that the next double to a number of them is another
FOR_EVER = 1e300  # seconds
MOST_BITS = 4096

_WHY_NOT = {
    "asymptotic": "it tends to the vertical and never comes back: there is no period to fold by",
    None: "not proved to nutate: there may be no period to fold by",
}


@dataclass(frozen=True, slots=True)
class FoldedSample:
    """The motion at a time, or at times of shape (k,); angles are in radians.

    Attributes
    ----------
    t, theta, phi, psi : real, or ndarray of shape (k,)
        Time [s], tilt, precession and spin [rad], phi and psi continuous from the start: large
        ones have lost their last digits.
    phi_turns, psi_turns : int, or ndarray of shape (k,)
        Whole turns of phi and psi, rounded down.
    phi_mod, psi_mod : real, or ndarray of shape (k,)
        What is beyond them [rad], from 0 to 2 pi.
    thetadot, phidot, psidot : real, or ndarray of shape (k,)
        Rates [rad/s].
    axis, omega : tuple of 3, or ndarray of shape (3,) or (k, 3)
        The symmetry axis and the angular velocity [rad/s], both in space.
    quaternion : tuple of 4, or ndarray of shape (4,) or (k, 4)
        The attitude, body to space, scalar first.
    """

    t: Any
    theta: Any
    phi: Any
    psi: Any
    phi_turns: Any
    psi_turns: Any
    phi_mod: Any
    psi_mod: Any
    thetadot: Any
    phidot: Any
    psidot: Any
    axis: Any
    omega: Any
    quaternion: Any


@dataclass(frozen=True, slots=True)
class Cost:
    """What a fold took: nothing, where theta is constant.

    Attributes
    ----------
    bits : int
        Of the numbers that were integrated.
    steps : int
    closure : float
        How well the second half of the nutation repeats the first: the error, measured.
    compile_s, integrate_s : float
        Wall-clock time of the parts, of all attempts [s].
    """

    bits: int = 0
    steps: int = 0
    closure: float = 0.0
    compile_s: float = 0.0
    integrate_s: float = 0.0


@dataclass(frozen=True)
class ConstantTilt:
    """Constant theta instead of a `HalfNutation`, where any time will do for half a period.

    Attributes
    ----------
    cos, sin : mpf
        Of theta/2.
    half : mpf
    """

    cos: Number
    sin: Number
    half: Number
    first: ClassVar[int] = 0
    before: ClassVar[tuple[int, int]] = (0, 0)
    turned: ClassVar[tuple[int, int]] = (0, 0)

    def at(self, _odd: NDArray[np.bool_], since: Array) -> tuple[Array, Array]:
        """Return states in doubles, and what phi and psi gain but for their uniform parts."""
        states = np.zeros((6, since.size))
        states[0], states[1] = float(self.cos), float(self.sin)
        return states, np.zeros((2, since.size))

    def at_one(self, _odd: bool, _since: str) -> tuple[tuple[Number, ...], tuple[int, int]]:
        """Return the same at one time, to all digits."""
        return (self.cos, self.sin, 0, 0, 0, 0), self.turned


class PeriodicMotion:
    """A motion that is the same in every period, but for phi and psi.

    Time is counted in half-periods from a turning point. About each turning point the motion is
    symmetric in time, and phi and psi there are those of the first one and as many times what they
    gain in half a period.

    Parameters
    ----------
    ctx : Context
        Of more digits than the integration has.
    nutation : HalfNutation or ConstantTilt
    start : sequence of mpf
        phi and psi at the start [rad].
    constants : sequence of mpf
        The uniform parts of phidot and psidot, which in a nutation are 0 and kappa, then P_plus and
        P_minus, none where theta is constant, and omega3 [rad/s].

    Attributes
    ----------
    first, half : mpf
        The time of a turning point, and half a period [s].
    begun, gains : list of mpf
        phi and psi at that turning point, and what they gain in half a period [turns].
    """

    def __init__(
        self,
        ctx: Context,
        nutation: HalfNutation | ConstantTilt,
        start: Sequence[Number],
        constants: Sequence[Number],
    ) -> None:
        self.ctx, self.nutation, self.constants = ctx, nutation, constants
        self.first, self.half = ctx.mpf(nutation.first), ctx.mpf(nutation.half)
        until = self._turns(nutation.before, self.first)
        self.begun = [x / (2 * ctx.pi) + y for x, y in zip(start, until, strict=True)]
        self.gains = self._turns(nutation.turned, self.half)
        self._first, self._half = _words(self.first), _words(self.half)
        self._begun = whole_multiples(np.ones(1), _columns(self.begun))
        self._gains, self._rates = _columns(self.gains), _columns(self._turns((0, 0), 1))

    def _turns(self, turned: Sequence[Any], time: Number) -> list[Number]:
        """Return what phi and psi gain in a time, their uniform parts included [turns]."""
        each = zip(turned, self.constants[:2], strict=True)
        return [(self.ctx.mpf(x) + rate * time) / (2 * self.ctx.pi) for x, rate in each]

    def many(self, t: Array) -> FoldedSample:
        """Return the motion at times of shape (k,) [s], no more than 2^50 half-periods away.

        Rounding may take another turning point than the nearest, but none beyond a swing's end.
        """
        n = np.rint((t - self._first[0]) / self._half[0])
        return self._doubles(t, n, less_multiples(t, self._first, n, self._half))

    def one(self, t: Number) -> FoldedSample:
        """Return the motion at a time [s] in doubles."""
        n, since = self._nearest(t)
        many = self._doubles(np.array([float(t)]), np.array([float(n)]), _words(since)[:, None])
        values = (getattr(many, name)[0] for name in many.__slots__)
        return FoldedSample(*(x if x.ndim else x.item() for x in values))

    def decimals(self, t: Number) -> FoldedSample:
        """Return the motion at a time [s], to all digits."""
        ctx, (n, since) = self.ctx, self._nearest(t)
        state, turned = self.nutation.at_one(n % 2 == 1, ctx.nstr(abs(since), ctx.dps))
        sign = -1 if since < 0 else 1
        swung = self._turns([sign * ctx.mpf(x) for x in turned], since)
        each = zip(self.begun, self.gains, swung, strict=True)
        angles = [_split(0, x + n * gain + more, ctx.floor, int) for x, gain, more in each]
        return _sample(ctx, t, map(ctx.mpf, state), sign, angles, self.constants)

    def _nearest(self, t: Number) -> tuple[int, Number]:
        """Return the nearest turning point, by its number, and the time since it [s]."""
        n = int(self.ctx.nint((t - self.first) / self.half))
        return n, t - self.first - n * self.half

    def _doubles(self, t: Array, n: Array, since: Any) -> FoldedSample:
        """Return the motion at times, by turning points close by and the times since them [s]."""
        states, swung = self.nutation.at(n % 2 == 1, np.abs(since[0]))
        sign = np.where(since[0] < 0, -1.0, 1.0)
        counted = whole_multiples(n, self._gains), whole_multiples(since[0], self._rates)
        whole, rest = map(sum, zip(self._begun, *counted, strict=True))
        rest += self._rates[0] * since[1] + sign * swung / (2 * np.pi)
        angles = zip(*_split(whole, rest, np.floor, np.int64), strict=True)
        sample = _sample(np, t, states, sign, angles, map(float, self.constants))
        vectors = ("axis", "omega", "quaternion")
        return replace(sample, **{v: np.stack(getattr(sample, v), axis=-1) for v in vectors})


def _words(x: Number) -> Array:
    """Return three doubles that add up to a number, to 159 bits."""
    high = float(x)
    middle = float(x - high)
    return np.array([high, middle, float(x - high - middle)])


def _columns(numbers: Iterable[Number]) -> Array:
    """Return numbers as such sums, shape (3, n, 1)."""
    return np.array([_words(x) for x in numbers]).T[..., None]


def _split(whole: Any, rest: Real, floor: Any, integer: Any) -> tuple[Any, Real]:
    """Return whole turns and a rest in [0, 1); 1e-20 short of a turn is a turn, to rounding."""
    below = floor(rest)
    rest = rest - below
    over = rest >= 1
    return whole + integer(below) + over, rest - over


def _over(numerator: Real, divisor: Real) -> Real:
    """Return a quotient, or 0 for 0/0."""
    return numerator / (divisor + (divisor == 0))


def _sample(
    m: Any, t: Real, state: Reals, sign: Real, angles: Iterable[Reals], constants: Reals
) -> FoldedSample:
    """Return the motion before (sign = -1) or after (1) a turning point.

    With alpha and beta, the Cayley-Klein parameters, no pole makes anything cancel in

        phidot = (P_plus/|alpha|^2 + P_minus/|beta|^2) / 4,
        psidot = kappa + (P_plus/|alpha|^2 - P_minus/|beta|^2) / 4.

    `m` has the functions of the numbers: numpy, or a context of mpmath. `state` is that so long
    after the turning point; `angles` are phi and psi at the time itself, each as whole turns and a
    rest.
    """
    phi_rate, psi_rate, P_plus, P_minus, omega3 = constants
    ((phi_turns, phi_rest), (psi_turns, psi_rest)), turn = angles, 2 * m.pi
    q_0, q_1, q_2, q_3, l_x, l_y = state
    up, down = m.sqrt(q_0 * q_0 + q_3 * q_3), m.sqrt(q_1 * q_1 + q_2 * q_2)
    plus, minus = _over(P_plus, 4 * up * up), _over(P_minus, 4 * down * down)
    phidot, psidot = phi_rate + plus + minus, psi_rate + plus - minus
    across = up * down
    tilting = _over(l_x * (q_0 * q_1 - q_2 * q_3) + l_y * (q_0 * q_2 + q_1 * q_3), across)
    leaving = (across == 0) * m.sqrt(l_x * l_x + l_y * l_y) * (1 - 2 * (up == 0))  # a pole
    thetadot = sign * tilting + leaving
    cos, sin, sine = m.cos(turn * phi_rest), m.sin(turn * phi_rest), 2 * across
    u = (up - down) * (up + down)
    odd = 1 - 2 * ((phi_turns + psi_turns) % 2)  # half of an odd number of turns makes q -q
    half_sum, half_difference = m.pi * (phi_rest + psi_rest), m.pi * (phi_rest - psi_rest)
    return FoldedSample(
        t=t,
        theta=2 * m.atan2(down, up),
        phi=turn * (phi_turns + phi_rest),
        psi=turn * (psi_turns + psi_rest),
        phi_turns=phi_turns,
        psi_turns=psi_turns,
        phi_mod=turn * phi_rest,
        psi_mod=turn * psi_rest,
        thetadot=thetadot,
        phidot=phidot,
        psidot=psidot,
        axis=(sine * sin, -sine * cos, u),
        omega=(
            thetadot * cos + psidot * sine * sin,
            thetadot * sin - psidot * sine * cos,
            omega3 * u + phidot * sine * sine,
        ),
        quaternion=(
            odd * up * m.cos(half_sum),
            odd * down * m.cos(half_difference),
            odd * down * m.sin(half_difference),
            odd * up * m.sin(half_sum),
        ),
    )


@dataclass(frozen=True, eq=False, repr=False)
class Folded:
    """The motion of a scene at any time, made by `fold`.

    Call it with a time [s], or with an array of doubles, shape (k,), and it returns a
    `FoldedSample` in doubles. Texts, exact numbers and integers mean what they say, doubles their
    binary value.

    Attributes
    ----------
    scene : Scene
        What was folded.
    digits : int
        Decimal digits: `decimals` is off by at most 10^-digits, and doubles by their rounding.
    course : PeriodicMotion
        What the motion is folded onto.
    span : mpf
        The end of the scene [s]; its periods are the fold's own, to all digits.
    reach : float
        The farthest time that has these digits, past or future [s]; an array of doubles reaches
        no farther than 2^50 half-periods.
    cost : Cost
        Bits, steps and times that it took.

    Examples
    --------
    >>> import heavytop as ht
    >>> folded = ht.fold(ht.load_scene("sicm-kicked"))
    >>> far = folded("1000000000000.1")
    >>> far.phi_turns, round(far.phi_mod, 12)
    (1165068846382, 2.458574588461)
    """

    scene: Scene
    digits: int
    course: PeriodicMotion
    span: Number
    reach: float
    cost: Cost

    def __repr__(self) -> str:
        name = self.scene.title or self.scene.name
        return f"<Folded {name!r}: {self.digits} digits up to {self.reach:.3g} s>"

    @property
    def period(self) -> Number | None:
        """T [s], the period of theta; None where it is constant."""
        return self._in_a_period(self.course.half)

    @property
    def precession(self) -> Number | None:
        """What phi gains in a period [rad]; None where theta is constant."""
        return self._in_a_period(2 * self.course.ctx.pi * self.course.gains[0])

    @property
    def spin(self) -> Number | None:
        """What psi gains in a period [rad]; None where theta is constant."""
        return self._in_a_period(2 * self.course.ctx.pi * self.course.gains[1])

    def _in_a_period(self, in_half: Number) -> Number | None:
        return 2 * in_half if self.cost.steps else None

    @property
    def end(self) -> FoldedSample:
        """The motion at the end of the scene, in doubles."""
        return self(self.span)

    def __call__(self, t: Any) -> FoldedSample:
        """Return the motion at a time, or at times of shape (k,) [s], in doubles.

        Raises
        ------
        NotANumber
            A time that is no finite number, or more than one dimension of them.
        Impossible
            A time beyond `reach`.
        """
        if not np.ndim(t):
            return self.course.one(self._time(t))
        times = _doubles(t)
        farthest = min(self.reach, float(self.course.half) * TOLD_APART)
        if times.size and np.abs(times).max() > farthest:
            raise _too_far(farthest)
        chunks = np.split(times, range(CHUNK, times.size, CHUNK))
        parts = [self.course.many(chunk) for chunk in chunks]
        names = FoldedSample.__slots__
        return FoldedSample(*(np.concatenate([getattr(p, name) for p in parts]) for name in names))

    def decimals(self, t: Any) -> FoldedSample:
        """Return the motion at a time [s], in mpmath numbers of so many digits.

        Parameters
        ----------
        t : number
            Time since the start [s]; texts and integers mean what they say.

        Returns
        -------
        FoldedSample

        Raises
        ------
        NotANumber
            A time that is no finite number.
        Impossible
            A time beyond `reach`.
        """
        return self.course.decimals(self._time(t))

    def _time(self, t: Any) -> Number:
        exact = number(self.course.ctx, t.item() if isinstance(t, np.ndarray) and not t.ndim else t)
        if abs(exact) > self.reach:
            raise _too_far(self.reach)
        return exact


def _too_far(reach: float) -> Impossible:
    rule = f"at most {reach:.3g} s from the start: farther off, digits or turns are lost"
    return Impossible([("t", rule)])


def _doubles(t: Any) -> Array:
    given = np.asarray(t)
    if given.dtype.kind not in "fiu" or given.ndim > 1:
        raise NotANumber("t: a number, or an array of doubles of shape (k,)")
    times = given.astype(np.float64)
    rounded = np.abs(times) >= 2.0**53 if given.dtype.kind in "iu" else times != given
    if not np.isfinite(times).all() or rounded.any():
        raise NotANumber("t: finite doubles; what is no double goes one by one, as a text")
    return times


def fold(scene: Scene, digits: int | None = None) -> Folded:
    """Integrate half a nutation, which tells the motion at any time.

    Parameters
    ----------
    scene : Scene
        Its span says how far the digits have to reach, where that is beyond 8e12 periods.
    digits : int, optional
        Decimal digits wanted, from 1 to 10 000 and never fewer than 16; by default the scene's.

    Returns
    -------
    Folded
        The motion at any time, and where its digits end.

    Raises
    ------
    BadScene
        There is no period to fold by: the motion tends to the vertical, or is not proved not to.
        Or half a nutation takes too many bits or steps, or the span holds too many turns.
    NotANumber, Impossible
        Digits that are no whole number from 1 to 10 000.

    Notes
    -----
    Accuracy: ``tests/run/test_periodic.py`` holds axis, phi_mod and psi_mod to 1e-13 of the
    closed form 1e12 periods from the start, for every shipped scene that has a period.

    References
    ----------
    Whittaker, *Analytical Dynamics*, sections 71 to 73: the motion repeats itself, but for the
    angles that φ and ψ gain.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> folded = fold(load_scene("sicm-kicked"), digits=16)
    >>> round(folded.period, 12), round(folded(2.0).theta, 12)
    (0.542895518188, 0.42694370531)
    """
    motion = closed_form_of(scene)
    if faults := tuple(_too_far_round(scene)):
        raise BadScene(faults)
    wanted = scene.digits if digits is None else whole("digits", digits, 1, MAX_DIGITS)
    regime = motion.regime if motion.certified else None
    if regime not in ("steady", "nutating"):
        raise refusal(scene, "fold", str(motion.kind), _WHY_NOT[regime])
    span(scene, motion)  # refuses periods where nothing nutates
    folded = (constant_tilt if regime == "steady" else nutating)(scene, max(LEAST_FOLDED, wanted))
    if abs(folded.span) > folded.reach:
        rule = f"at most {folded.reach:.3g} s: farther off, turns are not counted"
        raise BadScene((span_fault(scene, rule),))
    return folded


def _too_far_round(scene: Scene) -> Iterator[Fault]:
    for name in ("phi", "psi"):
        angle = getattr(scene.start, name)
        if abs(float(angle)) > MOST_TURNS:
            rule = f"at most {MOST_TURNS:.3g}: beyond, turns are not counted"
            yield Fault(scene.name, None, f"start.{name}", str(angle), rule)


def constant_tilt(scene: Scene, digits: int) -> Folded:
    """Return a fold of a scene whose theta is constant."""
    start = scene.start
    upright = 0 in (start.theta.sign(), (start.theta - PI).sign())
    exact = (Exact.of(0), start.omega3) if upright else (start.phidot, start.psidot)
    ctx = context(digits + math.ceil(math.log10(MOST_TURNS)) + SPARE_DIGITS)
    theta, phi, psi, phidot, psidot, omega3 = (
        x.mpf(ctx) for x in (start.theta, start.phi, start.psi, *exact, start.omega3)
    )
    reach = MOST_TURNS / max(MOST_TURNS / FOR_EVER, *(abs(float(rate)) for rate in exact))
    half = ctx.ldexp(1, math.frexp(reach / TOLD_APART)[1])
    tilt = ConstantTilt(ctx.cos(theta / 2), ctx.sin(theta / 2), half)
    constants = (phidot, psidot, ctx.zero, ctx.zero, omega3)
    course = PeriodicMotion(ctx, tilt, (phi, psi), constants)
    return Folded(scene, digits, course, _end(scene, course), reach, Cost())


def nutating(scene: Scene, digits: int) -> Folded:
    """Return a fold of a scene that nutates, integrated with as many bits as it takes.

    Raises
    ------
    BadScene
        It takes more than 4096 bits, or more steps than `HalfNutation` takes.
    """
    bits, made = enough(needed_to_fold(digits)), list[HalfNutation]()
    while bits <= MOST_BITS:
        nutation, course = integrated(scene, bits)
        made.append(nutation)
        end = _end(scene, course)
        halves = min(max(FOLDED_REACH, float(1 + abs(end / course.half))), MOST_HALVES)
        needed = needed_to_fold(digits, halves) + nutation.lost_bits
        if needed <= bits:
            turns = max(1.0, *(abs(float(gain)) for gain in course.gains))
            reach = float(course.half) * min(halves, MOST_TURNS / turns)
            spent = (sum(x.compile_s for x in made), sum(x.integrate_s for x in made))
            cost = Cost(bits, nutation.count, nutation.closure, *spent)
            return Folded(scene, digits, course, end, reach, cost)
        if math.isinf(needed):
            raise refusal(scene, "fold", "", f"half a nutation takes more than {MOST_BITS} bits")
        bits = enough(needed)
    rule = f"half a nutation takes {bits} bits, and {MOST_BITS} are the most"
    raise refusal(scene, "fold", "", rule)


def _end(scene: Scene, course: PeriodicMotion) -> Number:
    if scene.time is not None:
        return scene.time.mpf(course.ctx)
    assert scene.periods is not None
    return scene.periods.mpf(course.ctx) * 2 * course.half


def integrated(scene: Scene, bits: int) -> tuple[HalfNutation, PeriodicMotion]:
    """Return half a nutation of a scene in numbers of so many bits, and the motion it tells."""
    ctx, turned_back = context(digits_of(bits)), dict.fromkeys(("phi", "psi"), Exact.of(0))
    constants, state = rounded_start(Plan("attitude"), start_values(scene) | turned_back, ctx)
    try:
        nutation = HalfNutation(bits, constants, state)
    except Unfinished as reason:
        raise refusal(scene, "fold", "", str(reason)) from None
    start = scene.start.phi.mpf(ctx), scene.start.psi.mpf(ctx)
    own = (ctx.mpf(constants[name]) for name in ("kappa", "P_plus", "P_minus", "omega3"))
    return nutation, PeriodicMotion(ctx, nutation, start, (ctx.zero, *own))
