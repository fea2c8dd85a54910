"""Pictures of a trajectory: each is a function of the axes it draws on, and computes nothing.

Each takes a motion too, of which it draws some nutations of the closed form; keywords of matplotlib
for its line, which go before its own; and returns the axes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache, partial
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Final
from weakref import WeakKeyDictionary

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from heavytop.analytic.motion import Motion
from heavytop.analytic.potential import Potential
from heavytop.classification import Kind
from heavytop.errors import NoClosedForm
from heavytop.plots import style
from heavytop.plots.sphere import NUTATIONS, PUSH, View, axis_path, touched
from heavytop.plots.style import Array, in_degrees, line, titled
from heavytop.results.run import PICTURES
from heavytop.scene.arguments import expect, wrong_type
from heavytop.scene.quantities import ANGLES, QUANTITIES, RATES

if TYPE_CHECKING:
    from heavytop.integration.outputs import Sample
    from heavytop.run.exact import SceneMotion
    from heavytop.run.trajectory import Trajectory

Looks = Mapping[str, Any]  # keywords of matplotlib
MOST_DRAWN_PERIODS: Final = 12  # more would only blacken the paper
CURVE_POINTS: Final = 4001
CONSTANT: Final = 1e-9  # a range below this [rad] is rounding, and not worth a scale of its own
PEAK: Final = 20.0  # times the usual range: beyond, a peak would leave nothing else to see
# how high the potential is drawn, over the energy that has to be seen
POTENTIAL_HEIGHT: Final = 1.6**2
FAMILY: Final = (0.25, 0.5, 0.75, 1.25, 1.5)  # roots of energies above the least, beside the run's
MARK: Final = "event"  # what the marks of events are known by
PUSHED: Final = f"after a push of {PUSH:g} rad/s"
TOUCHED_S: Final = 2.0  # of a top that nothing moves, where it does not nutate when touched

ERROR_STYLES: Final = {
    "theta": (style.BLUE, "o"),
    "phi": (style.ORANGE, "s"),
    "psi": (style.GREEN, "^"),
    "axis": (style.PURPLE, "D"),
}


# --- the exact motion, seen as a run -------------------------------------------------------

STEADY_SPAN_S: Final = 2.0  # of a motion that has no period
_NOTHING: Final = SimpleNamespace(
    kind=(), **dict.fromkeys(("t", "theta", "phi"), ()), axis=np.empty((0, 3))
)


@dataclass(frozen=True, eq=False)
class ExactRun:
    """The exact motion, seen as a run to its end, with the events of a run or without."""

    motion: Motion
    scene: Any
    end: float
    events: Any = field(default_factory=lambda: _NOTHING)

    @classmethod
    def of(cls, motion: Motion, periods: int) -> ExactRun:
        """That of some nutations of a motion."""
        moving = touched(motion) or motion
        scene = SimpleNamespace(title="", name=str(motion.kind), top=motion.top)
        return cls(motion, scene, periods * moving.period if moving.period else STEADY_SPAN_S)

    @property
    def orbit(self) -> ExactRun:
        """What has its end."""
        return self

    def __call__(self, t: Any) -> Any:
        """The motion at some times [s]."""
        return self.motion.at(t)

    @property
    def samples(self) -> Any:
        """The motion at its start."""
        return self.motion.at(np.zeros(1))


# --- the part of a run that is drawn -----------------------------------------------------------


def run_of(thing: Trajectory | Motion) -> Any:
    """Return a trajectory, or the exact motion as one."""
    if isinstance(thing, ExactRun):
        return thing
    if isinstance(thing, Motion):
        return ExactRun.of(thing, NUTATIONS)
    from heavytop.run.trajectory import Trajectory  # which takes its time to import

    if not isinstance(thing, Trajectory):
        raise wrong_type("trajectory", "a Trajectory (propagate gives one) or a Motion", thing)
    return thing


@lru_cache(maxsize=1)  # 3 s with 30 digits, which each of the figures would take for itself
def _path(run: Any) -> tuple[Sample, float]:
    """The motion at the times drawn, and the last of them [s]."""
    last = last_shown(run)
    return run(np.linspace(0.0, last, CURVE_POINTS)), last


def last_shown(trajectory: Trajectory) -> float:
    """The last of the times drawn [s]."""
    end, events = float(trajectory.orbit.end), trajectory.events
    lowest = [t for kind, t in zip(events.kind, events.t, strict=True) if kind == "theta_max"]
    if len(lowest) > MOST_DRAWN_PERIODS:
        return float(lowest[MOST_DRAWN_PERIODS])
    period = float(trajectory.motion.period or np.inf) if not lowest else np.inf
    return float(np.copysign(min(abs(end), MOST_DRAWN_PERIODS * period), end))


def _mark_events(ax: Axes, run: Any, shown: float, places: Array) -> None:
    """Mark the events up to the time `shown` at the given places, shape (k, 2)."""
    kinds = np.asarray(run.events.kind, dtype=object)
    drawn = np.abs(np.asarray(run.events.t)) <= abs(shown)
    for kind in style.EVENT_STYLES:
        if len(here := places[drawn & (kinds == kind)]):
            _mark(ax, kind, here[:, 0], here[:, 1])


def _mark(ax: Axes, kind: str, x: Any, y: Any) -> None:
    label, colour, marker = style.EVENT_STYLES[kind]
    looks: dict[str, Any] = {"ms": 5, "mfc": "white", "ls": "none", "zorder": 3, "gid": MARK}
    ax.plot(x, y, marker, label=style.once(ax, label), color=colour, **looks)


def _in_unit(name: str, values: Any) -> Array:
    """A quantity in the unit in which it is shown."""
    return QUANTITIES[name].shown[1] * np.asarray(values)


def _against(ax: Axes, run: Any, x: str, y: str, looks: Looks) -> Line2D:
    """Draw one quantity of a run against another, with its events."""
    drawn, shown = _path(run)
    for name in {x, y}.intersection(ANGLES):
        if np.isnan(getattr(drawn, name)).all():
            raise ValueError(f"{name}: not followed by this trajectory")
    across, up = (_in_unit(name, getattr(drawn, name)) for name in (x, y))
    path = line(ax, across, up, looks, color=style.PATH, lw=1.0)
    if hasattr(run.events, y):
        columns = [_in_unit(name, getattr(run.events, name)) for name in (x, y)]
        _mark_events(ax, run, shown, np.column_stack(columns))
    ax.set(xlabel=QUANTITIES[x].heading, ylabel=QUANTITIES[y].heading)
    return path


# --- the angles: against time, and the tilt against the precession (SICM, figures 2.5 to 2.8) ---


def loop(ax: Axes, trajectory: Trajectory | Motion, **looks: Any) -> Axes:
    """Draw theta against phi, upright: where the axis stands higher, so does the line.

    The dot is the start.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    trajectory : Trajectory or Motion
    **looks
        Keywords of the line; the other figures take them too.

    Raises
    ------
    WrongType
        It is neither; the other figures say the same.
    ValueError
        The trajectory did not follow phi; `over_time` draws theta.
    """
    run = run_of(trajectory)
    path = _against(ax, run, "phi", "theta", looks)
    first = np.asarray(path.get_xydata())[0]
    ax.plot(*first, "o", color=path.get_color(), ms=3, zorder=4)
    return _upright(ax, run)


def over_time(
    ax: Axes, trajectory: Trajectory | Motion, name: str = "theta", /, **looks: Any
) -> Axes:
    """Draw an angle or a rate against time; theta upright, of a still top as it goes when touched.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    trajectory : Trajectory or Motion
    name : str
        Such as phi or psidot: the top spins faster when it is more vertical.

    Raises
    ------
    ValueError
        The trajectory did not follow it.
    """
    run = run_of(trajectory)
    values = _against(ax, run, "t", name, looks).get_ydata()
    if name not in ANGLES:
        _cut_peaks(ax, np.asarray(values))
    if name != "theta":
        return ax
    if neighbour := touched(run.motion):
        t = _path(run)[0].t
        look: dict[str, Any] = {"color": style.OTHER, "lw": 1.0, "label": PUSHED}
        ax.plot(_in_unit("t", t), _in_unit("theta", neighbour.at(t).theta), "--", **look)
    return _upright(ax, run)


def _upright(ax: Axes, run: Any) -> Axes:
    """Let tilt grow downwards, give a constant one a scale, and say where a run is cut."""
    if not ax.yaxis_inverted():  # by what was drawn there before
        ax.invert_yaxis()
    (low, high), unit = ax.dataLim.intervaly, QUANTITIES["theta"].shown[1]
    if high - low < CONSTANT * unit:
        ax.set_ylim(high + 0.01 * unit, low - 0.01 * unit, auto=None)
    shown, end = _path(run)[1], float(run.orbit.end)
    if shown != end:
        titled(ax, f"the first {shown:.4g} s of {end:.6g} s")
    return ax


def _cut_peaks(ax: Axes, values: Array) -> None:
    """Show the usual range where the passes near a pole would dwarf it, and say so."""
    known = values[np.isfinite(values)]
    low, high = np.percentile(known, (1.0, 99.0)) if known.size else (0.0, 0.0)
    usual = float(high - low)
    if usual and PEAK * usual < float(np.ptp(known)):
        ax.set_ylim(low - 2 * usual, high + 2 * usual)
        titled(ax, "peaks near a pole are cut off", loc="right")


# --- the axis on the unit sphere ---------------------------------------------------------------

_VIEWS: Final[WeakKeyDictionary[Axes, View]] = WeakKeyDictionary()
"""How the sphere is seen on axes: another path there is seen in the same way."""


def axis_on_sphere(ax: Axes, trajectory: Trajectory | Motion, **looks: Any) -> Axes:
    """Draw the path of the symmetry axis on the unit sphere, seen from far away.

    A path that keeps near the vertical is seen from straight above (or below), and the view
    closes in on it; any other from 25 degrees above or below the horizon, on the side where it
    mostly is, and paler where it runs behind. The dot is the start. Of a top that rests, sleeps or
    hangs the path is the one that it takes when it is touched.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    trajectory : Trajectory or Motion
    """
    run = run_of(trajectory)
    drawn, shown = _path(run)
    path, colour, words = drawn.axis, style.PATH, ""
    if neighbour := touched(run.motion):
        time = MOST_DRAWN_PERIODS * neighbour.period if neighbour.period else TOUCHED_S
        path, colour, words = axis_path(neighbour, time), style.OTHER, f",\n{PUSHED}"
    view = _VIEWS[ax] = _VIEWS[ax].reaching(path) if ax in _VIEWS else View.of(path)
    view.draw_graticule(ax)
    view.draw_path(ax, path, colour, **looks)
    _mark_events(ax, run, shown, view.project(run.events.axis)[0])
    view.frame(ax)
    return titled(ax, f"the axis on the unit sphere,\n{view.words}{words}")


# --- the tilt by itself: its effective potential, and its phase plane ---------------------------


def effective_potential(ax: Axes, trajectory: Trajectory | Motion, **looks: Any) -> Axes:
    """Draw V_eff(theta) - p_psi^2/2C [J] with E', the tilts it allows, and the turning points.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    trajectory : Trajectory or Motion
    """
    run = run_of(trajectory)
    V = Potential(run.motion)
    A, E_prime = float(run.scene.top.A), float(run.motion.constants.E_prime)
    tilts, floor, level = drawn_part(run.motion, V)
    theta, label = np.linspace(*tilts, 801), "V$_{eff}$ − $p_ψ^2/2C$"
    line(ax, _in_unit("theta", theta), A * V(theta), looks, color=style.PATH, lw=1.4, label=label)
    ax.axhline(E_prime, color=style.OTHER, lw=1.0, ls="--", label=style.once(ax, "energy E′"))
    _allowed(ax, V, A, E_prime, run.motion)
    height = A * POTENTIAL_HEIGHT * (level - floor)
    if height:
        margin = 0.06 * height
        shown = [A * floor - margin, max(A * floor + height, E_prime) + margin]
        if not ax.get_autoscaley_on():  # another is drawn there
            shown += ax.get_ylim()
        ax.set_ylim(min(shown), max(shown))
    ax.set(xlabel=QUANTITIES["theta"].heading, ylabel="energy without that of the spin [J]")
    return ax


def _allowed(ax: Axes, V: Potential, A: float, E_prime: float, motion: Motion) -> None:
    """Fill between potential and energy, and mark where they meet, or the start."""
    ends = (motion.theta_min, motion.theta_max)
    if ends[1] > ends[0]:
        theta = np.linspace(*ends, 401)
        across, below = _in_unit("theta", theta), np.minimum(A * V(theta), E_prime)
        ax.fill_between(across, below, E_prime, color=style.PATH, alpha=0.15, lw=0)
    if motion.nutates:
        for name, tilt in zip(("theta_min", "theta_max"), ends, strict=True):
            _mark(ax, name, _in_unit("theta", tilt), E_prime)
    else:
        _start(ax, motion.theta_min, E_prime, {})


def _start(ax: Axes, tilt: Any, y: Any, looks: Looks) -> None:
    line(ax, _in_unit("theta", tilt), y, looks, marker="o", color=style.BLACK, ms=4, ls="none",
         label=style.once(ax, "start"), zorder=4)  # fmt: skip


def phase_plane(ax: Axes, trajectory: Trajectory | Motion, **looks: Any) -> Axes:
    """Draw curves of constant energy in the plane of theta and thetadot.

    All of them have the momenta p_phi and p_psi of the scene; its own curve is the heavy one. The
    separatrix, where there is one, is dashed. The dot is the start. Keywords are those of its own
    curve, or of the dot where the tilt is constant.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    trajectory : Trajectory or Motion
    """
    run = run_of(trajectory)
    motion = run.motion
    V = Potential(motion)
    tilts, floor, level = drawn_part(motion, V)
    for k, amplitude in enumerate(FAMILY if level > floor else ()):
        name, other = "" if k else "other energies", floor + amplitude**2 * (level - floor)
        _energy_curve(ax, V, other, tilts, {}, color=style.FAINT, lw=0.8,
                      label=style.once(ax, name))  # fmt: skip
    own = motion.nutates
    if own:
        _energy_curve(ax, V, _energy(motion), (motion.theta_min, motion.theta_max), looks,
                      color=style.PATH, lw=1.8, label="the motion")  # fmt: skip
    along = motion.kind is Kind.SEPARATRIX
    if ends := V.separatrix:
        label = "separatrix, and the motion" if along else "separatrix"
        _energy_curve(ax, V, abs(V.g), ends, looks if along else {}, color=style.OTHER, lw=1.2,
                      ls="--", label=label)  # fmt: skip
    start = run.samples
    rate = _in_unit("thetadot", start.thetadot[:1])
    _start(ax, start.theta[:1], rate, {} if own or along else looks)
    ax.axhline(0.0, color=style.FAINT, lw=0.5, zorder=0)
    ax.set(xlabel=QUANTITIES["theta"].heading, ylabel=QUANTITIES["thetadot"].heading)
    return ax


def _energy_curve(
    ax: Axes, V: Potential, energy: float, tilts: tuple[float, float], looks: Looks, **ours: Any
) -> None:
    """Draw both branches of ½ θ̇² + V = energy between two tilts, which may be further out."""
    (low, high), angle = tilts, np.linspace(0.0, np.pi, 401)
    theta = low + (high - low) * np.sin(angle / 2) ** 2  # densest where a curve may be steep
    speed = np.sqrt(2 * np.maximum(energy - V(theta), 0.0))
    moves = np.pad(speed > 0, 1)
    near = moves[:-2] | moves[1:-1] | moves[2:]  # with the points that close it at its ends
    theta, speed = _in_unit("theta", theta[near]), _in_unit("thetadot", speed[near])
    x, y = np.concatenate((theta, [np.nan], theta)), np.concatenate((speed, [np.nan], -speed))
    line(ax, x, y, looks, **ours)


def _energy(motion: Motion) -> float:
    """E'/A [1/s²]."""
    return float(motion.constants.E_prime) / float(motion.top.A)


def drawn_part(motion: Motion, V: Potential) -> tuple[tuple[float, float], float, float]:
    """Two tilts [rad] that the picture of a potential spans, its least V, and an energy to be seen.

    The energy [1/s²] is that of the motion, or of the separatrix if that is larger; where the tilt
    rests, what carries it a third of the way to the nearer pole.
    """
    low, high, level = motion.theta_min, motion.theta_max, _energy(motion)
    if ends := V.separatrix:
        low, high, level = min(low, ends[0]), max(high, ends[1]), max(level, abs(V.g))
    rests = high - low < CONSTANT
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


def errors(ax: Axes, trajectory: Trajectory, **looks: Any) -> Axes:
    """Draw |run - closed form| against time [s], logarithmic.

    The marks are samples, the lines the largest error so far. A sample with no error at all, or
    with less than a hundred-millionth of the largest, is drawn on the lower edge.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    trajectory : Trajectory
    """
    from heavytop.run.trajectory import Trajectory
    from heavytop.run.verify import deviations

    expect("trajectory", trajectory, Trajectory, "propagate gives one")
    try:
        _draw_errors(ax, looks, **deviations(trajectory))
    except NoClosedForm as reason:
        ax.text(0.5, 0.5, str(reason), transform=ax.transAxes, ha="center", wrap=True)
    ax.set(xlabel=QUANTITIES["t"].heading, ylabel="|run − closed form| [rad]")
    return ax


FAINTEST: Final = 1e-8  # of the largest error: smaller ones stand at the lower edge


def _draw_errors(ax: Axes, looks: Looks, t: Array, **found: Array) -> None:
    every = np.concatenate(list(found.values()))
    positive = every[every > 0] if (every > 0).any() else np.array([np.finfo(float).eps])
    smallest, shown = float(positive.min()), FAINTEST * float(positive.max())
    edge = "exactly zero" if smallest >= shown else "zero, or smaller"
    floor = 10.0 ** np.floor(np.log10(max(smallest, shown)) - 0.7)
    for name, error in found.items():
        label, (colour, marker) = QUANTITIES[name].symbol, ERROR_STYLES[name]
        largest, time = np.fmax.accumulate(error), _in_unit("t", t)
        size = f"at most {largest[-1]:.1e}" if largest[-1] else "none"
        ax.plot(time, np.maximum(error, floor), marker, color=colour, ms=1.8, alpha=0.5, lw=0)
        so_far = np.where(largest > floor, largest, np.nan)
        line(ax, time, so_far, looks, color=colour, lw=1.2, label=f"{label}: {size}")
    ax.set_yscale("log")
    ax.set_ylim(bottom=min(floor, ax.dataLim.ymin), auto=None)
    ax.annotate(edge, (0, floor), (4, 4), ("axes fraction", "data"), "offset points",
                fontsize="small", color="#666666")  # fmt: skip


# --- the figures of a run, each on a page of its own --------------------------------------------

DRAW: Final[Mapping[str, Callable[..., Axes]]] = {
    "loop": loop,
    "sphere": axis_on_sphere,
    **{
        name: lambda ax, run, name=name, **looks: over_time(ax, run, name, **looks)
        for name in (*ANGLES, *RATES)
    },
    "potential": effective_potential,
    "phase": phase_plane,
    "errors": errors,
}
"""What draws a run on axes, by the names that `plot` has for it."""

PANELS: Final = {"overview": ("loop", "sphere"), "angles": ("theta", "phi", "psidot")}
"""What a figure of a run shows, where that is not one picture of its own name."""
UNSEEN: Final = 1e-6  # rad, in a picture


def as_drawn(run: Trajectory | SceneMotion) -> Any:
    """A run as pictures show it: where nothing was integrated the exact motion; of one in many
    digits, which takes long to draw, the same if no eye could tell them apart.
    """
    from heavytop.run.exact import SceneMotion  # which takes its time to import

    if isinstance(run, SceneMotion):
        return ExactRun(run.motion, run.scene, run.span)
    if run.in_doubles:
        return run
    ours, theirs = run.samples.axis, run.motion.at(run.t).axis
    exact = ExactRun(run.motion, run.scene, run.orbit.end, run.events)
    return exact if np.allclose(ours, theirs, UNSEEN, UNSEEN, equal_nan=True) else run


def run_figures(run: Trajectory | SceneMotion) -> Iterator[tuple[str, Callable[[], Figure]]]:
    """Yield the names of the figures of a run, as `PICTURES` has them, and what draws each."""
    shown = as_drawn(run)
    for name in PICTURES:
        if name != "errors":
            yield name, partial(run_figure, name, shown)
        elif run.source == "integrated":
            yield name, partial(run_figure, name, run)


def run_figure(name: str, run: Any) -> Figure:
    """The figure of a run of this name; of a top that stands still tilt against time, not phi.

    Parameters
    ----------
    name : str
        One of `heavytop.results.run.PICTURES`.
    run : Trajectory
        Or the exact motion, as `as_drawn` gives it.
    """
    run = run_of(run)
    followed = not np.isnan(run.samples.phi).all()
    panels = [
        "theta" if panel == "loop" and stands(run) else panel
        for panel in PANELS.get(name, (name,))
        if panel != "phi" or followed
    ]
    count, beside = len(panels), "sphere" in panels
    grid: dict[str, Any] = {"nrows": count, "sharex": True}
    size = (7.2, 4.8) if count == 1 else (8.0, 2.3 * count)
    if beside:
        grid, size = {"ncols": count, "width_ratios": (1.15, 1.0)}, (9.6, 5.2)
    title = style.title_of(run.scene)
    with style.sheet(title, size, 4 if count > 1 else 2, **grid) as (figure, axes):
        for ax, panel in zip(axes.ravel(), panels, strict=True):
            DRAW[panel](ax, run)
            ax.label_outer()
            in_degrees(ax)
    return figure


def stands(trajectory: Trajectory | Motion) -> bool:
    """Whether theta cannot be drawn against phi, which is not followed, or not worth it."""
    run = run_of(trajectory)
    return touched(run.motion) is not None or bool(np.isnan(run.samples.phi).all())
