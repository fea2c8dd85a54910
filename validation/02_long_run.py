"""The axis form over 1e5 nutation periods of the book's kicked top: energy and phase."""

from claim import claim, finish

import heavytop as ht
from heavytop.run.verify import energy_error, phase_error

overrides = ["span.periods=100000", 'want.quantities=["theta"]', "want.events=[]"]
scene = ht.load_scene("sicm-kicked", overrides=overrides)
run = ht.propagate(scene, formulation="axis", projected=False)
claim("energy, relative to max(|E'|, gMR)", energy_error(run), 1e-13)
claim("phase error [s]", abs(phase_error(run)), 2e-8)
print(
    f"     {run.statistics.steps} steps, {run.statistics.integrate_s / 1e5 * 1e6:.2f} us a period"
)
finish()
