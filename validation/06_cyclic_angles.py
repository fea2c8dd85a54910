"""Phase lost by an angle that grows in the state: the textbook form beside the axis form.

Phase error at a generic phase after N nutation periods of the book's kicked top, over three
neighbouring ends, and its exponent of growth from the first N to the last.
"""

import warnings

import numpy as np
from claim import claim, finish

import heavytop as ht
from heavytop.witness import phase_error

warnings.simplefilter("ignore", ht.errors.UnboundedAngleWarning)
PERIODS = (3_000, 10_000, 30_000)


def phase(formulation, periods):
    errors = []
    for part in (0.2, 0.3, 0.4):
        overrides = [f"span.periods={periods + part}", 'want.quantities=["theta"]']
        overrides += ["want.events=[]", "want.samples=2"]
        run = ht.propagate(ht.load_scene("sicm-kicked", overrides), formulation=formulation)
        errors.append(phase_error(run))
    return float(np.sqrt(np.mean(np.square(errors))))


found = {}
for formulation in ("lagrange", "axis"):
    found[formulation] = [phase(formulation, n) for n in PERIODS]
    rows = ", ".join(f"{n}: {e:.1e} s" for n, e in zip(PERIODS, found[formulation], strict=True))
    print(f"     {formulation}: {rows}")
lagrange = found["lagrange"]
exponent = np.log(lagrange[-1] / lagrange[0]) / np.log(PERIODS[-1] / PERIODS[0])
claim("exponent of the textbook form's phase error, off 3", abs(exponent - 3), 0.5)
claim("axis form's phase error over the textbook's", found["axis"][-1] / lagrange[-1], 1e-2)
finish()
