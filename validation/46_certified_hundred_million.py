"""A hundred million nutation periods of the kicked top, projected, with a proved bound.

    python validation/46_certified_hundred_million.py [again] [write]

It took hours; the result is kept in data/certified-hundred-million.json. Here its claims are read
from that file, and the first periods are integrated and certified again. With the word `again`
everything is: the run is kept as `out/certified-hundred-million.nc`, and the certificate in the
folder of that name, so that what was stopped goes on. `write` puts the table into the docs.
"""

import json
import resource
import sys
import warnings
from dataclasses import replace
from datetime import date
from pathlib import Path

from claim import claim, finish
from page import rewrite

import heavytop as ht
from heavytop.scene.quantities import QUANTITIES

KEPT = Path(__file__).with_name("data") / "certified-hundred-million.json"
FOLDER = Path("out/certified-hundred-million")
FIRST = 10_000  # periods that are done again
HEADS = {"axis": "axis", "theta": "θ [rad]", "phi": "φ [rad]"}


def run_of(periods: int) -> ht.Trajectory:
    """Integrate so many periods, without events: those of a hundred million fill the memory."""
    scene = replace(ht.load_scene("sicm-kicked"), time=None, periods=ht.Exact.of(periods))
    wanted = replace(scene, samples=2, quantities=("theta", "phi"), events=())
    return ht.propagate(wanted, formulation="axis", projected=True)


def cpu_s() -> float:
    """CPU time of this process and of those that have ended, which it began [s]."""
    own, others = (resource.getrusage(x) for x in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(x.ru_utime + x.ru_stime for x in (own, others))


def again() -> None:
    """Integrate and certify a hundred million periods."""
    stored = FOLDER.with_suffix(".nc")
    if not stored.exists():
        run_of(10**8).save(stored)
    integrated = cpu_s()
    found = ht.certify(ht.load_trajectory(stored), jobs=2, folder=FOLDER)
    cost = {"integration_h": integrated / 3600, "certificate_h": (cpu_s() - integrated) / 3600}
    made = {"cpu": cost, "date": str(date.today())}
    KEPT.write_text(json.dumps(found.document() | made, indent=1) + "\n", "utf-8")


def at_most(bound: float) -> str:
    """A proved bound, rounded up."""
    return QUANTITIES["bound"].text(bound)


def main() -> None:
    """Print the claims."""
    if "again" in sys.argv:
        again()
    kept = json.loads(KEPT.read_text("utf-8"))
    bound, rounding, seen = (kept[name] for name in ("bound", "rounding", "observed"))
    added = {name: at_most(x) if x else "–" for name, x in rounding.items()}
    table = [
        "| | proved bound | part from adding turns | largest error without it |",
        "|---|--:|--:|--:|",
        *(
            f"| {head} | {at_most(bound[name])} | {added[name]} | {seen[name]:.1e} |"
            for name, head in HEADS.items()
        ),
    ]
    print("\n".join(table))
    print(f"{kept['steps']} steps, {kept['t']:.6g} s of motion; hours of CPU: {kept['cpu']}")
    if "write" in sys.argv:
        rewrite("certificates.md", "certified hundred million", "\n".join(table))
    claim("1e8 periods, axis: proved bound", bound["axis"], 1.1e-10)
    claim(
        "1e8 periods, axis: bound over the largest error found", bound["axis"] / seen["axis"], 1.5
    )
    claim("1e8 periods: what is not proved", len(kept["why"]) + (not kept["turns"]), 0)
    found = ht.certify(run_of(FIRST))
    claim(f"{FIRST} periods, axis: proved bound", found.bound["axis"], 1e-12)
    for name in HEADS:
        claim(f"{FIRST} periods, {name}: bound over that of 1e8",
              found.bound[name] / bound[name], 1.0)  # fmt: skip


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    main()
    finish()
