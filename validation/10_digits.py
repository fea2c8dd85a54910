"""Runs at many digits against the closed form, and enclosures against the closed form at 150."""

import random
from fractions import Fraction
from time import perf_counter

from page import markdown
from tools import Digits, interleaved, main, most

import heavytop as ht
from heavytop.claims import proof

DIGITS = (12, 14, 15, 20, 30, 60, 100, 200, 300)
COSTS = ("digits", "numbers", "order", "steps a period", "µs a period", "whole run, 3 s [s]",
         "error")  # fmt: skip


def propagated(digits, *overrides):
    scene = ht.load_scene("sicm-kicked", [f"want.digits={digits}", *overrides])
    began = perf_counter()
    return ht.propagate(scene, formulation="axis"), perf_counter() - began


def off(run, digits):
    """Largest error of theta, phi and psi at the samples, relative to max(1, |x|), in digits."""
    truth = Digits(ht.Motion(run.scene.top, run.scene.start), digits + 20)
    ctx, worst = truth.ctx, 0
    for sample in run.decimals.samples[1:]:
        exact = truth(ctx.mpf(sample.t))
        for name in ("theta", "phi", "psi"):
            mine, true = ctx.mpf(getattr(sample, name)), getattr(exact, name)
            worst = most(worst, abs(mine - true) / max(1, abs(true)))
    return ctx, worst


@proof(minutes=1)
def runs():
    """The book's kicked top: the rounding of the scene's numbers is part of the error."""
    rows = []
    for digits in DIGITS:
        made = [propagated(digits, "span.time=3", "want.samples=13")
                for _ in range(3 if digits <= 100 else 1)]  # fmt: skip
        run, _ = made[-1]
        if run.decimals is not None:
            ctx, worst = off(run, digits)
            shown = ctx.nstr(worst, 2)
            yield f"{digits} digits: error over 1e-{digits}", worst * ctx.mpf(10) ** digits, 1.0
        else:
            shown = f"{ht.run_errors(run).theta:.1e}"
        each = ht.Motion(run.scene.top, run.scene.start).period / 3
        fastest = min(run.statistics.integrate_s for run, _ in made)
        rows.append((str(digits), run.plan.precision, str(run.statistics.order),
                     f"{run.statistics.steps * each:.1f}", f"{fastest * each * 1e6:.3g}",
                     f"{min(spent for _, spent in made):.2f}", shown))  # fmt: skip
    print(markdown(COSTS, rows))


@proof(minutes=1)
def a_thousand():
    run, spent = propagated(1000, "span.periods=1", "want.samples=3")
    ctx, worst = off(run, 1000)
    yield "1000 digits: error over 1e-1000", worst * ctx.mpf(10) ** 1000, 1.0
    yield "1000 digits over one nutation period [s]", spent, 120


TRUSTED = Fraction(1, 10**140)  # what the closed form at 150 digits is trusted to
BATCH = 20


def costs(digits):
    """Programs that enclose, each so many times, to so many digits."""
    scene = ht.load_scene("sicm-kicked")
    warm = ht.Motion(scene.top, scene.start)

    def fresh(name, t=None):
        motions = (ht.Motion(scene.top, scene.start) for _ in range(BATCH))
        return [motion.interval(name, t, digits) for motion in motions]

    def again(t):
        return lambda: [warm.interval("theta", t, digits) for _ in range(BATCH)]

    return {
        "period": lambda: fresh("period"),
        "precession": lambda: fresh("precession"),
        "first θ(t)": lambda: fresh("theta", 1.7),
        "another θ(t)": again(1.7),
        "θ(10¹² s)": again(1e12),
    }


def drawn(dice):
    """A top and a start: often on a pole, at rest, without spin or weight."""
    top = ht.Top(
        A=dice.choice([1, 2, "0.5", "3.28e-4"]),
        C=dice.choice(["1e-6", "6.6e-5", "3.28e-4"]),
        gMR=dice.choice([1, -1, "0.0456", "2.5", -3, 0]),
    )
    rate = [0, 1, "-0.3", round(dice.uniform(-9, 9), 3)]
    spin = {dice.choice(["psidot", "omega3"]): dice.choice([*rate, dice.randint(-(10**6), 10**6)])}
    theta = dice.choice([0, "pi", "pi/3", "1.2", "3", round(dice.uniform(0, 3), 3)])
    return top, ht.State(theta, thetadot=dice.choice(rate), phidot=dice.choice(rate), **spin)


def outside(ball, value):
    """Whether the closed form's value is not in the ball, to the digits it is trusted to."""
    from heavytop.exact.balls import Interval

    if ball is None or value is None:
        return (ball is None) != (value is None)
    slack = TRUSTED * max(Fraction(1), abs(ball.middle))
    return value not in Interval(ball.middle, ball.spread + slack)


@proof(minutes=2)
def enclosures(tops=1000):
    """Random tops, on and off the poles, resting and moving, at random times."""
    rows = []
    for digits in (15, 50, 100, 1000):
        best = interleaved(costs(digits), 20 if digits < 1000 else 3)
        rows.append((str(digits), *(f"{s / BATCH * 1e6:.0f}" for s in best.values())))
    print(markdown(("digits", *costs(15)), rows))
    dice, values, wrong, wide = random.Random(0), 0, 0, 0
    for _ in range(tops):
        motion = ht.Motion(*drawn(dice))
        t = dice.choice([0, 1.5, -1e3, 10.0 ** dice.uniform(-3, 6)])
        at = motion.at(t, 150)
        names = ("period", "precession", "spin", "theta_min", "theta_max")
        pairs = [(motion.interval(name, None, 50), motion.mpf(name, 150)) for name in names]
        names = ("u", "theta", "phi", "psi", "thetadot", "phidot", "psidot")
        pairs += [(motion.interval(name, t, 50), getattr(at, name)) for name in names]
        for name in ("axis", "quaternion"):
            pairs += zip(motion.interval(name, t, 50), getattr(at, name), strict=True)
        values += len(pairs)
        wrong += sum(outside(*pair) for pair in pairs)
        wide += sum(ball.digits < 50 for ball, _ in pairs if ball is not None)
    yield f"values outside their enclosure, of {values}", wrong, 0
    yield "enclosures wider than asked", wide, 0


if __name__ == "__main__":
    main()
