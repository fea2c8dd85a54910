"""Runs at many digits against the closed form: errors, and what a digit costs."""

from time import perf_counter

from page import markdown
from tools import Digits, main, most, motion_of

import heavytop as ht
from heavytop.claims import proof

DIGITS = (12, 14, 15, 20, 30, 60, 100, 200, 300, 1000)
COSTS = ("digits", "numbers", "order", "steps a period", "µs a period", "whole run [s]", "error")


def propagated(digits):
    """The run of a span, of a thousand digits one nutation, and how long it takes in all."""
    span = "span.time=3" if digits < 1000 else "span.periods=1"
    scene = ht.load_scene("sicm-kicked", [f"want.digits={digits}", span, "want.samples=13"])
    began = perf_counter()
    return ht.propagate(scene, formulation="axis"), perf_counter() - began


def off(run, digits):
    """Largest error of theta, phi and psi at the samples, relative to max(1, |x|), in digits."""
    truth = Digits(motion_of(run.scene), digits + 20)
    ctx, worst = truth.ctx, 0
    samples = run.in_mpmath()
    for sample in map(samples.at, range(1, len(samples.t))):
        exact = truth(sample.t)
        for name in ("theta", "phi", "psi"):
            mine, true = ctx.mpf(getattr(sample, name)), getattr(exact, name)
            worst = most(worst, abs(mine - true) / max(1, abs(true)))
    return ctx, worst


@proof
def runs():
    """The book's kicked top: the rounding of the scene's numbers is part of the error."""
    rows = []
    for digits in DIGITS:
        made = [propagated(digits) for _ in range(3 if digits <= 100 else 1)]
        run, _ = made[-1]
        if not run.in_doubles:
            ctx, worst = off(run, digits)
            shown = ctx.nstr(worst, 2)
            yield f"{digits} digits: error over 1e-{digits}", worst * ctx.mpf(10) ** digits, 1.0
        else:
            shown = f"{ht.run_errors(run).theta:.1e}"
        each = motion_of(run.scene).period / float(run.t[-1])
        fastest = min(run.statistics.integrate_s for run, _ in made)
        rows.append((str(digits), run.plan.precision, str(run.statistics.order),
                     f"{run.statistics.steps * each:.1f}", f"{fastest * each * 1e6:.3g}",
                     f"{min(spent for _, spent in made):.2f}", shown))  # fmt: skip
    print(markdown(COSTS, rows))


if __name__ == "__main__":
    main()
