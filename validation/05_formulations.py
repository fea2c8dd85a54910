"""Every formulation on the book's kicked top, 100 nutation periods: operations, steps, time, error.

All run in turn in one process; best of repeats; compile time apart.
"""

import sympy as sp
from claim import claim, finish

import heavytop as ht
from heavytop.equations.formulation import FORMULATIONS
from heavytop.run.planning import plan

PERIODS = 100
TILT = 'want.quantities=["theta"]'
ALL = 'want.quantities=["theta", "phi", "psi"]'


def scene(wants):
    overrides = [f"span.periods={PERIODS + 0.3}", "want.events=[]", "want.samples=100", wants]
    return ht.load_scene("sicm-kicked", overrides=overrides)


def operations(formulation, wants):
    variant = plan(scene(wants), formulation).variant
    form = FORMULATIONS[formulation].build(variant)
    replacements, reduced = sp.cse((form.integrated or form).derivatives)
    return sum(sp.count_ops(x) for _, x in replacements) + sum(map(sp.count_ops, reduced))


cases = [(f, w) for f in FORMULATIONS for w in (TILT, ALL) if not (f == "cubic" and w == ALL)]
best = dict.fromkeys(cases, float("inf"))
runs = {}
for _ in range(20):
    for formulation, wants in cases:
        run = ht.propagate(scene(wants), formulation=formulation)
        runs[formulation, wants] = run
        best[formulation, wants] = min(
            best[formulation, wants], run.statistics.integrate_s / PERIODS * 1e6
        )
print("| formulation | wants | operations | steps a period | µs a period | error of θ | of ψ |")
print("|---|---|--:|--:|--:|--:|--:|")
for (formulation, wants), run in runs.items():
    errors = ht.run_errors(run)
    psi = "" if errors.psi is None or wants == TILT else f"{errors.psi:.0e}"
    print(
        f"| {formulation} | {'θ' if wants == TILT else 'θ, φ, ψ'} "
        f"| {operations(formulation, wants)} | {run.statistics.steps / PERIODS:.0f} "
        f"| {best[formulation, wants]:.1f} | {errors.theta:.0e} | {psi} |"
    )
    bound = 1e-10 if formulation == "lagrange" else 1e-11
    claim(f"{formulation}: error of theta after {PERIODS} periods", errors.theta, bound)
finish()
