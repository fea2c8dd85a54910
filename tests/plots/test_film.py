"""Films: frames that show the exact motion, files of every form, and what is refused."""

import sys
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from PIL import Image, ImageSequence
from scipy.spatial.transform import Rotation

import heavytop as ht
from heavytop.plots.drawn_run import Clip
from heavytop.plots.film import BODY_COLOUR, MOMENTUM, PATCH, FilmScene

SIZE = (800, 600)
SCENE = ht.load_scene("sicm-kicked")


def shot(name="sicm-kicked", changes=(), *, size=SIZE, follow=False, **options):
    scene = ht.load_scene(name, changes)
    motion = ht.Motion(scene.top, scene.start)
    end = float(scene.time or scene.periods * motion.period)
    return FilmScene(scene, Clip.of(motion, end, 10.0, **options), size, follow)


def pixel(stage, view, point):
    """Where a point is in the picture: from the left and from the top."""
    x, y = stage.axes[0].transData.transform(view.project(point)[0])
    return x, SIZE[1] - y


def colour(picture, place):
    """The colour about a pixel, as a mean of nine."""
    x, y = np.floor(place).astype(int)
    return np.asarray(picture)[y - 1 : y + 2, x - 1 : x + 2].reshape(-1, 3).mean(axis=0)


def on_the_body(shot, rotation, view):
    """Points amid the faces of the wheel's rounded top that face the eye; whether it is orange."""
    rims = shot.rims[5:7]  # the outer half of the wheel's upper side
    for k, place in enumerate((rims + np.roll(rims, -1, axis=1)).mean(axis=0) / 2):
        if (rotation @ [0, 0, 1]) @ view.towards > 0.2:
            yield rotation @ place, k < 9


@pytest.mark.parametrize("follow", [False, True])
def test_three_frames_show_the_exact_motion(follow):
    seen, patches = shot(follow=follow), []
    for done in (0.1, 0.45, 0.93):
        at = ht.Motion(SCENE.top, SCENE.start).at(seen.record.t[seen.at(done)], digits=30)
        stage, view = seen.stage(), seen.view(done)
        picture = seen.frame(stage, done)
        turn = Rotation.from_quat([float(x) for x in at.quaternion], scalar_first=True)
        for place, orange in on_the_body(seen, turn.as_matrix(), view):
            found = colour(picture, pixel(stage, view, place))
            own = PATCH if orange else BODY_COLOUR
            patches.append((orange, abs(found / found.max() - own / own.max()).max() < 0.1))
        omega, axis = (np.array([float(x) for x in each]) for each in (at.omega, at.axis))
        A, C = float(SCENE.top.A), float(SCENE.top.C)
        momentum = A * omega + (C - A) * (omega @ axis) * axis
        size = np.linalg.norm(seen.momentum[seen.at(done)]) / np.linalg.norm(momentum)
        tip = pixel(stage, view, size * momentum)
        assert abs(colour(picture, tip) - [*bytes.fromhex(MOMENTUM[1:])]).max() < 60
    assert sum(orange for orange, _ in patches) > 5
    assert np.mean([right for _, right in patches]) > 0.9  # lines are drawn over some


@pytest.mark.parametrize("form", ["gif", "webp"])
def test_a_film_has_its_frames_and_the_same_bytes_again(tmp_path, form):
    done, scene = [], ht.load_scene("spherical-pendulum")
    how = {"seconds": 8 / 15, "fps": 15, "size": (96, 64), "progress": done.append}
    made = [ht.film(scene, tmp_path / f"{k}.{form}", **how) for k in range(2)]
    with Image.open(made[0]) as picture:
        assert (picture.n_frames, picture.size) == (8, (96, 64))
        durations = [each.info["duration"] for each in ImageSequence.all_frames(picture)]
    assert sum(durations) == 530  # eight frames at 15 a second; a GIF counts hundredths
    assert made[0].read_bytes() == made[1].read_bytes()
    assert done[:8] == [k / 8 for k in range(1, 9)]


@pytest.mark.parametrize("name", ["sleeping", "sicm-kicked", "inverted-gravity"])
def test_a_gif_has_the_colours_of_its_frames(tmp_path, name):
    """Also those of the orange quarter, which has few pixels, and is not always in sight."""
    scene, size = ht.load_scene(name), (400, 300)
    path = ht.film(scene, tmp_path / "x.gif", seconds=4, fps=12, size=size)
    drawn = shot(name, size=size, seconds=4.0)
    stage = drawn.stage()
    with Image.open(path) as picture:
        frames = ImageSequence.all_frames(picture, lambda each: each.convert("RGB"))
    for k in range(0, len(frames) - 1, 4):
        frame = drawn.frame(stage, k / (len(frames) - 1))
        assert np.abs(np.subtract(frames[k], frame, dtype=int)).max() < 25  # of 255


def test_a_film_shows_one_round_or_a_time_at_the_speed_that_is_asked():
    assert shot(rounds=2).record.t[-1] == pytest.approx(2 * ht.Motion(SCENE.top, SCENE.start).round)
    assert shot(changes=["span.time=-2"]).record.t[-1] < 0
    assert [shot(speed=0.1).record.t[-1], shot(time=30.0).record.t[-1]] == pytest.approx([1, 30])
    assert "".join(shot(size=(96, 64), rounds=300).titles[::3])[:24] == "SICM 2.10, kick…the path"


@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0])
def test_the_wheel_lies_where_a_disc_has_the_moments_of_the_top(ratio):
    seen = shot("spherical-pendulum", [f"top={{A=1, C={ratio}, gMR=1}}"])
    radius, middle = np.hypot(*seen.rims[4, 0, :2]), seen.rims[4:6, 0, 2].mean()
    assert middle >= 0
    assert radius**2 / 2 == pytest.approx(ratio * (radius**2 / 4 + middle**2))


def test_an_mp4_goes_through_ffmpeg_or_says_what_is_missing(tmp_path, monkeypatch):
    writer = Mock()
    write_frames = Mock(side_effect=lambda path, *_, **__: Path(path).touch() or writer)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    scene, path = ht.load_scene("sicm-kicked"), tmp_path / "x.mp4"
    with pytest.raises(ht.MissingPackage, match=r"\.\[film\]"):
        ht.film(scene, path, seconds=1, size=(64, 64))
    assert not [*tmp_path.iterdir()]
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", Mock(write_frames=write_frames))
    ht.film(scene, path, seconds=1, fps=5, size=(64, 64))
    _, *sent = (call.args[0] for call in writer.send.call_args_list)
    assert [len(frame) for frame in sent] == [64 * 64 * 3] * 5
