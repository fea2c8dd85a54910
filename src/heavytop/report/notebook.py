"""Cells of a notebook: facts and a small picture as HTML without scripts; and the player."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from html import escape
from typing import Any, Final

from matplotlib.figure import Figure

from heavytop.analytic.motion import Motion
from heavytop.plots.sphere import motion_figure
from heavytop.results import classification as results
from heavytop.results.base import Result, nonzero
from heavytop.results.run import run_result
from heavytop.results.table import Fact, Table
from heavytop.scene.quantities import quantity_of
from heavytop.scene.scene import Scene
from heavytop.scene.state import State
from heavytop.scene.top import Top
from heavytop.text import Shown, with_article

LONGEST_EXPRESSION: Final = 16  # letters: longer expressions are shown as decimals

Cell = tuple[Any, Figure | None]
"""A result, or facts, and a picture beside it."""


def html_of(thing: Any) -> str:
    """The HTML of a thing: its picture, and beside it facts or tables."""
    from heavytop.plots.style import svg_address

    facts, figure = _CELLS.get(type(thing).__name__, _result_cell)(thing)
    html = facts.html() if isinstance(facts, Result) else Table.of_facts(facts).html
    layout = "display:flex;flex-wrap:wrap;gap:1.5em"
    looks = f'style="max-width:100%" alt="picture of {with_article(type(thing).__name__)}"'
    image = f'<img {looks} src="{svg_address(figure)}">' if figure else ""
    return f'<div style="{layout}">{image}<div>{html}</div></div>'


# --- facts and pictures of each type --------------------------------------------------------------


def _result_cell(found: Result) -> Cell:
    """A result, and its figure."""
    return found, found.figure()


def _top_facts(top: Top) -> Iterator[Fact]:
    """Yield the numbers of a top, its shape and its rate."""
    A, C, gMR = (float(getattr(top, name)) for name in ("A", "C", "gMR"))
    yield from _facts_of((name, getattr(top, name)) for name in ("A", "C", "gMR"))
    shape = "a disc" if C == 2 * A else "flat" if C > A else "round" if C == A else "slender"
    yield "C/A", f"{C / A:.6g} ({shape}: 2 is a disc at the pivot, 0 a needle)"
    if gMR:
        yield "√(|gMR|/A)", f"{(abs(gMR) / A) ** 0.5:.6g} rad/s"


def _facts_of(values: Iterable[tuple[str, Any]]) -> Iterator[Fact]:
    """Yield numbers as they were given; long expressions, as of sums of solids, to six digits."""
    for name, x in values:
        text = f"[{', '.join(map(str, x))}]" if isinstance(x, tuple) else str(x)
        formula = not isinstance(x, str) and {*text} & {*"/*"} and len(text) > LONGEST_EXPRESSION
        quantity = quantity_of(name)
        yield quantity.symbol, quantity.with_unit(f"{float(x):.6g}" if formula else text)


def _state_facts(state: State) -> Iterator[Fact]:
    """Yield the numbers of a start that are not 0."""
    yield from _facts_of([x for x in state.given if str(x[1]) != "0"] or [("theta", state.theta)])


def _scene_facts(scene: Scene) -> Iterator[Fact]:
    """Yield the parts of a scene, and the facts of its motion."""
    tables = scene.document()
    yield "scene", scene.title or scene.name
    yield "top", nonzero(tables["top"])
    yield "start", nonzero(tables["start"])
    yield "span", f"{tables['span']}".strip("{}").replace("'", "")
    yield "wanted", f"{', '.join(scene.quantities)} to {scene.digits} digits"
    if scene.events:
        yield "events", ", ".join(scene.events)
    yield from _motion_facts(Motion(scene.top, scene.start))


def _motion_facts(motion: Motion) -> Iterator[Fact]:
    """Yield the verdict and the course of a motion."""
    summary = results.motion_summary(motion)
    yield from results.verdict_facts(summary)
    yield from results.course_facts(summary)


def _error_facts(errors: Any) -> Iterator[Fact]:
    """Yield the errors of a run that are numbers."""
    for name, x in asdict(errors).items():
        if isinstance(x, float):
            yield quantity_of(name).heading, f"{x:.1e}"


_CELLS: Final[Mapping[str, Callable[[Any], Cell]]] = {
    "Top": lambda top: (_top_facts(top), None),
    "State": lambda state: (_state_facts(state), None),
    "Scene": lambda scene: (_scene_facts(scene), motion_figure(Motion(scene.top, scene.start))),
    "Motion": lambda motion: (_motion_facts(motion), motion_figure(motion)),
    "Trajectory": lambda run: _result_cell(run_result(run)),
    "Errors": lambda errors: (_error_facts(errors), None),
    "Verdict": lambda verdict: (results.verdict_facts(asdict(verdict)), None),
    "Plan": lambda plan: (results.Planned(scene={}, plan=results.plan_summary(plan)).facts(), None),
}
"""The cells by the name of a class; any other class is a result."""


# --- the top that moves ---------------------------------------------------------------------------


@dataclass(frozen=True, repr=False)
class Player(Shown):
    """An animation of a top in a cell; `html` is its page."""

    name: str
    html: str

    @classmethod
    def of(cls, thing: Any, **asked: float | None) -> Player:
        """The player of a trajectory, or of a motion, as `heavytop.text.Played.play` says."""
        from heavytop.report.page import player_html

        name = str(thing.kind) if isinstance(thing, Motion) else thing.scene.name
        return cls(name, player_html(thing, **asked))

    def __repr__(self) -> str:
        return f"<Player of {self.name!r}>"

    def _repr_html_(self) -> str:
        looks = "width:100%;max-width:900px;height:40rem;border:0"  # which its page fills
        return (
            f'<iframe title="A top that moves" sandbox="allow-scripts" style="{looks}" '
            f'srcdoc="{escape(self.html)}"></iframe>'
        )
