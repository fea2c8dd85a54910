"""Errors planted on purpose, and how many claims catch each.

A copy of the sources gets one wrong sign, swapped moments, k for m, a lost turn or, at one place,
no number; all claims are measured on it. Errors that few claims can see are FINE: a sign that
matters only upside down, a threshold moved by 1e-25. An error that the claims named with it let
pass ends this with exit code 5. With the word `write` the table goes to docs/validation.md.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
SQUARED = "self.mc * (2 - self.mc)"  # 1 - m^2 where 1 - m is meant
HOLE = "[np.where(np.arange(t.size) == t.size // 2, np.nan, v) for v in values]"  # at one time


class Plant(NamedTuple):
    """One error: a file of the package, texts in it and what stands there instead."""

    name: str
    file: str
    changes: dict[str, str]
    claims: str  # those that are measured soon, and catch it

    @property
    def quick(self):
        return self.claims.split()


PLANTS = (
    Plant("gravity upwards, in the Lagrangian", "equations/lagrangian.py",
          {".subs(g, gMR / (M * R_cm))": ".subs(g, -gMR / (M * R_cm))"},
          "sympy-accelerations dop853-run-dropped dop853-run-upside-down"),
    Plant("gravity upwards, in the axis form", "equations/euler_poisson.py",
          {"torque = -g *": "torque = g *"},
          "gauss-pendulum-run huygens-conical dop853-run-kicked"),
    Plant("gravity upwards, in the closed form", "classification/reduced.py",
          {"return Reduced(gMR / A, b, u,": "return Reduced(-gMR / A, b, u,"},
          "gauss-pendulum landau-fast-precession mpmath-period mpmath-tilt"),
    Plant("A and C exchanged, in the Lagrangian", "equations/lagrangian.py",
          {"A * transverse / 2 + C * omega": "C * transverse / 2 + A * omega"},
          "sympy-accelerations dop853-run-dropped dop853-run-upside-down"),
    Plant("A and C exchanged, in the closed form", "classification/reduced.py",
          {"top.A, top.C, top.gMR, start.thetadot": "top.C, top.A, top.gMR, start.thetadot"},
          "gauss-pendulum landau-fast-period mpmath-period mpmath-tilt"),
    Plant("the modulus k for the parameter m, in the elliptic integrals", "analytic/constants.py",
          {"arb(1).agm(self.mc.sqrt()))": f"arb(1).agm(({SQUARED}).sqrt()))",
           "third_kind(self.mc,": f"third_kind({SQUARED},"},
          "mpmath-first mpmath-third mpmath-period gauss-pendulum"),
    Plant("turns lost, in what is read off the states", "integration/outputs.py",
          {"<= np.pi / 2, turned, angle)": "< 0, turned, angle)"},
          "simo-wong-phi-run simo-wong-psi-run dop853-run-kicked"),
    Plant("a turn lost in every period, in the closed form", "analytic/constants.py",
          {"return P / (self.w * at_u1)":
           "return (0 if P > 0 else -2 * arb.pi()) + P / (self.w * at_u1)"},
          "landau-fast-precession mpmath-precession dop853-closed-form-kicked"),
    Plant("no number at one time, in the integrator", "integration/outputs.py",
          {"zip(form.outputs, values, strict": f"zip(form.outputs, {HOLE}, strict"},
          "betsch-tilt-run dop853-run-tilted gauss-pendulum-run huygens-conical"),
    Plant("no number at one time, in the closed form in doubles", "analytic/doubles.py",
          {"    high, low = z(n, t)\n": "    high, low = z(n, t)\n    high = np.array(high)\n"
           "    high.flat[high.size // 2] = np.nan\n"},
          "dop853-closed-form-kicked dop853-closed-form-tilted dop853-closed-form-dropped"),
    Plant("no number beside one turning point, in the closed form", "analytic/form.py",
          {'_series(r, "function", 1) / r.under,':
           '_series(r, "function", 1) / r.under * (arb("nan") if r.upper is True else 1),'},
          "mpmath-tilt flint-weierstrass lie-closed-form"),
)  # fmt: skip

FINE = (
    Plant("without gravity another modulus, in the closed form", "analytic/constants.py",
          {"(beyond + f3 * minus2) / reach": "(beyond + f3 * minus2) / reach if d3 else arb(2)"},
          "landau-free"),
    Plant("the sleeping threshold lower by 1e-25", "classification/kinds.py",
          {"x.b * x.b - 4 * x.g * x.u0,": "x.b * x.b - 4 * x.g * (x.u0 - x.u0 * 10**-25),"},
          "landau-sleeping"),
    Plant("the rate of ψ, its parts with the other sign, in the closed form", "analytic/form.py",
          {"r.form.kappa + r.side * (r.rates[0]": "r.form.kappa - r.side * (r.rates[0]"},
          "book-spin-partway"),
    Plant("loops at three halves of their kick", "classification/kinds.py",
          {"lambda x: x.cusp_number,": "lambda x: x.cusp_number - x.g * x.drift0 / 2,"},
          "book-figures-edge"),
    Plant("Δψ of a period, its parts twice, in the closed form", "analytic/constants.py",
          {"c.period + c.relative_spin": "c.period + 2 * c.relative_spin"},
          "book-spin"),
    Plant("Δψ of a period, its parts with the other sign, in the enclosures",
          "analytic/constants.py",
          {"c.period + c.relative_spin": "c.period - c.relative_spin"},
          "flint-enclosures"),
    Plant("ψ upside down, its parts with the other sign, in the closed form", "analytic/form.py",
          {"r.form.angles[1](r.turning, r.t, r.side * (": "r.form.angles[1](r.turning, r.t, ("},
          "euler-upside-down"),
    Plant("half of the jump at exact passes, in the closed form", "analytic/constants.py",
          {"turn = N.number(arb.pi() / 2)": "turn = N.number(arb.pi() / 4)"},
          "euler-through"),
    Plant("M R for M R², in a top of parts", "scene/top.py",
          {'values["A_cm"] + M * R**2': 'values["A_cm"] + M * R'},
          "book-exercise-2.11"),
    Plant("the energy of the separatrix higher by 1e-20", "classification/kinds.py",
          {"lambda x: x.over_top,": "lambda x: x.over_top - x.g * x.one_minus_u0 * 10**-20,"},
          "whittaker-kind whittaker-closed-form whittaker-doubles"),
    Plant("the balance of steady precession off by 1e-20", "classification/kinds.py",
          {"lambda x: x.slope0)": "lambda x: x.slope0 + x.g * x.sin2 * 10**-20)"},
          "betsch-kind goldstein-rates"),
)  # fmt: skip


def planted(plant, folder):
    """Copy the package and its claims, with the error in the copy."""
    ignored = shutil.ignore_patterns("__pycache__", "out")
    shutil.copytree(ROOT / "src", folder / "src", ignore=ignored)
    shutil.copytree(ROOT / "validation", folder / "validation", ignore=ignored)
    path = folder / "src" / "heavytop" / plant.file
    text = path.read_text("utf-8")
    for old, new in plant.changes.items():
        if text.count(old) != 1:
            raise ValueError(f"{plant.file} holds {old!r} {text.count(old)} times")
        text = text.replace(old, new)
    path.write_text(text, "utf-8")


def measured(folder, names):
    """Measure claims on the copy, as a user would."""
    command = [sys.executable, "-m", "heavytop", "validate", "--json", "-q", *names]
    here = os.environ | {"PYTHONPATH": str(folder / "src")}
    found = subprocess.run(command, cwd=folder, env=here, capture_output=True, text=True)
    if found.returncode not in (0, 5):
        raise RuntimeError(found.stderr)
    return json.loads(found.stdout)["claims"]


def catch(plant, names):
    """Return the claims that do not hold on the copy with the error."""
    with TemporaryDirectory(prefix="heavytop-plant-") as place:
        planted(plant, Path(place))
        return [each["id"] for each in measured(Path(place), names) if each["passed"] is False]


def table(rows):
    """The plants as a table of the documentation: a row for the plain ones, one for the others."""
    lines = ["| planted errors | claims that catch each |", "|---|--:|"]
    for word, group in (("plain", PLANTS), ("subtle", FINE)):
        caught = [len(names) for plant, names in rows if plant in group]
        some = "; ".join([*dict.fromkeys(plant.name.partition(", in")[0] for plant in group)][:3])
        lines.append(f"| {len(caught)} {word}, such as: {some} | {min(caught)} to {max(caught)} |")
    return "\n".join(lines)


def main():
    """Plant every error, measure every claim."""
    rows = [(plant, catch(plant, ())) for plant in (*PLANTS, *FINE)]
    for plant, names in rows:
        print(f"{len(names):3} {plant.name} ({plant.file})")
    passed = {plant.name: set(plant.quick) - set(names) for plant, names in rows}
    for name in filter(passed.get, passed):
        print(f"{name}: let pass by {', '.join(sorted(passed[name]))}")
    if "write" in sys.argv[1:]:
        from page import rewrite

        rewrite("validation.md", "plants", table(rows), signed=False)
    sys.exit(5 if any(passed.values()) else 0)


if __name__ == "__main__":
    main()
