"""A top as a film: frames of the exact motion, drawn with Pillow, as GIF, WebP or MP4.

Time is slowed so that the spin is seen. Frames are drawn twice as large as they are shown, for
smooth edges; the same scene gives the same frames.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping
from itertools import chain, pairwise
from pathlib import Path
from typing import Any, Final, NamedTuple

import matplotlib as mpl
import numpy as np
from PIL import Image, ImageColor, ImageDraw, ImageFont

from heavytop.analytic.motion import Motion
from heavytop.errors import BadScene, Fault, MissingPackage
from heavytop.files import write_whole
from heavytop.plots.clip import Clip
from heavytop.plots.sphere import PUSH, momentum_path
from heavytop.plots.style import EVENT_STYLES, PATH, Array
from heavytop.scene import arguments
from heavytop.scene.arguments import Range, Reader, Refused, expect
from heavytop.scene.quantities import QUANTITIES
from heavytop.scene.scene import Scene
from heavytop.text import cut

SECONDS: Final = 10.0
PATH_POINTS: Final = 2001  # of the path
FINE: Final = 2  # pixels drawn for one that is shown, in each direction
GIF_COLOURS: Final = 256  # of a GIF
MOST_PIXELS: Final = 5e8  # of all frames: 2 GB

SECTORS: Final = 36
MARKED_SECTORS: Final = SECTORS // 4  # a quarter of the body is orange, so that its spin is seen
STEM, STEM_REACH, SIZE, THICK = 0.03, 0.88, 0.62, 0.04  # of the body; the sphere has 1
BODY_COLOUR: Final = np.array([150, 166, 181])
PATCH: Final = np.array([236, 164, 30])
LIGHT: Final = np.array([-0.45, 0.62, 0.64])  # from where it comes: right, up, towards the eye
INK, FILM_FAINT, AHEAD_COLOUR, MOMENTUM, PAPER = (
    "#222222",
    "#9AA4AE",
    "#9CC3DB",
    "#882255",
    "#FFFFFF",
)
FONT: Final = str(Path(mpl.get_data_path(), "fonts", "ttf", "DejaVuSans.ttf"))
LETTERS: Final = 70  # of a title
WIDEST_RIM: Final = 4  # of the rims of the body
LEAN: Final = 0.05  # how far the axis leans, at least, where the eye looks across its lean
ASIDE: Final = 0.35  # rad, by which it looks from farther round
PALER: Final = 0.35  # opacity of what runs behind the sphere


def _size(value: object) -> tuple[int, int]:
    try:  # a text is the command's
        sides: Any = value.lower().split("x") if isinstance(value, str) else value
        width, height = (int(SIDE(int(each))) for each in sides)
    except (TypeError, ValueError):  # of what is no pair
        raise Refused(SIDES) from None
    return width, height


def _place(value: object) -> Path:
    place = arguments.path_of("path", value)
    if place.suffix.lower() not in FILM_WRITERS:
        raise Refused(f"the name of a film ends in {', '.join(FILM_WRITERS)}")
    return place


SIDE: Final = Range(64, 4096, whole=True)
SIDES: Final = "width and height, two whole numbers from 64 to 4096, such as 800x600"
FILM_OPTIONS: Final[Mapping[str, Reader]] = {
    "path": _place,
    "seconds": Range(0.1, 600),
    "fps": Range(1, 50),
    "size": _size,
    "rounds": Range(1e-3, 1e6),
    "time": Range(1e-12, 1e12),
    "speed": Range(1e-12, 1e12),
}


def film(
    scene: Scene,
    path: str | os.PathLike[str],
    *,
    seconds: float | None = None,
    fps: float = 25.0,
    size: tuple[int, int] | str = (800, 600),
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
    expect("scene", scene, Scene, "load_scene gives one")
    arguments.check_callable("progress", progress)
    timing = {"seconds": seconds, "rounds": rounds, "time": time, "speed": speed}
    given = {name: each for name, each in timing.items() if each is not None}
    known, wrong = arguments.parse_options(
        "film", given | {"path": path, "fps": fps, "size": size}, FILM_OPTIONS
    )
    if wrong:
        raise BadScene(tuple(wrong))
    place: Path = known["path"]
    (width, height), form, rate = known["size"], place.suffix.lower(), known["fps"]
    if form == ".mp4":
        width, height = 2 * (width // 2), 2 * (height // 2)
    motion = Motion(scene.top, scene.start)
    whole = float(scene.periods or 1) * (motion.period or 1)  # without a span: a nutation
    end = whole if scene.time is None else float(scene.time)
    clip = Clip.of(motion, end, SECONDS, **{name: known[name] for name in given})
    count = max(2, round(clip.seconds * rate))
    if form != ".mp4" and count * width * height > MOST_PIXELS:  # all frames are held
        rule = f"{count} frames are too many of this size: as an MP4, or smaller or shorter"
        raise BadScene((Fault("film", None, "size", f"{width}x{height}", rule),))
    shot = Shot.of(scene, clip, follow=follow)

    def frames() -> Iterator[Image.Image]:
        for k in range(count):
            yield shot.frame(k / (count - 1), (width, height))
            if progress is not None:
                progress((k + 1) / count)

    write_whole(place, lambda part: FILM_WRITERS[form](part, frames(), rate))
    return place


# --- what is shown, and from where ---------------------------------------------------------------


class Camera(NamedTuple):
    """An orthographic view: right, up and towards the eye as rows; pixels of a unit; the pivot."""

    rows: Array
    scale: float
    pivot: Array

    def project(self, points: Array) -> Array:
        """Points in space as pixels from the left and from the top, and how near they are."""
        right, up, near = np.moveaxis(points @ self.rows.T, -1, 0)
        x, y = self.pivot
        return np.stack((x + self.scale * right, y - self.scale * up, near), axis=-1)


class Shot(NamedTuple):
    """What a film shows, at even times.

    Attributes
    ----------
    titles : tuple of str
    t : ndarray, shape (k,)
    axis, momentum : ndarray, shape (k, 3)
        The momentum is the angular one over its largest size.
    rotation : ndarray, shape (k, 3, 3)
        Body to space.
    rims : ndarray, shape (rims, sectors, 3)
        The body, in its own frame.
    limits : mapping of str to float
        By colour the greatest and the least tilt [rad].
    turned : float
        By how much the eye goes round [rad].
    """

    titles: tuple[str, ...]
    t: Array
    axis: Array
    momentum: Array
    rotation: Array
    rims: Array
    limits: Mapping[str, float]
    turned: float

    @classmethod
    def of(cls, scene: Scene, clip: Clip, *, follow: bool = False) -> Shot:
        """What a film shows of a scene."""
        motion, end = clip.motion, clip.end
        record = motion.at(np.linspace(0.0, end, PATH_POINTS))
        pushed = f"pushed at {PUSH:g} rad/s; untouched it stays as it is" if clip.pushed else ""
        titles = cut(scene.title or scene.name, LETTERS), _pace(abs(end) / clip.seconds), pushed
        tilts = {"theta_max": motion.theta_max, "theta_min": motion.theta_min}
        return cls(
            titles=tuple(filter(None, titles)),
            t=record.t,
            axis=record.axis,
            momentum=momentum_path(scene.top, record),
            rotation=_rotations(record.quaternion),
            rims=_rims(float(scene.top.C / scene.top.A), float(np.sign(float(scene.top.gMR)))),
            limits={EVENT_STYLES[name].colour: float(tilt) for name, tilt in tilts.items()},
            turned=motion.mean_angle_rates[0] * end if follow else 0.0,
        )

    def at(self, done: float) -> int:
        """The number of the time at a fraction of the film."""
        return round(done * (self.t.size - 1))

    def view(self, done: float) -> Array:
        """Right, up and towards the eye: across the first lean, a little from above or below."""
        far = np.hypot(self.axis[:, 0], self.axis[:, 1])
        x, y, _ = self.axis[np.argmax(far > LEAN) if (far > LEAN).any() else np.argmax(far)]
        turn = math.atan2(-x, y) + ASIDE if far.max() > 1e-3 else -math.pi / 2
        turn += done * self.turned
        lift = -0.12 if self.axis[:, 2].mean() < -0.3 else 0.3
        s, c, up, level = math.sin(turn), math.cos(turn), math.sin(lift), math.cos(lift)
        return np.array([[-s, c, 0], [-up * c, -up * s, level], [level * c, level * s, up]])

    def camera(self, done: float, size: tuple[int, int]) -> Camera:
        """Where the eye is at a fraction of the film: path, wheel and pivot fill the picture."""
        wheel = self.rims[WIDEST_RIM, ::9] @ self.rotation[::200].swapaxes(1, 2)
        points = np.vstack((np.zeros(3), self.axis[::10], wheel.reshape(-1, 3)))
        others = np.linspace(0, 1, 9) if self.turned else [done]  # one scale for all of the film
        flat = np.concatenate([points @ self.view(x)[:2].T for x in others])
        low, high = flat.min(axis=0), flat.max(axis=0)
        scale = float(min(np.array(size) / (1.25 * np.maximum(high - low, 0.7))))
        pivot = np.array(size) / 2 - scale * np.array([1, -1]) * (low + high) / 2
        return Camera(self.view(done), scale, pivot)

    def frame(self, done: float, size: tuple[int, int]) -> Image.Image:
        """The picture at a fraction of the film."""
        large, now = (size[0] * FINE, size[1] * FINE), self.at(done)
        picture = Image.new("RGB", large, PAPER)
        Brush(ImageDraw.Draw(picture), self.camera(done, large), min(large) / 600).draw(self, now)
        small = picture.reduce(FINE)
        time = QUANTITIES["t"].with_unit(self.t[now], form=".4g")
        font = ImageFont.truetype(FONT, max(9, min(size) // 38))
        words = "\n".join((*self.titles, f"t = {time}"))
        ImageDraw.Draw(small).multiline_text((8, 6), words, fill=INK, font=font)
        return small


def _pace(pace: float) -> str:
    """How fast time passes, in words.

    >>> _pace(0.05), _pace(1.0), _pace(30)
    ('slowed 20 times', 'as fast as it is', '30 times as fast as it is')
    """
    if 0.95 < pace < 1.05:
        return "as fast as it is"
    return f"slowed {1 / pace:.2g} times" if pace < 1 else f"{pace:.2g} times as fast as it is"


def _rotations(quaternion: Array) -> Array:
    """The matrices, shape (k, 3, 3), of quaternions, shape (k, 4)."""
    w, v = quaternion[:, 0, None, None], quaternion[:, None, 1:]
    cross = np.cross(np.eye(3)[None], v)  # of v with each unit vector, by rows
    return np.asarray(np.eye(3) + 2 * w * cross + 2 * cross @ cross)


def _rims(ratio: float, side: float) -> Array:
    """The rims of the body: a wheel on a stem with the C/A of the top, on one side of the pivot.

    A wheel without thickness has it where r/h = tan, of 2 √(C/A) / √(2 − C/A).
    """
    wide = math.atan2(2 * math.sqrt(min(ratio, 2)), math.sqrt(max(2 - ratio, 0)))
    r, h = SIZE * max(math.sin(wide), 0.1), SIZE * math.cos(wide) * side
    foot = min(0, h - THICK)
    profile = np.array(
        [(0, foot), (STEM, foot), (STEM, h - THICK), (r / 2, h - THICK), (r, h - THICK / 2),
         (r, h + THICK / 2), (r / 2, h + THICK), (STEM, h + THICK),
         (STEM, STEM_REACH), (0, STEM_REACH)]
    )  # fmt: skip
    angle = 2 * np.pi * np.arange(SECTORS) / SECTORS
    radius, height = profile.T[..., None]
    return np.stack((radius * np.cos(angle), radius * np.sin(angle), height + 0 * angle), axis=-1)


class Brush(NamedTuple):
    """What draws on a picture; widths are in units of its size."""

    pen: ImageDraw.ImageDraw
    camera: Camera
    unit: float

    def draw(self, shot: Shot, now: int) -> None:
        """Draw the top as it is at one of the times."""
        axis, arrow = shot.axis[now], np.stack((np.zeros(3), shot.momentum[now]))
        stem, away = np.outer((0.0, STEM_REACH, 1.0), axis), axis @ self.camera.rows[2] < 0
        self.disc(
            self.camera.pivot, self.camera.scale, outline=FILM_FAINT, width=round(self.unit) or 1
        )
        self.line(np.array([[0, 0, -1.0], [0, 0, 1.15]]), FILM_FAINT, 1)
        self.paths(shot, now, behind=True)
        if away:
            self.line(stem, INK, 2.5)
        self.body(shot.rims @ shot.rotation[now].T)
        if not away:
            self.line(stem[1:], INK, 2.5)
        self.paths(shot, now, behind=False)
        self.line(arrow, MOMENTUM, 2)
        self.disc(self.camera.project(arrow[1])[:2], 3 * self.unit, fill=MOMENTUM)

    def paths(self, shot: Shot, now: int, *, behind: bool) -> None:
        """The circles between which the axis stays, the path ahead, and that so far."""
        around = np.linspace(0, 2 * np.pi, 91)
        for colour, tilt in shot.limits.items():
            x, y = math.sin(tilt) * np.cos(around), math.sin(tilt) * np.sin(around)
            self.line(np.stack((x, y, 0 * x + math.cos(tilt)), axis=-1), colour, 1, behind)
        self.line(shot.axis[now:], AHEAD_COLOUR, 1.2, behind)
        self.line(shot.axis[: now + 1], PATH, 2.4, behind)

    def disc(self, centre: Array, radius: float, **looks: Any) -> None:
        """Draw a circle."""
        self.pen.ellipse([*(centre - radius).tolist(), *(centre + radius).tolist()], **looks)

    def line(self, points: Array, colour: str, width: float, behind: bool | None = None) -> None:
        """Draw a line; or its parts in front of the sphere, or, paler, those behind it."""
        pixels = self.camera.project(points)
        drawn = np.ones(len(pixels), bool) if behind is None else (pixels[:, 2] < 0) == behind
        rgb = (PALER if behind else 1.0) * (np.array(ImageColor.getrgb(colour)) - 255) + 255
        looks: Any = {"fill": _colour(rgb), "width": max(1, round(width * self.unit))}
        for part in np.split(np.arange(len(pixels)), np.flatnonzero(np.diff(drawn)) + 1):
            if drawn[part[0]] and part.size > 1:
                self.pen.line(pixels[part, :2].ravel().tolist(), joint="curve", **looks)

    def body(self, rims: Array) -> None:
        """Draw the faces of the body that face the eye, the farthest first."""
        beside = np.roll(rims, -1, axis=1)
        faces = np.stack((rims[:-1], beside[:-1], beside[1:], rims[1:]), axis=2).reshape(-1, 4, 3)
        normal = np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1])
        normal = (normal / np.linalg.norm(normal, axis=1, keepdims=True)) @ self.camera.rows.T
        corners, shade = self.camera.project(faces), 0.6 + 0.4 * np.clip(normal @ LIGHT, 0, 1)
        front = np.flatnonzero(normal[:, 2] > 0)
        for k in front[np.argsort(corners[front, :, 2].sum(axis=1), kind="stable")].tolist():
            colour = _colour(shade[k] * (PATCH if k % SECTORS < MARKED_SECTORS else BODY_COLOUR))
            self.pen.polygon(corners[k, :, :2].ravel().tolist(), fill=colour, outline=colour)


def _colour(rgb: Array) -> tuple[int, ...]:
    return tuple(map(round, rgb.tolist()))


# --- a film in a file ----------------------------------------------------------------------------


def _as_gif(part: Path, frames: Iterator[Image.Image], fps: float) -> None:
    """Write a GIF, all of whose frames have one palette."""
    held = [*frames]
    # Each colour once: weighed by its pixels, a small patch would lose its own to the paper's.
    found = (rgb for each in held for _, rgb in each.getcolors(each.width * each.height) or ())
    once = np.array([*dict.fromkeys(found)], np.uint8)
    palette = Image.fromarray(once[None]).quantize(GIF_COLOURS, Image.Quantize.MAXCOVERAGE)
    few = (each.quantize(palette=palette, dither=Image.Dither.NONE) for each in held)
    _save(part, few, fps, format="GIF", optimize=False)


def _as_webp(part: Path, frames: Iterator[Image.Image], fps: float) -> None:
    _save(part, frames, fps, format="WEBP", quality=80, method=1)


def _save(part: Path, frames: Iterator[Image.Image], fps: float, **looks: Any) -> None:
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


FILM_WRITERS: Final = {".gif": _as_gif, ".webp": _as_webp, ".mp4": _as_mp4}
