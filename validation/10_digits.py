"""Runs at many digits, against the closed form: errors, and what a digit costs.

The book's kicked top, theta, phi and psi, every event wanted; then one nutation period at a
thousand digits. The closed form is that of the scene's exact numbers, so that the rounding of the
input is part of the error.
"""

import sys
from time import perf_counter

from claim import claim, finish, most
from digits import Digits

import heavytop as ht

DIGITS = (12, 14, 15, 20, 30, 60, 100, 200, 300)
THOUSAND = "--quick" not in sys.argv


def propagated(digits, *overrides):
    scene = ht.load_scene("sicm-kicked", overrides=[f"want.digits={digits}", *overrides])
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


rows = []
for digits in DIGITS:
    spent, stepping = [], []
    for _ in range(3 if digits <= 100 else 1):
        run, whole = propagated(digits, "span.time=3", "want.samples=13")
        spent.append(whole)
        stepping.append(run.statistics.integrate_s)
    if run.decimals is not None:
        ctx, worst = off(run, digits)
        shown = ctx.nstr(worst, 2)
        ratio = float(worst * ctx.mpf(10) ** digits)
        claim(f"{digits} digits: error over 1e-{digits}", ratio, 1.0)
        if digits == 60:
            claim("60 digits, in units of 1e-59", ratio / 10, 1.0)
    else:
        shown = f"{ht.run_errors(run).theta:.1e}"
    period = ht.Motion(run.scene.top, run.scene.start).period
    each = min(stepping) * period / 3
    steps = run.statistics.steps * period / 3
    rows.append(
        f"| {digits} | {run.plan.precision} | {run.statistics.order} | {steps:.1f} "
        f"| {each * 1e6:.3g} | {min(spent):.2f} | {shown} |"
    )
print("| digits | numbers | order | steps a period | us a period | whole run, 3 s [s] | error |")
print("|--:|---|--:|--:|--:|--:|---|")
print("\n".join(rows))

if THOUSAND:
    run, whole = propagated(1000, "span.periods=1", "want.samples=3")
    ctx, worst = off(run, 1000)
    claim("1000 digits: error over 1e-1000", float(worst * ctx.mpf(10) ** 1000), 1.0)
    claim("1000 digits over one nutation period [s]", whole, 120)
    print(
        f"     {run.plan.precision}, order {run.statistics.order}, {run.statistics.steps} steps, "
        f"compiled in {run.statistics.compile_s:.1f} s, error {ctx.nstr(worst, 2)}"
    )
finish()
