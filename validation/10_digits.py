"""Runs at many digits against the closed form: errors, and what a digit costs."""

from time import perf_counter

from page import markdown
from tools import Digits, main, most, motion_of

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
        made = [propagated(digits, "span.time=3", "want.samples=13")
                for _ in range(3 if digits <= 100 else 1)]  # fmt: skip
        run, _ = made[-1]
        if not run.in_doubles:
            ctx, worst = off(run, digits)
            shown = ctx.nstr(worst, 2)
            yield f"{digits} digits: error over 1e-{digits}", worst * ctx.mpf(10) ** digits, 1.0
        else:
            shown = f"{ht.run_errors(run).theta:.1e}"
        each = motion_of(run.scene).period / 3
        fastest = min(run.statistics.integrate_s for run, _ in made)
        rows.append((str(digits), run.plan.precision, str(run.statistics.order),
                     f"{run.statistics.steps * each:.1f}", f"{fastest * each * 1e6:.3g}",
                     f"{min(spent for _, spent in made):.2f}", shown))  # fmt: skip
    print(markdown(COSTS, rows))


@proof
def a_thousand():
    run, spent = propagated(1000, "span.periods=1", "want.samples=3")
    ctx, worst = off(run, 1000)
    yield "1000 digits: error over 1e-1000", worst * ctx.mpf(10) ** 1000, 1.0
    yield "1000 digits over one nutation period [s]", spent, 120


if __name__ == "__main__":
    main()
