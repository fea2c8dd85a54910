"""Cells of a notebook: facts and a small picture of a thing as HTML without scripts; the player."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from html import escape
from typing import TYPE_CHECKING, Any, Final

from heavytop.analytic.motion import Motion
from heavytop.display import Shown
from heavytop.plots.clip import PERIODS
from heavytop.plots.figures import ExactRun, run_figure
from heavytop.plots.sphere import motion_figure
from heavytop.results.base import Fact, Result, Table, given, with_unit
from heavytop.results.check import CheckResult
from heavytop.results.classification import motion_summary, plan_summary
from heavytop.results.run_texts import course_rows, plan_facts, verdict_rows
from heavytop.scene.quantities import quantity_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from heavytop.run.trajectory import Trajectory
    from heavytop.scene.scene import Scene
    from heavytop.scene.state import State
    from heavytop.scene.top import Top

LONGEST: Final = 16  # letters of a number that is shown as an expression

Cell = tuple[str, "Figure | None"]
"""HTML, and a picture beside it."""


def html_of(thing: Any) -> str:
    """What a cell shows of a thing: its picture, and beside it what is said."""
    from heavytop.plots.style import svg_address

    html, figure = _CELLS.get(type(thing).__name__, _result)(thing)
    beside = "display:flex;flex-wrap:wrap;gap:1.5em"
    image = f'<img style="max-width:100%" src="{svg_address(figure)}" alt="">' if figure else ""
    return f'<div style="{beside}">{image}<div>{html}</div></div>'


# --- what each thing shows ------------------------------------------------------------------------


def _table(facts: Iterable[Fact]) -> str:
    return Table.of_facts(facts).html


def _top(top: Top) -> Cell:
    A, C, gMR = (float(getattr(top, name)) for name in ("A", "C", "gMR"))
    facts = [*_exact((name, getattr(top, name)) for name in ("A", "C", "gMR"))]
    shape = "a disc" if C == 2 * A else "flat" if C > A else "round" if C == A else "slender"
    facts.append(("C/A", f"{C / A:.6g} ({shape}: 2 is a disc at the pivot, 0 a needle)"))
    if gMR:
        facts.append(("√(|gMR|/A)", f"{(abs(gMR) / A) ** 0.5:.6g} rad/s"))
    return _table(facts), None


def _exact(values: Iterable[tuple[str, Any]]) -> Iterator[Fact]:
    """Numbers as they were given; long expressions, as sums of solids are, to six digits."""
    for name, x in values:
        text = f"[{', '.join(map(str, x))}]" if isinstance(x, tuple) else str(x)
        formula = not isinstance(x, str) and set(text) & set("/*") and len(text) > LONGEST
        yield quantity_of(name).symbol, with_unit(name, f"{float(x):.6g}" if formula else text)


def _state(state: State) -> Cell:
    values = [(name, x) for name, x in state.given if str(x) != "0"] or [("theta", state.theta)]
    return _table(_exact(values)), None


def _scene(scene: Scene) -> Cell:
    tables = scene.document()
    span = f"{tables['span']}".strip("{}").replace("'", "")
    facts = [("top", given(tables["top"])), ("start", given(tables["start"])), ("span", span)]
    facts.append(("wanted", f"{', '.join(scene.quantities)} to {scene.digits} digits"))
    if scene.events:
        facts.append(("events", ", ".join(scene.events)))
    html, figure = _motion(Motion(scene.top, scene.start))
    return f"<p><b>{escape(scene.title or scene.name)}</b></p>{_table(facts)}{html}", figure


def _motion(motion: Motion) -> Cell:
    summary = motion_summary(motion)
    facts = (*verdict_rows(asdict(motion.verdict)), *course_rows(summary, summary))
    return _table(facts), motion_figure(motion)


def _trajectory(trajectory: Trajectory) -> Cell:
    from heavytop.results.run import run_result

    return run_result(trajectory).html(), run_figure("overview", trajectory)


def _errors(errors: Any) -> Cell:
    sizes = {name: x for name, x in asdict(errors).items() if isinstance(x, float)}
    return _table((quantity_of(name).heading, f"{x:.1e}") for name, x in sizes.items()), None


def _result(result: Result) -> Cell:
    return result.html(), result.figure()


_CELLS: Final[Mapping[str, Callable[[Any], Cell]]] = {
    "Top": _top, "State": _state, "Scene": _scene, "Motion": _motion,
    "Trajectory": _trajectory, "Errors": _errors,
    "Verdict": lambda verdict: (_table(verdict_rows(asdict(verdict))), None),
    "Plan": lambda plan: (_table(plan_facts(plan_summary(plan))), None),
    "Check": lambda check: _result(CheckResult.from_document(check.document())),
}  # fmt: skip
"""By the name of a class; any other is a result."""


# --- the top that moves ---------------------------------------------------------------------------


@dataclass(frozen=True, repr=False)
class Player(Shown):
    """A top that moves in a cell; `html` is the page of it."""

    name: str
    html: str

    @classmethod
    def of(cls, thing: Any, **asked: float | None) -> Player:
        """The player of a trajectory, or of a motion, as `heavytop.display.Played.play` says."""
        from heavytop.report.page import player_html

        run: Any = ExactRun.of(thing, PERIODS) if isinstance(thing, Motion) else thing
        return cls(run.scene.name, player_html(run, **asked))

    def __repr__(self) -> str:
        return f"<Player of {self.name!r}>"

    def _repr_html_(self) -> str:
        looks = "width:100%;max-width:900px;height:40rem;border:0"  # which its page fills
        return (
            f'<iframe title="A top that moves" sandbox="allow-scripts" style="{looks}" '
            f'srcdoc="{escape(self.html)}"></iframe>'
        )
