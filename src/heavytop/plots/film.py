"""A top as a film: frames of the exact motion, as GIF, WebP or MP4.

Time is slowed so that the spin is seen. The same scene gives the same frames.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from io import BytesIO
from itertools import chain, pairwise
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from PIL import Image
from scipy.spatial.transform import Rotation

from heavytop.analytic.motion import Motion
from heavytop.errors import BadScene, Fault, MissingPackage, Refused, refuse
from heavytop.exact.pairs import Array
from heavytop.files import write_atomic
from heavytop.plots.drawn_run import Clip
from heavytop.plots.sphere import PUSH, View, circle, momentum_path
from heavytop.plots.style import EVENT_STYLES, PATH, STYLE, literal
from heavytop.scene import arguments
from heavytop.scene.arguments import Range, Reader, path_of, restrict
from heavytop.scene.quantities import QUANTITIES
from heavytop.scene.scene import Scene, expect_scene

SECONDS: Final = 10.0
PATH_POINTS: Final = 2001
GIF_COLOURS: Final = 256
MOST_PIXELS: Final = 5e8  # of all frames: 2 GB
DPI: Final = 72  # so that a point, in which lines are measured, is a pixel

SECTORS: Final = 36
MARKED_SECTORS: Final = SECTORS // 4  # a quarter of the body is orange, so that its spin is seen
STEM, STEM_REACH, SIZE, THICK = 0.03, 0.88, 0.62, 0.04  # of the body; the sphere has 1
BODY_COLOUR: Final = np.array([150, 166, 181])
PATCH: Final = np.array([236, 164, 30])
LIGHT: Final = np.array([-0.45, 0.62, 0.64])  # from where it comes: right, up, towards the eye
INK, FILM_FAINT, AHEAD_COLOUR, MOMENTUM = "#222222", "#9AA4AE", "#9CC3DB", "#882255"
LETTER_WIDTH: Final = 0.65  # of the font's height
WIDEST_RIM: Final = 4  # of the rims of the body
LEAN: Final = 0.05  # sin θ of the first tilt that the eye looks across
ASIDE: Final = 0.35  # rad from the direction straight across


def film(
    scene: Scene,
    path: str | os.PathLike[str],
    *,
    seconds: float | None = None,
    fps: float = 25.0,
    size: tuple[int, int] | str = "800x600",
    rounds: float | None = None,
    time: float | None = None,
    speed: float | None = None,
    follow: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Path:
    """Make a film of a top: body, trace of the axis and angular momentum.

    What is shown is the exact motion, from the start: as much of the scene's span as leaves the
    spin slow enough to be followed, but at least one nutation if the span has it. Of a top that
    rests, sleeps or hangs it is what it does after a push of 1 rad/s.

    Parameters
    ----------
    scene : Scene
        What spins, and how it starts.
    path : path
        The film; it ends in ``.gif``, ``.webp`` or ``.mp4``. One that is there is replaced.
    seconds : float, optional
        Length of the film [s], 0.1 to 600; by default 10, or what `speed` makes of the time.
    fps : float
        Frames in a second [1/s], 1 to 50; a GIF counts hundredths of a second.
    size : tuple of int, or str
        Width and height [pixels], 64 to 4096 each, or ``"800x600"``; an MP4 has even ones.
    rounds : float, optional
        How often the axis goes round the vertical while it is shown [1].
    time : float, optional
        How much of the motion is shown instead [s].
    speed : float, optional
        How much of it a second of film shows [s].
    follow : bool
        Whether the eye goes round with the mean precession.
    progress : callable, optional
        Called with the fraction done, after each frame.

    Returns
    -------
    Path
        Where it was written, whole or not at all.

    Raises
    ------
    BadScene
        Another ending of the path; a length, a rate or a size out of its range. Everything that
        is wrong is named.
    MissingPackage
        An MP4, and imageio-ffmpeg is not installed.
    OSError
        It cannot be written.
    WrongType
        `scene` is no Scene, `path` no path, or `progress` no function.

    Notes
    -----
    Accuracy: ``tests/plots/test_film.py`` finds the axis and the body of three frames where the
    closed form has them, to a pixel.

    Examples
    --------
    >>> import heavytop as ht, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     made = film(ht.load_scene("sicm-kicked"), f"{folder}/top.gif", seconds=1, size=(80, 64))
    ...     made.stat().st_size > 1000
    True
    """
    expect_scene(scene)
    arguments.check_callable("progress", progress)
    arguments.expect("follow", follow, bool)
    given = arguments.drop_none(seconds=seconds, rounds=rounds, time=time, speed=speed)
    known, wrong = arguments.parse_options(
        "film", given | {"path": path, "fps": fps, "size": size}, FILM_OPTIONS
    )
    refuse(wrong)
    place: Path = known["path"]
    (width, height), form, rate = known["size"], place.suffix.lower(), known["fps"]
    if form == ".mp4":
        width, height = 2 * (width // 2), 2 * (height // 2)
    motion = Motion(scene.top, scene.start)
    periods_s = float(scene.periods or 1) * (motion.period or 1)  # without a span: a nutation
    end = periods_s if scene.time is None else float(scene.time)
    clip = Clip.of(motion, end, SECONDS, **{name: known[name] for name in given})
    count = max(2, round(clip.seconds * rate))
    if form != ".mp4" and count * width * height > MOST_PIXELS:  # all frames are held
        rule = f"{count} frames are too many of this size: as an MP4, or smaller or shorter"
        raise BadScene((Fault("film", None, "size", f"{width}x{height}", rule),))
    shot = FilmScene(scene, clip, (width, height), follow, count)

    def frames() -> Iterator[Image.Image]:
        stage = shot.stage()
        for k in range(count):
            yield shot.frame(stage, k / (count - 1))
            if progress is not None:
                progress((k + 1) / count)

    write_atomic(place, lambda part: FILM_WRITERS[form](part, frames(), rate))
    return place


# --- the motion, and the view of it --------------------------------------------------------------


class FilmScene:
    """The motion that a film shows, at even times, and how it is drawn.

    Attributes
    ----------
    size : tuple of int
        Width and height of the picture [pixels].
    follow : bool
        Whether the eye goes round with the mean precession.
    record : Record
        The motion at the times of the path.
    momentum, rotation : numpy.ndarray, shapes (k, 3) and (k, 3, 3)
        The angular momentum over its largest size; from body to space.
    rims : numpy.ndarray, shape (rims, sectors, 3)
        The body, in its own frame.
    blur : list of str
        Sentences about what is too fast for so many frames.
    """

    def __init__(
        self,
        scene: Scene,
        clip: Clip,
        size: tuple[int, int],
        follow: bool = False,
        count: int = PATH_POINTS,
    ) -> None:
        self.scene, self.clip, self.size, self.follow = scene, clip, size, follow
        self.blur = clip.blur(count, PATH_POINTS)
        self.record: Any = clip.motion.at(np.linspace(0.0, clip.end, PATH_POINTS))
        self.momentum = momentum_path(scene.top, self.record)
        turned = Rotation.from_quat(self.record.quaternion, scalar_first=True)
        self.rotation = np.asarray(turned.as_matrix())
        self.rims = _rims(float(scene.top.C / scene.top.A), np.sign(float(scene.top.gMR)))

    @property
    def font(self) -> int:
        """The height of letters [pixels]."""
        return max(9, min(self.size) // 38)

    @property
    def titles(self) -> list[str]:
        """The lines of text of a frame: the scene, the speed of time, a push, what is too fast."""
        fit = int(self.size[0] / (LETTER_WIDTH * self.font))
        title = literal(self.scene.title or self.scene.name, fit)
        pushed = [f"pushed at {PUSH:g} rad/s; untouched it stays as it is"] * self.clip.pushed
        return [title, _pace(abs(self.clip.end) / self.clip.seconds), *pushed, *self.blur]

    def at(self, done: float) -> int:
        """The number of the time at a fraction of the film."""
        return round(done * (PATH_POINTS - 1))

    def view(self, done: float) -> View:
        """The view: across the first tilt, a little from above or below."""
        axis, motion = self.record.axis, self.clip.motion
        sine = np.hypot(axis[:, 0], axis[:, 1])
        x, y, _ = axis[np.argmax(sine > LEAN) if (sine > LEAN).any() else np.argmax(sine)]
        azimuth = math.atan2(-x, y) + ASIDE if sine.max() > 1e-3 else -math.pi / 2
        turned = motion.mean_angle_rates[0] * self.clip.end if self.follow else 0.0
        return View.from_side(azimuth + done * turned, -0.12 if axis[:, 2].mean() < -0.3 else 0.3)

    def stage(self) -> Figure:
        """A figure with axes for path, wheel and pivot, in the scale of all frames."""
        wheel = self.rims[WIDEST_RIM, ::9] @ self.rotation[::200].swapaxes(1, 2)
        points = np.vstack((np.zeros(3), self.record.axis[::10], wheel.reshape(-1, 3)))
        flat = np.concatenate([self.view(x).project(points)[0] for x in np.linspace(0, 1, 9)])
        low, high = flat.min(axis=0), flat.max(axis=0)
        size = np.array(self.size)
        half = size / 2 / min(size / (1.25 * np.maximum(high - low, 0.7)))
        (left, bottom), (right, top) = (low + high) / 2 - half, (low + high) / 2 + half
        figure = Figure(figsize=(size[0] / DPI, size[1] / DPI), dpi=DPI)
        ax = figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=(left, right), ylim=(bottom, top))
        ax.axis("off")
        return figure

    @mpl.rc_context(STYLE)
    def frame(self, figure: Figure, done: float) -> Image.Image:
        """The picture at a fraction of the film, drawn in the figure in place of the last one."""
        [ax] = figure.axes
        for shown in (*ax.lines, *ax.patches, *ax.collections, *ax.texts):
            shown.remove()
        now = self.at(done)
        self.draw(ax, self.view(done), now)
        time = QUANTITIES["t"].with_unit(self.record.t[now], form=".4g")
        words = "\n".join((*self.titles, f"t = {time}"))
        place: Any = {"xytext": (8, -6), "textcoords": "offset points", "va": "top"}
        ax.annotate(words, (0, 1), xycoords="axes fraction", color=INK, fontsize=self.font, **place)
        pixels = BytesIO()
        figure.savefig(pixels, format="rgba")
        return Image.frombytes("RGBA", self.size, pixels.getvalue()).convert("RGB")

    def draw(self, ax: Axes, view: View, now: int) -> None:
        """Draw the top as it is at one of the times."""
        unit, path, motion = min(self.size) / 600, self.record.axis, self.clip.motion

        def line(points: Array, colour: str, width: float, order: float) -> None:
            ax.plot(*view.project(points)[0].T, color=colour, lw=width * unit, zorder=order)

        ax.add_patch(Circle((0.0, 0.0), 1.0, fc="none", ec=FILM_FAINT, lw=unit, zorder=1))
        line(np.array([[0, 0, -1.0], [0, 0, 1.15]]), FILM_FAINT, 1, 1)
        for name in ("theta_max", "theta_min"):
            colour = EVENT_STYLES[name].colour
            view.draw_line(ax, circle(getattr(motion, name)), color=colour, lw=unit)
        view.draw_line(ax, path[now:], color=AHEAD_COLOUR, lw=1.2 * unit)
        view.draw_line(ax, path[: now + 1], color=PATH, lw=2.4 * unit)
        # the tip of the stem is in front of the body, or behind it
        order = 2.3 if path[now] @ view.towards < 0 else 2.7
        line(np.outer((STEM_REACH, 1.0), path[now]), INK, 2.5, order)
        ax.add_collection(_body(self.rims @ self.rotation[now].T, view), autolim=False)
        line(np.stack((np.zeros(3), self.momentum[now])), MOMENTUM, 2, 4)
        tip = view.project(self.momentum[now])[0]
        ax.plot(*tip, "o", color=MOMENTUM, ms=6 * unit, mew=0, zorder=4)


def _pace(pace: float) -> str:
    """The speed of time in words.

    >>> _pace(0.05), _pace(1.0), _pace(257.5)
    ('slowed 20 times', 'as fast as it is', '260 times as fast as it is')
    """
    if 0.95 < pace < 1.05:
        return "as fast as it is"
    times = f"{float(f'{max(pace, 1 / pace):.2g}'):g} times"
    return f"slowed {times}" if pace < 1 else f"{times} as fast as it is"


def _rims(ratio: float, side: float) -> Array:
    """The rims of the body: a wheel on a stem with the C/A of the top, on one side of the pivot.

    A thin wheel of radius r at height h has this C/A where r/h = 2 √(C/A) / √(2 − C/A).
    """
    angle = math.atan2(2 * math.sqrt(min(ratio, 2)), math.sqrt(max(2 - ratio, 0)))
    r, h = SIZE * max(math.sin(angle), 0.1), SIZE * math.cos(angle) * side
    foot = min(0, h - THICK)
    profile = np.array(
        [(0, foot), (STEM, foot), (STEM, h - THICK), (r / 2, h - THICK), (r, h - THICK / 2),
         (r, h + THICK / 2), (r / 2, h + THICK), (STEM, h + THICK),
         (STEM, STEM_REACH), (0, STEM_REACH)]
    )  # fmt: skip
    turn = 2 * np.pi * np.arange(SECTORS) / SECTORS
    radius, height = profile.T[..., None]
    return np.stack((radius * np.cos(turn), radius * np.sin(turn), height + 0 * turn), axis=-1)


def _body(rims: Array, view: View) -> PolyCollection:
    """The faces of the body that face the eye, the farthest first."""
    beside = np.roll(rims, -1, axis=1)
    faces = np.stack((rims[:-1], beside[:-1], beside[1:], rims[1:]), axis=2).reshape(-1, 4, 3)
    normal = np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1])
    size = np.linalg.norm(normal, axis=1, keepdims=True)  # 0 where two rims are one
    normal = normal / np.where(size > 0, size, 1.0) @ np.array(view[:3]).T
    flat, depth = view.project(faces)
    front = np.flatnonzero(normal[:, 2] > 0)
    order = front[np.argsort(depth[front].sum(axis=1), kind="stable")]
    shade = 0.6 + 0.4 * np.clip(normal[order] @ LIGHT, 0, 1)
    marked = (order % SECTORS < MARKED_SECTORS)[:, None]
    rgb = shade[:, None] * np.where(marked, PATCH, BODY_COLOUR) / 255
    return PolyCollection([*flat[order]], facecolors=rgb, edgecolors=rgb, lw=0.7, zorder=2.5)


# --- a film in a file ----------------------------------------------------------------------------


def _as_gif(part: Path, frames: Iterator[Image.Image], fps: float) -> None:
    """Write a GIF, all of whose frames have one palette."""
    images = [*frames]
    # Each colour once: weighted by pixels, the colours of a small patch would be lost.
    found = (rgb for each in images for _, rgb in each.getcolors(each.width * each.height) or ())
    colours = np.array([*dict.fromkeys(found)], np.uint8)
    palette = Image.fromarray(colours[None]).quantize(GIF_COLOURS, Image.Quantize.MAXCOVERAGE)
    reduced = (each.quantize(palette=palette, dither=Image.Dither.NONE) for each in images)
    _save_images(part, reduced, fps, format="GIF", optimize=False)


def _as_webp(part: Path, frames: Iterator[Image.Image], fps: float) -> None:
    """Write a WebP."""
    _save_images(part, frames, fps, format="WEBP", quality=80, method=1)


def _save_images(part: Path, frames: Iterator[Image.Image], fps: float, **looks: Any) -> None:
    """Write frames by Pillow, in a format that holds all of them."""
    first, *others = frames
    ends = [10 * round(100 * k / fps) for k in range(len(others) + 2)]  # a GIF counts hundredths
    durations = [end - begin for begin, end in pairwise(ends)]
    first.save(part, save_all=True, append_images=others, duration=durations, loop=0, **looks)


def _as_mp4(part: Path, frames: Iterator[Image.Image], fps: float) -> None:
    """Write an MP4, by the ffmpeg that imageio-ffmpeg brings."""
    try:
        from imageio_ffmpeg import write_frames
    except ImportError:
        raise MissingPackage("an MP4", ["imageio-ffmpeg"], "film") from None
    first = next(frames)
    writer = write_frames(
        str(part), first.size, fps=fps, quality=7, macro_block_size=1, output_params=["-f", "mp4"]
    )
    writer.send(None)
    for frame in chain((first,), frames):
        writer.send(frame.tobytes())
    writer.close()


# --- the readers of its options ------------------------------------------------------------------


def _size(value: object) -> tuple[int, int]:
    """The width and the height of a text such as 800x600, or of a pair."""
    try:
        sides: Any = value.lower().split("x") if isinstance(value, str) else value
        width, height = (int(SIDE(int(each))) for each in sides)
    except (TypeError, ValueError):  # no numbers, or no pair of them
        raise Refused(SIDES) from None
    return width, height


FILM_WRITERS: Final = {".gif": _as_gif, ".webp": _as_webp, ".mp4": _as_mp4}
ENDS: Final = f"the name of a film ends in {', '.join(FILM_WRITERS)}"
SIDE: Final = Range(64, 4096, whole=True)
SIDES: Final = "width and height, two whole numbers from 64 to 4096, such as 800x600"
FILM_OPTIONS: Final[Mapping[str, Reader]] = {
    "path": restrict(partial(path_of, "path"), lambda x: x.suffix.lower() in FILM_WRITERS, ENDS),
    "seconds": Range(0.1, 600),
    "fps": Range(1, 50),
    "size": _size,
    "rounds": Range(1e-3, 1e6),
    **dict.fromkeys(("time", "speed"), Range(1e-12, 1e12)),
}
