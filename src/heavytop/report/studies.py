"""What every kind of result is called, what it says as facts and tables, and what is drawn of it.

What a run says is in `heavytop.report.run`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from importlib import import_module
from itertools import groupby
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from heavytop.report.run import classify_parts, plan_parts, run_parts
from heavytop.report.tables import (
    FAIL,
    MISSING,
    SHOWN,
    Fitting,
    Known,
    Line,
    Part,
    Row,
    Table,
    at_most,
    facts,
    given,
    grouped,
    headed,
    number,
    printed,
    size,
    title,
    with_unit,
)
from heavytop.results.stress import MARKS, UNTOLD
from heavytop.scene.quantities import scaled
from heavytop.studies.sweep import unit_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import RenderableType

# --- drift ---------------------------------------------------------------------------------------


def drift_parts(document: Known) -> Iterator[Line]:
    """What was asked, the errors of every method at the last time, what was skipped and why."""
    count = document["ensemble"]
    several = f"{count} starts within {document['spread']:.0%} (seed {document['seed']}), RMS"
    starts = "the scene's start" if count == 1 else several
    yield "drift", f"{document['periods']:g} nutation periods, {starts}"
    yield "errors", "at the last time; energy relative to max(|E'|, gMR)"
    yield "as t^", "grows as this power of time, with its standard error: 1.40(2) is 1.40 ± 0.02"
    yield "lost", "a phase error of more than a twentieth of a period"
    head = ("method", "µs/\nperiod", "energy", "as t^", "phase\n[s]", "as t^", "axis")
    done = (each for each in document["methods"] if each["skipped"] is None)
    yield Table(head, tuple(map(_drift_row, done)))
    for each in document["methods"]:
        if each["skipped"] is not None:
            yield each["name"], f"skipped: {each['skipped']}"
        elif each["periods"] and each["periods"][-1] < 0.5 * document["periods"]:
            yield each["name"], f"to {each['periods'][-1]:.4g} periods"
        for start, why in each["ended"].items():
            which = f"start {start} " if document["ensemble"] > 1 else ""
            yield each["name"], f"{which}ended early: {why}"


def _drift_row(method: Known) -> Row:
    energy, phase, axis = (
        size(method[name][-1] if method[name] else None) for name in ("energy", "phase_s", "axis")
    )
    return (
        method["name"], number(method.get("us_per_period"), 3), energy, _power(method, "energy"),
        "lost" if method["periods"] and phase == MISSING else phase, _power(method, "phase"), axis,
    )  # fmt: skip


def _power(method: Known, name: str) -> str:
    """An exponent as physicists write it: 1.40(2) is 1.40 ± 0.02."""
    exponent, error = method[f"{name}_exponent"], method["stderr"].get(name)
    if exponent is None:
        return MISSING
    hundredths = max(1, round(100 * (error or 0)))
    return f"{exponent:.2f}({hundredths})" if hundredths < 100 else f"{exponent:.0f}({error:.0f})"


# --- work and precision --------------------------------------------------------------------------

TARGETS: Final = ("1e-6", "1e-9", "1e-12")
BESTS: Final = {"best": ", best", "best_in_doubles": ", best in doubles"}


def work_precision_parts(document: Known) -> Iterator[Line]:
    """A row for each method, the fronts, who is cheapest, what was left out."""
    points = document["points"]
    theta_alone = all(point["measures"] == "theta" for point in points)
    yield (
        "runs",
        f"{document['periods']:g} nutation periods, all methods interleaved in one process",
    )
    yield "times", "µs a period to reach this error; best: the least error, and its time; setup [s]"
    yield "errors", "of the axis; θ marks an error of θ, where the states give no axis"
    yield Table(("method", *TARGETS, "best", "at", "setup"), tuple(map(_row, summaries(points))))
    sides = {"": "θ"} if theta_alone else {"": "axis", "_theta": "θ alone"}
    for side, label in sides.items():
        some = [points[i] for i in document[f"front{side}"]]
        rows = tuple(
            (p["method"], setting(p), time(p), size(p[f"{side}_error".strip("_")])) for p in some
        )
        if rows:
            yield Table((f"Pareto front, {label}", "setting", "µs/period", "error"), rows)
    yield facts(
        (f"{label}{BESTS.get(target, f' to {target}')}", _leader(found))
        for side, label in sides.items()
        for target, found in document[f"cheapest{side}"].items()
    )
    yield from _left_out(document)


class Summary(NamedTuple):
    """A method at its cheapest within each of `TARGETS`, and at its best.

    Attributes
    ----------
    name : str
    within : tuple of mapping or None
    best : mapping
    setup_s : float
        The longest of all its settings [s].
    """

    name: str
    within: tuple[Known | None, ...]
    best: Known
    setup_s: float


def summaries(points: Sequence[Known]) -> Iterator[Summary]:
    """A summary for each method.

    Parameters
    ----------
    points : sequence of mapping
        Those of a document of the schema ``heavytop/workprec/1``.
    """
    for (name, _), same in grouped(points, "method", "measures").items():
        met = ([p for p in same if p["error"] <= float(target)] for target in TARGETS)
        yield Summary(
            name,
            tuple(min(some, key=lambda p: p["us_per_period"], default=None) for some in met),
            min(same, key=lambda point: point["error"]),
            max(point["setup_s"] for point in same),
        )


def _row(of: Summary) -> Row:
    within = [MISSING if point is None else time(point) for point in of.within]
    return of.name, *within, error(of.best), time(of.best), f"{of.setup_s:.2g}"


def time(point: Known) -> str:
    """The time of a period to three digits [µs], without an exponent."""
    rounded = f"{point['us_per_period']:.3g}"
    return f"{float(rounded):.0f}" if "e" in rounded else rounded


def error(point: Known) -> str:
    """The error of a point, marked where it is that of θ."""
    return f"{size(point['error'])}{' θ' if point['measures'] == 'theta' else '  '}"


def setting(point: Known) -> str:
    """The setting of a point in words."""
    if point["tolerance"] is not None:
        return f"{point['tolerance']:.2g}"
    return f"{point['steps_a_period']:g} steps a period"


def _leader(found: Known | None) -> str:
    """Who is cheapest, and who of the other side comes next."""
    if found is None:
        return MISSING
    words = f"{found['method']} ({setting(found)}), {time(found)} µs, error {size(found['error'])}"
    if (other := found.get("against")) is None:
        return words
    whose = "the best other integrator" if other["rival"] else "the Taylor integrator's best"
    ratio = f"takes {found['ratio']:.3g} times as long"
    return f"{words}; {whose}, {other['method']} ({setting(other)}), {ratio}"


def _left_out(document: Known) -> Iterator[Row]:
    """What was left out: a line for each reason, with the methods and the first setting of each."""
    rivals = document["rivals"]
    if rivals["left_out"] and not rivals["run"]:
        yield "rivals", "NO OTHER INTEGRATOR WAS RUN: this compares with no other method"
    elif rivals["left_out"]:
        yield "rivals", f"only these were run: {', '.join(rivals['run'])}"
    for (reason,), same in grouped(document["skipped"], "reason").items():
        methods = grouped(same, "method").items()
        settings = (f"{name} ({len(some)} setting{'s'[: len(some) != 1]} from {_setting(some[0])})"
                    for (name,), some in methods)  # fmt: skip
        yield "left out", f"{reason}: {', '.join(settings)}"


def _setting(skipped: Known) -> str:
    [(what, value)] = skipped["setting"].items()
    return f"{value:.3g}{'' if what == 'tolerance' else f' {what}'}"


# --- where methods fail --------------------------------------------------------------------------

COLUMNS: Final = "a method over its setting; a form alone is Taylor's; :a axis form, :l Lagrange's"
UNTOLD_RULE: Final = "undetermined: conditioning leaves no digits, so that agreement is chance"


def stress_parts(document: Known) -> Iterator[Line]:
    """A row for each case with a column for each method; what the marks mean; what failed."""
    runs = document["cases"]
    names = [name for name in document["methods"] if name in {run["method"] for run in runs}]
    yield "stress: digits lost beyond what conditioning allows"
    if names:
        yield Fitting(tuple(_tables(document, names, n) for n in range(len(names), 0, -1)))
    if any(":" not in name and name != "auto" for name in names):  # not only one's own
        yield "columns", COLUMNS
    seen = {run["outcome"] for run in runs}
    for word, rule in document["rules"].items():
        if word in seen and word in MARKS:
            yield f"{MARKS[word]} {word}", rule
    if any(run["untold"] for run in runs):
        yield UNTOLD, UNTOLD_RULE
    yield from _failed(document)
    for (reason,), some in grouped(document["skipped"], "reason").items():
        pairs = ", ".join(f"{each['case']}/{each['method']}" for each in some)
        yield "skipped", f"{reason}: {pairs}"
    wrong = ", ".join(document["auto"]["silently_wrong"]) or "nowhere"
    yield "auto", f"was silently wrong: {wrong}" if document["auto"]["run"] else "was not run"


def certify_parts(document: Known) -> Iterator[Line]:
    """The bounds beside the largest errors found; the events; what is not proved."""
    how = "projected" if document["projected"] else "not projected"
    form = document["formulation"]
    yield "run", f"{form} form, {how}, {document['steps']} steps, to t = {document['t']:.12g} s"
    names = [name for name, x in document["observed"].items() if x is not None]
    bounds = document["bound"]
    yield Table(
        ("", "proved bound", "part from adding turns", "largest error without it"),
        tuple(
            (
                "axis, as a length" if name == "axis" else headed(name),
                "none" if bounds[name] is None else at_most(bounds[name]),
                at_most(document["rounding"][name]) if document["rounding"][name] else MISSING,
                size(document["observed"][name]),
            )
            for name in names
        ),
    )
    if document["turns"] is not None:
        yield "whole turns", "proved" if document["turns"] else "not proved"
    events = dict(document["events"])
    time_bound = events.pop("time_bound_s")
    for event, known in events.items():
        if known is None:
            continue
        words = {True: "none missed, none doubled", False: "not proved", None: "not proved"}
        yield event, f"{known['count']}, {words[known['proved']]}"
    if time_bound is not None:
        yield "event times", f"off by at most {at_most(time_bound)} s"
    for reason in document["why"]:
        yield "why", reason
    proved = [headed(name).split()[0] for name in names if bounds[name] is not None]
    yield "bounds proved", f"of {', '.join(proved)}" if proved else "none"


def stress_cases_parts(document: Known) -> Iterator[Line]:
    """The cases: top, start, span and why each is hard; and the methods."""
    for case in document["cases"]:
        known = {n: x for n, x in (case["top"] | case["start"]).items() if x != "0"}
        yield case["name"], f"{case['why']}\n{given(known)}; {case['span']}"
    yield facts(
        (each["name"], ", ".join(filter(None, map(each.get, ("short", "formulation", "setting")))))
        for each in document["methods"]
    )
    yield "the cases are built in; for a scene of your own use drift or workprec"


def _tables(document: Known, names: Sequence[str], across: int) -> tuple[Table, ...]:
    """Tables of so many methods side by side."""
    found = {(run["case"], run["method"]): run for run in document["cases"]}
    tables = []
    for first in range(0, len(names), across):
        some = names[first : first + across]
        rows = ((case, *(cell(found.get((case, n))) for n in some)) for case in document["hard"])
        head = ("case", *(document["methods"][name].replace(" ", "\n") for name in some))
        tables.append(Table(head, tuple(row for row in rows if {*row[1:]} != {MISSING})))
    return tuple(tables)


def cell(run: Known | None) -> str:
    """One run in a few letters: the digits it lost, and a mark where it failed.

    Examples
    --------
    >>> cell({"outcome": "inaccurate", "digits_lost": 9.42, "untold": False, "turns": None})
    '9.4 !'
    """
    if run is None:
        return MISSING
    if run["untold"]:
        return UNTOLD
    lost = run["digits_lost"]
    digits = "" if lost is None else f"{lost:.1f}" if lost else "0"
    return f"{digits} {MARKS.get(run['outcome'], '')}".strip()


def _failed(document: Known) -> Iterator[Row]:
    """What failed, a line for each case, outcome and note, with the methods it befell."""
    order = list(document["hard"])
    failed = [
        run
        for run in sorted(document["cases"], key=lambda run: order.index(run["case"]))
        if run["outcome"] != "ok" or run["untold"] or any(run["turns"] or ())
    ]
    for (case, word, note), runs in grouped(failed, "case", "outcome", "note").items():
        yield case, f"{word}: {', '.join(r['method'] for r in runs)}{note and f': {note}'}"


# --- atlas ---------------------------------------------------------------------------------------


def atlas_parts(document: Known) -> Iterator[Line]:
    """How many pixels there are of each kind; the axes and boundaries."""
    yield Table(("kind", "pixels", "share"), tuple(_kinds(document)))
    yield from _map(document)


def _kinds(document: Known) -> Iterator[Row]:
    """Kinds, and where they are told apart further their parts; every pixel once."""
    details = document.get("details") or {}
    counts = dict(document["counts"])
    for part, count in details.items():
        counts[part.partition(",")[0]] -= count
    rows = {name: count for name, count in counts.items() if count} | details
    every = sum(rows.values()) or 1
    for name, count in sorted(rows.items(), key=lambda each: -each[1]):
        yield name, str(count), f"{count / every:.3%}"


def _map(document: Known) -> Iterator[Row]:
    from heavytop.studies.atlas_plane import ROLES  # which takes its time to import

    axes, scene = document["axes"], document["scene"]
    for side, axis in axes.items():
        ends = with_unit(axis["name"], f"{axis['low']:.6g} … {axis['high']:.6g}")
        scale = ", logarithmic" if axis["log"] else ""
        yield side, f"{axis['name']} = {ends}, {axis['count']} values{scale}"
    changed = {ROLES[axis["name"]].sets for axis in axes.values()}
    held = (scene["top"] | scene["start"]).items()
    yield "held", given({n: x for n, x in held if n in ROLES and ROLES[n].sets not in changed})
    yield "not proved", str(document["uncertified"])
    lines = Counter(curve["name"] for curve in document["curves"]).items()
    counted = (f"{name} ({n} line{'s' * (n > 1)})" for name, n in lines)
    yield "boundaries", ", ".join(counted) or "none"
    for name, label in (("sent", "decided by intervals"), ("kinds_per_s", "pixels per second")):
        if document.get(name) is not None:
            yield label, number(document[name], 3 if name == "kinds_per_s" else 12)


# --- the other way round, and over a range -------------------------------------------------------


def find_parts(document: Known) -> Iterator[Line]:
    """The solutions, and the facts of each."""
    key = document["vary"].partition("=")[0].strip()
    yield "so that", document["so_that"]
    for each in document["solutions"]:
        value, factor = in_unit(key, each["value"]), scaled(unit_of(key), SHOWN.get())[1]
        low, high = (factor * end for end in each["bracket"])
        yield key, f"{value}, proved between {number(low, 17)} and {number(high, 17)}"
        known = ((name, x) for name, x in each["facts"].items() if x is not None)
        yield "", ", ".join(f"{name.replace('_', ' ')} {in_unit(name, x, 6)}" for name, x in known)
    if document["why"]:
        yield "", document["why"]


def sweep_parts(document: Known) -> Iterator[Line]:
    """A row for each value: the kind of motion and its facts."""
    rows = document["rows"]
    names = [*rows[0]]
    units = {name: scaled(unit_of(name), SHOWN.get()) for name in names}
    heads = (f"{name} [{unit}]" if unit else name for name, (unit, _) in units.items())
    cells = (
        tuple(
            number(x * units[name][1] if isinstance(x, float) else x, 8) for name, x in row.items()
        )
        for row in rows
    )
    yield Table(tuple(heads), tuple(cells), left=0)


def in_unit(name: str, value: float, digits: int = 12) -> str:
    """A value of a fact or of a key of a scene, with its unit."""
    unit, factor = scaled(unit_of(name), SHOWN.get())
    return f"{number(value * factor, digits)} {unit}".rstrip()


# --- a trajectory of somebody else ----------------------------------------------------------------


def check_parts(document: Known) -> Iterator[Line]:
    """The errors of the trajectory, its events, and the slip that explains them."""
    from heavytop.checking.result import told  # which brings numpy along

    return told(document)


# --- claims --------------------------------------------------------------------------------------

VERDICTS: Final = {True: "ok", False: FAIL, None: "skip"}


def validate_parts(document: Known) -> Iterator[Line]:
    """For each authority its claims; then what went wrong or was skipped, and why."""
    yield "validate: a claim holds if the measured number is at most its bound"
    for (authority,), claims in grouped(document["claims"], "authority").items():
        rows = (
            (VERDICTS[each["passed"]], each["statement"], each["numbers"],
             number(each["measured"], 2), number(each["bound"], 2))
            for each in claims
        )  # fmt: skip
        head = ("", "claim", "numbers", "measured", "bound")
        yield Table(head, tuple(rows), authority, left=3)
    for claim in document["claims"]:
        if claim["skipped"]:
            yield claim["id"], f"skipped: {claim['skipped']}"
        elif claim["failure"] or claim["passed"] is False:
            yield claim["id"], claim["failure"] or "out of its bound"
    yield summary(document["claims"])


def summary(claims: Sequence[Known]) -> str:
    """How many claims hold, fail and were skipped.

    Examples
    --------
    >>> summary([{"passed": True}, {"passed": None}])
    '1 holds, none fails, 1 skipped'
    """
    count = Counter(claim["passed"] for claim in claims)
    words = [f"{count[True]} {'holds' if count[True] == 1 else 'hold'}"]
    words.append(f"{count[False] or 'none'} {'fail' if count[False] > 1 else 'fails'}")
    return ", ".join([*words, f"{count[None]} skipped"] if count[None] else words)


# --- every kind of result ------------------------------------------------------------------------


class Chart(NamedTuple):
    """A chart of a document: its function in `heavytop.plots`, its title, and the key of what it
    shows, without which there is nothing to draw.
    """

    function: str
    title: str
    shows: str

    @property
    def name(self) -> str:
        """The name of its file."""
        return self.function.partition(".")[2].removesuffix("_figure")

    def draw(self, *of: Any) -> Figure:
        """The chart; what draws takes its time to import."""
        module, _, name = self.function.partition(".")
        figure: Figure = getattr(import_module(f"heavytop.plots.{module}"), name)(*of)
        return figure


class ResultKind(NamedTuple):
    """A kind of result: its heading on a page, what it says, and its charts."""

    heading: str
    lines: Callable[[Known], Iterable[Line]]
    charts: tuple[Chart, ...] = ()


RESULTS: Final[Mapping[str, ResultKind]] = {
    "run": ResultKind("Run", run_parts),
    "plan": ResultKind("Plan", plan_parts),
    "classify": ResultKind("Classification", classify_parts),
    "drift": ResultKind("Drift", drift_parts, (
        Chart("studies.drift_figure", "errors over nutation periods, both logarithmic",
              "methods"),)),
    "workprec": ResultKind("Work and precision", work_precision_parts, (
        Chart("studies.workprec_figure", "time of a period over error, both logarithmic",
              "points"),)),
    "stress": ResultKind("Where methods fail", stress_parts, (
        Chart("studies.stress_figure", "digits lost at every case by every method",
              "cases"),)),
    "find": ResultKind("Found", find_parts),
    "sweep": ResultKind("Sweep", sweep_parts, (
        Chart("studies.sweep_figure", "facts over the range", "rows"),)),
    "stress-cases": ResultKind("Cases", stress_cases_parts),
    "atlas": ResultKind("Atlas", atlas_parts, (
        Chart("atlas.atlas_figure", "kinds of motion, and their boundaries", "counts"),
    )),
    "check": ResultKind("Check", check_parts, (
        Chart("studies.check_figure", "errors of the trajectory over time, and how far it runs "
              "ahead", "curves"),)),
    "certify": ResultKind("Certificate", certify_parts),
    "validate": ResultKind("Claims", validate_parts),
}  # fmt: skip
"""By the name in the schema of a document."""


def kind_of(document: Known) -> str:
    """The name in the schema of a document."""
    return str(document["schema"].split("/")[1])


def parts_of(document: Known) -> Iterator[Part]:
    """What a document says; facts that follow one another are one table."""
    lines = [*RESULTS[kind_of(document)].lines(document)]
    if document.get("files"):
        lines.append(("files", ", ".join(document["files"].values())))
    for alone, some in groupby(lines, lambda line: type(line) is tuple):
        found: list[Any] = list(some)
        yield from [facts(found)] if alone else found


def rendered(document: Known) -> RenderableType:
    """A document at a terminal, below the title of its scene if it has one."""
    return printed(parts_of(document), title(document.get("scene") or {}))
