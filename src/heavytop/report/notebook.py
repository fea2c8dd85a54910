"""Cells of a notebook: facts and a small picture of a thing as HTML without scripts; the player."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from html import escape
from typing import TYPE_CHECKING, Any, Final

from heavytop.analytic.motion import Motion
from heavytop.display import Shown
from heavytop.plots.exact_run import ExactRun
from heavytop.plots.sphere import motion_figure
from heavytop.report.player import PERIODS
from heavytop.report.run import course_rows, plan_parts, verdict_rows
from heavytop.report.studies import RESULTS, kind_of, parts_of
from heavytop.report.tables import (
    SYMBOLS,
    Fitting,
    Part,
    Table,
    facts,
    given,
    headed,
    number,
    size,
    with_unit,
)
from heavytop.results.classification import MotionSummary, PlanSummary

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from heavytop.run.trajectory import Trajectory
    from heavytop.scene.scene import Scene
    from heavytop.scene.state import State
    from heavytop.scene.top import Top

HEIGHT: Final = 810  # px of a player: all of its page, from 500 px of width on
LONGEST: Final = 16  # letters of a number that is shown as an expression

Cell = tuple[Iterable[Part], "Figure | None"]


def html_of(thing: Any) -> str:
    """What a cell shows of a thing."""
    parts, figure = _CELLS.get(type(thing).__name__, _result)(thing)
    tables = "".join(map(_part, parts))
    beside = "display:flex;flex-wrap:wrap;gap:1.5em"
    return f'<div style="{beside}">{_picture(figure)}<div>{tables}</div></div>'


def _picture(figure: Figure | None) -> str:
    """A figure as SVG, as an image: its identifiers meet no others of the notebook."""
    if figure is None:
        return ""
    from base64 import b64encode

    from heavytop.plots.style import svg

    data = b64encode(svg(figure).encode()).decode()
    return f'<img style="max-width:100%" src="data:image/svg+xml;base64,{data}" alt="">'


def _part(part: Part) -> str:
    if isinstance(part, Fitting):
        return "".join(map(_part, part.forms[0]))
    if isinstance(part, str):
        return f"<p><b>{escape(part)}</b></p>"
    caption = f"<caption>{escape(part.title)}</caption>" if part.title else ""
    return f"<table>{caption}{''.join(_rows(part))}</table>"


def _rows(table: Table) -> Iterator[str]:
    def cells(tag: str, texts: Iterable[str]) -> str:
        return "".join(
            f'<{tag} style="text-align:{"left" if k < table.left or not table.head else "right"}">'
            f"{escape(text)}</{tag}>"
            for k, text in enumerate(texts)
        )

    if table.head:
        yield f"<tr>{cells('th', table.head)}</tr>"
    for row in table.rows:
        yield f"<tr>{cells('td', row)}</tr>"


# --- what each thing shows ------------------------------------------------------------------------


def _top(top: Top) -> Cell:
    A, C, gMR = (float(getattr(top, name)) for name in ("A", "C", "gMR"))
    rows = [(SYMBOLS[name][0], f"{_exact(getattr(top, name))} {SYMBOLS[name][1]}") for name in _TOP]
    shape = "a disc" if C == 2 * A else "flat" if C > A else "round" if C == A else "slender"
    rows.append(("C/A", f"{number(C / A, 6)} ({shape}: 2 is a disc at the pivot, 0 a needle)"))
    if gMR:
        rows.append(("√(|gMR|/A)", f"{number((abs(gMR) / A) ** 0.5, 6)} rad/s"))
    return [facts(rows)], None


def _exact(x: Any) -> str:
    """A number as it was given; a long expression, as sums of solids are, to six digits."""
    if isinstance(x, tuple):
        return f"[{', '.join(map(_exact, x))}]"
    text = str(x)
    formula = not isinstance(x, str) and set(text) & set("/*")
    return number(float(x), 6) if formula and len(text) > LONGEST else text


def _state(state: State) -> Cell:
    told = [(name, x) for name, x in state.given if str(x) != "0"] or [("theta", state.theta)]
    rows = ((SYMBOLS.get(name, (name,))[0], with_unit(name, _exact(x))) for name, x in told)
    return [facts(rows)], None


def _scene(scene: Scene) -> Cell:
    known = scene.document()
    span = f"{known['span']}".strip("{}").replace("'", "")
    rows = [("top", given(known["top"])), ("start", given(known["start"])), ("span", span)]
    rows.append(("wanted", f"{', '.join(scene.quantities)} to {scene.digits} digits"))
    if scene.events:
        rows.append(("events", ", ".join(scene.events)))
    parts, figure = _motion(Motion(scene.top, scene.start))
    return [scene.title or scene.name, facts(rows), *parts], figure


def _motion(motion: Motion) -> Cell:
    summary = MotionSummary.of(motion).document()
    rows = (*verdict_rows(asdict(motion.verdict)), *course_rows(summary, summary))
    return [facts(rows)], motion_figure(motion)


def _verdict(verdict: Any) -> Cell:
    return [facts(verdict_rows(asdict(verdict)))], None


def _plan(plan: Any) -> Cell:
    rows: Iterator[Any] = plan_parts({"plan": PlanSummary.of(plan).document()})
    return [facts(rows)], None


def _trajectory(trajectory: Trajectory) -> Cell:
    from heavytop.plots.figures import overview
    from heavytop.results.run import run_result

    return parts_of(run_result(trajectory).document()), overview(trajectory)


def _errors(errors: Any) -> Cell:
    known = [(name, x) for name, x in asdict(errors).items() if isinstance(x, float)]
    return [facts((headed(name), size(x)) for name, x in known)], None


def _atlas(atlas: Any) -> Cell:
    [chart] = RESULTS["atlas"].charts
    drawn = hasattr(atlas, "plane")  # one read from its document has no map
    return parts_of(atlas.document()), chart.draw(atlas) if drawn else None


def _result(result: Any) -> Cell:
    document = result.document()
    charts = (chart for chart in RESULTS[kind_of(document)].charts if document[chart.shows])
    chart = next(charts, None)
    return parts_of(document), chart and chart.draw(document)


_TOP: Final = ("A", "C", "gMR")
_CELLS: Final[Mapping[str, Callable[[Any], Cell]]] = {
    "Top": _top, "State": _state, "Scene": _scene, "Motion": _motion, "Verdict": _verdict,
    "Plan": _plan, "Trajectory": _trajectory, "Errors": _errors, "Atlas": _atlas,
    "AtlasResult": _atlas,
}  # fmt: skip
"""By the name of a class; any other is a result with a document."""


# --- the top that moves ---------------------------------------------------------------------------


@dataclass(frozen=True, repr=False)
class Player(Shown):
    """A top that moves in a cell; `html` is the page of it."""

    name: str
    html: str

    @classmethod
    def of(cls, thing: Any) -> Player:
        """The player of a trajectory, or of a motion."""
        from heavytop.report.page import player_html

        run: Any = ExactRun.of(thing, PERIODS) if isinstance(thing, Motion) else thing
        return cls(run.scene.name, player_html(run))

    def __repr__(self) -> str:
        return f"<Player of {self.name!r}>"

    def _repr_html_(self) -> str:
        looks = f"width:100%;max-width:900px;height:{HEIGHT}px;border:0"
        return (
            f'<iframe title="A top that moves" sandbox="allow-scripts" style="{looks}" '
            f'srcdoc="{escape(self.html)}"></iframe>'
        )
