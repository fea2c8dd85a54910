"""Pictures of a run: each is a function that draws on axes, and returns them.

Keywords of matplotlib for the line replace those of the picture.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Final, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from heavytop.analytic.motion import Motion
from heavytop.analytic.potential import Potential
from heavytop.classification import Kind
from heavytop.errors import Impossible, NoClosedForm
from heavytop.exact.pairs import Array
from heavytop.plots import style
from heavytop.plots.drawn_run import CURVE_POINTS, MOST_DRAWN_PERIODS, UNSEEN, DrawnRun
from heavytop.plots.sphere import PUSH, STEADY_TURN_S, View, axis_path, push
from heavytop.plots.style import add_title, line, new_label
from heavytop.results.run import FIGURES
from heavytop.scene.quantities import ANGLES, QUANTITIES, RATES, derived

if TYPE_CHECKING:
    from heavytop.run.exact import SceneMotion
    from heavytop.run.trajectory import Trajectory

Looks = Mapping[str, Any]  # keywords of matplotlib
CONSTANT: Final = 1e-9  # rad: a smaller range is rounding, and gets no scale of its own
PEAK: Final = 20.0  # times the usual range: higher peaks are cut off
POTENTIAL_HEIGHT: Final = 1.6**2  # height of the picture over the energy that is shown
FAMILY: Final = (0.25, 0.5, 0.75, 1.25, 1.5)  # square roots of other energies, over the run's
CURVE_HALVINGS: Final = 60
PUSHED: Final = f"after a push of {PUSH:g} rad/s"
FAINTEST: Final = 1e-8  # of the largest error: smaller ones are drawn at the lower edge


def _in_unit(name: str, values: Any) -> Array:
    """Values of a quantity in the unit in which it is shown."""
    return QUANTITIES[name].shown[1] * np.asarray(values)


def _draw_against(ax: Axes, run: DrawnRun, x: str, y: str, looks: Looks) -> Line2D:
    """Draw one quantity of a run against another, with its events."""
    for name in (x, y):
        if not run.follows(name):
            raise Impossible([(name, "not followed by this trajectory")])
    across, up = (_in_unit(name, run.values(name)) for name in (x, y))
    path = line(ax, across, up, looks, color=style.PATH, lw=1.0)
    if hasattr(run.events, y):
        places = [_in_unit(name, getattr(run.events, name)) for name in (x, y)]
        run.mark_events(ax, np.column_stack(places))
    ax.set(xlabel=QUANTITIES[x].heading, ylabel=QUANTITIES[y].heading)
    return path


# --- the angles: against time, and the tilt against the precession (SICM, figures 2.5 to 2.8) ---


def loop(ax: Axes, run: DrawnRun, **looks: Any) -> Axes:
    """Draw theta against phi, upright: where the axis stands higher, so does the line.

    The dot is the start.

    Raises
    ------
    Impossible
        The trajectory did not follow phi; `over_time` draws theta.
    """
    path = _draw_against(ax, run, "phi", "theta", looks)
    ax.plot(*np.asarray(path.get_xydata())[0], "o", color=path.get_color(), ms=3, zorder=4)
    return _set_upright(ax, run)


def over_time(name: str, ax: Axes, run: DrawnRun, /, **looks: Any) -> Axes:
    """Draw an angle or a rate against time; theta upright, of a still top after a push too.

    Raises
    ------
    Impossible
        The trajectory did not follow it.
    """
    path = _draw_against(ax, run, "t", name, looks)
    if name not in ANGLES:
        _cut_peaks(ax, np.asarray(path.get_ydata()))
    if name != "theta":
        return ax
    if pushed := push(run.motion):
        tilt = _in_unit("theta", pushed.at(run.path.t).theta)
        ax.plot(path.get_xdata(), tilt, "--", color=style.OTHER, lw=1.0, label=PUSHED)
    return _set_upright(ax, run)


def _set_upright(ax: Axes, run: DrawnRun) -> Axes:
    """Let tilt grow downwards, give a constant one a scale, and title a run that is cut."""
    if not ax.yaxis_inverted():  # by an earlier picture
        ax.invert_yaxis()
    (low, high), unit = ax.dataLim.intervaly, QUANTITIES["theta"].shown[1]
    if high - low < CONSTANT * unit:
        ax.set_ylim(high + 0.01 * unit, low - 0.01 * unit, auto=None)
    if run.shown != run.end:
        t = QUANTITIES["t"]
        ends = t.with_unit(run.shown, form=".4g"), t.with_unit(run.end, form=".6g")
        add_title(ax, f"the first {' of '.join(ends)}")
    return ax


def _cut_peaks(ax: Axes, values: Array) -> None:
    """Limit the scale to the usual range where peaks near a pole dwarf it, with a title."""
    known = values[np.isfinite(values)]
    low, high = np.percentile(known, (1.0, 99.0)) if known.size else (0.0, 0.0)
    if high > low and PEAK * (high - low) < np.ptp(known):
        ax.set_ylim(3 * low - 2 * high, 3 * high - 2 * low)
        add_title(ax, "peaks near a pole are cut off", loc="right")


# --- the axis on the unit sphere ---------------------------------------------------------------

_VIEWS: Final[WeakKeyDictionary[Axes, View]] = WeakKeyDictionary()
"""The view of the sphere on axes: another path there has the same view."""


def axis_on_sphere(ax: Axes, run: DrawnRun, **looks: Any) -> Axes:
    """Draw the path of the symmetry axis on the unit sphere, seen from far away.

    A path that keeps near the vertical is seen from straight above (or below), and the view
    closes in on it; any other from 25 degrees above or below the horizon, on the side where it
    mostly is (aside, where that sees it edge-on), and paler where it runs behind. The dot is the
    start. Of a top that rests, sleeps or hangs the path is the one that it takes when touched.
    """
    path, colour, words = run.path.axis, style.PATH, ""
    if pushed := push(run.motion):
        time = MOST_DRAWN_PERIODS * pushed.period if pushed.period else 2 * STEADY_TURN_S
        path, colour, words = axis_path(pushed, time), style.OTHER, f",\n{PUSHED}"
    view = _VIEWS[ax] = _VIEWS[ax].widen(path) if ax in _VIEWS else View.of(path)
    view.draw_graticule(ax)
    view.draw_path(ax, path, colour, **looks)
    run.mark_events(ax, view.project(run.events.axis)[0])
    view.frame(ax)
    return add_title(ax, f"the axis on the unit sphere,\n{view.words}{words}")


# --- the tilt by itself: its effective potential, and its phase plane ---------------------------


def effective_potential(ax: Axes, run: DrawnRun, **looks: Any) -> Axes:
    """Draw V_eff(theta) - p_psi^2/2C [J] with E', the tilts it allows, and the turning points."""
    motion = run.motion
    V, A, E_prime = Potential(motion), float(motion.top.A), float(motion.constants.E_prime)
    tilts, floor, level = drawn_part(motion, V)
    theta, label = np.linspace(*tilts, 801), "V$_{eff}$ − $p_ψ^2/2C$"
    line(ax, _in_unit("theta", theta), A * V(theta), looks, color=style.PATH, lw=1.4, label=label)
    ax.axhline(E_prime, color=style.OTHER, lw=1.0, ls="--", label=new_label(ax, "energy E′"))
    ends = motion.theta_min, motion.theta_max
    allowed = np.linspace(*ends, 401)
    below = np.minimum(A * V(allowed), E_prime)
    ax.fill_between(_in_unit("theta", allowed), below, E_prime, color=style.PATH, alpha=0.15, lw=0)
    if motion.nutates:
        for name, tilt in zip(("theta_min", "theta_max"), ends, strict=True):
            run.mark(ax, name, _in_unit("theta", tilt), E_prime)
    else:
        _mark_start(ax, motion.theta_min, E_prime, {})
    if height := A * POTENTIAL_HEIGHT * (level - floor):
        margin = 0.06 * height
        shown = [A * floor - margin, max(A * floor + height, E_prime) + margin]
        if not ax.get_autoscaley_on():  # another potential is drawn there
            shown += ax.get_ylim()
        ax.set_ylim(min(shown), max(shown))
    ax.set(xlabel=QUANTITIES["theta"].heading, ylabel="energy without that of the spin [J]")
    return ax


def _mark_start(ax: Axes, tilt: Any, y: Any, looks: Looks) -> None:
    """Mark the start by a dot."""
    line(ax, _in_unit("theta", tilt), y, looks, marker="o", color=style.BLACK, ms=4, ls="none",
         label=new_label(ax, "start"), zorder=4)  # fmt: skip


def phase_plane(ax: Axes, run: DrawnRun, **looks: Any) -> Axes:
    """Draw curves of constant energy in the plane of theta and thetadot.

    All of them have the momenta p_phi and p_psi of the scene; its own curve is the heavy one. The
    separatrix, where there is one, is dashed. The dot is the start. Keywords are those of its own
    curve, or of the dot where the tilt is constant.
    """
    motion, V = run.motion, Potential(run.motion)
    tilts, floor, level = drawn_part(motion, V)
    for k, amplitude in enumerate(FAMILY if level > floor else ()):
        name, other = "" if k else "other energies", floor + amplitude**2 * (level - floor)
        _energy_curve(ax, V, other, tilts, {}, color=style.FAINT, lw=0.8, label=new_label(ax, name))
    own = motion.nutates
    if own:
        _energy_curve(ax, V, _energy(motion), (motion.theta_min, motion.theta_max), looks,
                      color=style.PATH, lw=1.8, label="the motion")  # fmt: skip
    along = motion.kind is Kind.SEPARATRIX
    if ends := V.separatrix:
        label = "separatrix, and the motion" if along else "separatrix"
        _energy_curve(ax, V, abs(V.g), ends, looks if along else {}, color=style.OTHER, lw=1.2,
                      ls="--", label=label)  # fmt: skip
    rate = _in_unit("thetadot", run.path.thetadot[:1])
    _mark_start(ax, run.path.theta[:1], rate, {} if own or along else looks)
    ax.axhline(0.0, color=style.FAINT, lw=0.5, zorder=0)
    ax.set(xlabel=QUANTITIES["theta"].heading, ylabel=QUANTITIES["thetadot"].heading)
    return ax


def _energy_curve(
    ax: Axes, V: Potential, energy: float, tilts: tuple[float, float], looks: Looks, **ours: Any
) -> None:
    """Draw both branches of ½ θ̇² + V = energy, within two tilts on either side of the curve."""
    across = np.linspace(*tilts, CURVE_POINTS)
    lowest = across[V(across).argmin()]
    inside, outside = np.full(2, lowest), np.array(tilts)
    for _ in range(CURVE_HALVINGS):  # bisection for the turning points, if they are inside
        middle = (inside + outside) / 2
        beyond = V(middle) > energy
        inside, outside = np.where(beyond, inside, middle), np.where(beyond, middle, outside)
    low, high = outside
    angle = np.linspace(0.0, np.pi, 401)
    theta = low + (high - low) * np.sin(angle / 2) ** 2  # densest where the curve is steep
    speed = _in_unit("thetadot", np.sqrt(2 * np.maximum(energy - V(theta), 0.0)))
    theta = _in_unit("theta", theta)
    x, y = np.concatenate((theta, [np.nan], theta)), np.concatenate((speed, [np.nan], -speed))
    line(ax, x, y, looks, **ours)


def _energy(motion: Motion) -> float:
    """E'/A [1/s²]."""
    return float(motion.constants.E_prime) / float(motion.top.A)


def drawn_part(motion: Motion, V: Potential) -> tuple[tuple[float, float], float, float]:
    """The two tilts [rad] that the picture of a potential spans, the least V, and the shown energy.

    The energy [1/s²] is that of the motion, or of the separatrix if that is larger; where the tilt
    is constant, it is chosen to show a third of the way to the nearer pole.
    """
    low, high, level = motion.theta_min, motion.theta_max, _energy(motion)
    if ends := V.separatrix:
        low, high, level = min(low, ends[0]), max(high, ends[1]), max(level, abs(V.g))
    rests = high - low < UNSEEN  # V has no digits left between such tilts
    room = max(min(low, np.pi - high), 0.5) / 3 if rests else high - low
    theta = np.linspace(max(low - 2 * room, 0.0), min(high + 2 * room, np.pi), CURVE_POINTS)
    heights = V(theta)
    floor = float(heights.min())
    if rests:
        beside = float(V(low + room if low < np.pi / 2 else high - room))
        level = floor + (beside - floor) / POTENTIAL_HEIGHT
    shown = theta[heights <= floor + POTENTIAL_HEIGHT * (level - floor)]
    return (float(shown[0]), float(shown[-1])), floor, level


# --- the error against the closed form ---------------------------------------------------------


def errors(ax: Axes, run: DrawnRun, **looks: Any) -> Axes:
    """Draw |run - closed form| of a trajectory against time [s], logarithmic.

    The marks are samples, the lines the largest error so far. A sample with no error at all, or
    with less than a hundred-millionth of the largest, is drawn on the lower edge.
    """
    from heavytop.run.verify import deviations

    ax.set(xlabel=QUANTITIES["t"].heading, ylabel="|run − closed form|")
    try:
        found = {name: _in_unit(name, x) for name, x in deviations(run.trajectory).items()}
    except NoClosedForm as reason:
        ax.text(0.5, 0.5, str(reason), transform=ax.transAxes, ha="center", wrap=True)
        return ax
    time = found.pop("t")
    every = np.concatenate([*found.values()])
    positive = every[every > 0] if (every > 0).any() else np.array([np.finfo(float).eps])
    least = positive[positive >= FAINTEST * positive.max()].min()
    floor = 10.0 ** np.floor(np.log10(least) - 0.7)
    looks_of = zip(style.COLOURS, style.MARKERS, strict=False)
    for (name, error), (colour, marker) in zip(found.items(), looks_of, strict=False):
        so_far = np.fmax.accumulate(error)
        of = QUANTITIES[name]
        most = of.with_unit(so_far[-1] / of.shown[1], form=".1e")
        size = f"at most {most}" if so_far[-1] else "none"
        ax.plot(time, np.maximum(error, floor), marker, color=colour, ms=1.8, alpha=0.5, lw=0)
        line(ax, time, np.where(so_far > floor, so_far, np.nan), looks, color=colour, lw=1.2,
             label=f"{of.symbol}: {size}")  # fmt: skip
    ax.set_yscale("log")
    ax.set_ylim(bottom=min(floor, ax.dataLim.ymin), auto=None)
    ax.annotate("zero, or smaller", (0, floor), (4, 4), ("axes fraction", "data"),
                "offset points", fontsize="small", color="#666666")  # fmt: skip
    return ax


# --- the pictures of a run: a new one is a function above, and a row here -------------------------


class RunPicture(NamedTuple):
    """A picture of a run.

    Attributes
    ----------
    draw : callable
        The function that draws a run on axes.
    integrated : bool
        Whether it needs an integrated run.
    """

    draw: Callable[..., Axes]
    integrated: bool = False


PICTURES: Final = {
    "loop": RunPicture(loop),
    "sphere": RunPicture(axis_on_sphere),
    **{name: RunPicture(partial(over_time, name)) for name in (*ANGLES, *RATES)},
    "potential": RunPicture(effective_potential),
    "phase": RunPicture(phase_plane),
    "errors": RunPicture(errors, integrated=True),
}
"""The pictures by the names that `plot` has for them; the first is the default."""


def pictures_of(run: DrawnRun) -> dict[str, RunPicture]:
    """The pictures that a run has; quantities computed from others are drawn over time too."""
    integrated = run.trajectory is not None
    follow = [name for name in derived(run.motion.top) if not QUANTITIES[name].parts]
    known = PICTURES | {name: RunPicture(partial(over_time, name)) for name in follow}
    return {name: row for name, row in known.items() if integrated or not row.integrated}


def run_figures(run: Trajectory | SceneMotion) -> Iterator[tuple[str, str, Callable[[], Figure]]]:
    """Yield name, title and drawing function of each figure of a run."""
    drawn = DrawnRun.of(run)
    for name, (title, panels) in FIGURES.items():
        if pictures_of(drawn).keys() >= {*panels}:
            yield name, title, partial(run_figure, name, drawn)


def run_figure(name: str, run: Any) -> Figure:
    """One of `FIGURES` of a run; for a top that stands still with tilt against time, not phi."""
    run = DrawnRun.of(run)
    _, names = FIGURES[name]
    panels = [
        "theta" if panel == "loop" and run.has_no_loop else panel
        for panel in names
        if panel != "phi" or run.follows("phi")
    ]
    count, beside = len(panels), "sphere" in panels
    grid: dict[str, Any] = {"nrows": count, "sharex": True}
    size = (7.2, 4.8) if count == 1 else (8.0, 2.3 * count)
    if beside:
        grid, size = {"ncols": count, "width_ratios": (1.15, 1.0)}, (9.6, 5.2)
    title = style.literal(run.title, 80)
    with style.sheet(title, size, 4 if count > 1 else 2, **grid) as (figure, axes):
        for ax, panel in zip(axes.ravel(), panels, strict=True):
            PICTURES[panel].draw(ax, run)
            ax.label_outer()
    return figure
