"""Enclosures: what they cost, and whether the closed form at 150 digits lies in every one of them.

Costs are of the book's kicked top, best of many, all in turn in one process. Random tops, on and
off the poles, resting and moving, are held against the closed form at a random time.
"""

import random
import sys
from fractions import Fraction

from claim import claim, finish, interleaved

import heavytop as ht
from heavytop.analytic.enclosure import enclose
from heavytop.exact.balls import Interval

TOPS = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
REPEATS = 20
TRUSTED = Fraction(1, 10**140)  # what the closed form at 150 digits is trusted to

scene = ht.load_scene("sicm-kicked")


def costs(digits):
    """Programs that enclose, each 20 times, to so many digits."""
    warm = enclose(scene.top, scene.start, digits)
    warm.theta(1), warm.theta_error(1, 0.4)

    def fresh(name):
        return lambda: [getattr(enclose(scene.top, scene.start, digits), name) for _ in range(20)]

    return {
        "period": fresh("period"),
        "precession": fresh("precession"),
        "first θ(t)": lambda: [
            enclose(scene.top, scene.start, digits).theta(1.7) for _ in range(20)
        ],
        "another θ(t)": lambda: [warm.theta(1.7) for _ in range(20)],
        "θ(10¹² s)": lambda: [warm.theta(1e12) for _ in range(20)],
        "theta_error": lambda: [warm.theta_error(1.7, 0.4) for _ in range(20)],
    }


print("| digits | " + " | ".join(costs(15)) + " |")
for digits in (15, 50, 100, 1000):
    best = interleaved(costs(digits), repeats=REPEATS if digits < 1000 else 3)
    print(f"| {digits} | " + " | ".join(f"{time / 20 * 1e6:.0f}" for time in best.values()) + " |")

steady = ht.load_scene("steady-betsch").top
off = ht.State(theta="pi/3", phidot=10, thetadot="1e-40", psidot="135.6")
best = interleaved({"off": lambda: enclose(steady, off).period}, repeats=300)
print(f"     {best['off'] * 1e6:.0f} us for a period 1e-40 rad/s off steady precession")


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
    if ball is None or value is None:
        return (ball is None) != (value is None)
    slack = TRUSTED * max(Fraction(1), abs(ball.middle))
    return value not in Interval(ball.middle, ball.spread + slack)


dice, values, wrong, wide = random.Random(0), 0, 0, 0
for _ in range(TOPS):
    top, start = drawn(dice)
    form, found = ht.Motion(top, start).form(150), enclose(top, start, digits=50)
    t = dice.choice([0, 1.5, -1e3, 10.0 ** dice.uniform(-3, 6)])
    at = form(t)
    pairs = [
        (found.period, form.period),
        (found.precession, form.precession),
        (found.spin, form.spin),
        (found.theta_min, min(form.tilts)),
        (found.theta_max, max(form.tilts)),
        (found.u(t), at.u),
    ]
    names = ("theta", "phi", "psi")
    pairs += [(getattr(found, name)(t), getattr(at, name)) for name in names]
    pairs += zip(found.rates(t), [getattr(at, f"{name}dot") for name in names], strict=True)
    pairs += zip(found.axis(t), at.axis, strict=True)
    pairs += zip(found.quaternion(t), at.quaternion, strict=True)
    values += len(pairs)
    wrong += sum(outside(*pair) for pair in pairs)
    wide += sum(ball.digits < 50 for ball, _ in pairs if ball is not None)
claim(f"values outside their enclosure, of {values}", wrong, 0)
claim("enclosures wider than asked", wide, 0)
finish()
