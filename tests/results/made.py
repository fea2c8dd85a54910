"""Results with a few rows, as their studies make them."""

import heavytop as ht
from heavytop.results.stress import NO_RUN
from heavytop.results.table import Row

SCENE = ht.load_scene("sicm-kicked").problem()
POINT = Row({
    "method": "strang", "formulation": "axis", "language": "", "tolerance": None,
    "steps_a_period": 200, "bits": 53, "measures": "axis", "rival": True, "us_per_period": 9.0,
    "rhs_evaluations": None, "error": 1e-6, "theta_error": 1e-7, "energy_error": 1e-8,
    "phase_error": 1e-9, "warned": {}, "has_order": True, "setup_s": 0.1, "us_spread": 0.1,
    "error_spread": 0.0, "starts": 8, "runs": 2, "periods": 99.0, "steps": 9,
})  # fmt: skip
AUTO = Row(POINT, method="auto", tolerance=1e-9, steps_a_period=None, rival=False)
METHOD = Row({  # of a drift
    "name": "strang", "skipped": None, "periods": [1.0, 10.0], "energy": [1e-9, 2e-9],
    "phase_s": [1e-3, None], "axis": [1e-9, 3e-2], "p_phi": (), "p_psi": (), "invariants": {},
    "energy_exponent": 0.5, "phase_exponent": None, "stderr": {"energy": 0.031, "phase": None},
    "growth": {"energy": 0.5, "phase": "lost"}, "order": 2, "warned": {}, "ended": {},
    "us_per_period": 1234.5, "members": [],
})  # fmt: skip
RUN = Row(NO_RUN, case="cusp", method="auto", formulation="auto", outcome="ok", digits_lost=0.5)
CLAIM = Row(id="holds", statement="", authority="a book", numbers="formula", bound=1e-9,
            measured=2e-13, passed=True, skipped=None, failure=None)  # fmt: skip
FAILING = Row(CLAIM, id="that-fails", authority="Euler", passed=False, measured=1.0)


def diagram_of(*points, scene=SCENE, skipped=()):
    numbers = {"periods": 100, "phase": 99.6, "budget": 4.0}
    return ht.WorkPrecision(scene=scene, **numbers, points=points, skipped=skipped)


def drift_of(*methods):
    study = {"periods": 10, "ensemble": 4, "samples": 2, "seed": 7, "spread": 0.01, "starts": ()}
    return ht.Drift(scene=SCENE, methods=methods, **study)


def stress_of(*runs, **more):
    named = {"hard": {"cusp": "", "unused": ""}, "methods": {"auto": "A", "m": "M 1e-9", "n": "N"}}
    return ht.Stress(limits={"time_s": 3.0}, cases=runs, **named | more)


def validation_of(*claims):
    return ht.Validation(claims=claims)
