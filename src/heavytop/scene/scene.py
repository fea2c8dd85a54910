"""Scene: a top, its start, how long, and what is wanted of the motion; read exactly from TOML."""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path
from typing import Any, Final, NoReturn

from heavytop.errors import BadScene, Fault
from heavytop.names import closest, nearest
from heavytop.numbers import Exact, Number
from heavytop.scene import schema
from heavytop.scene import text as scene_text
from heavytop.scene.arguments import path_of, told
from heavytop.scene.changes import CHANGES, overridden
from heavytop.scene.schema import Wrong
from heavytop.scene.shipped import FOLDER, shipped_names
from heavytop.scene.state import State
from heavytop.scene.top import Top
from heavytop.spelling import harmless, readable

MAX_BYTES: Final = 1_000_000
_MANY_FILES: Final = 1000  # of a folder, among which one may have been meant


@dataclass(frozen=True, slots=True, init=False, repr=False)
class Scene:
    """What is to be run: immutable, exact, and complete.

    Parameters
    ----------
    top : Top
        What spins.
    start : State
        How it starts.
    time : number, optional
        The span [s]; negative runs backwards.
    periods : number, optional
        The span in nutation periods; exactly one of `time` and `periods` is given.
    quantities : sequence of str
        Any of class, period, theta, axis, phi, psi, rates, attitude.
    events : sequence of str
        Any of turning, reversal, cusp.
    samples : int
        Number of samples over the span, both ends included.
    digits : int
        Correct digits wanted at the end: error ≤ 10^-digits · max(1, |x|).
    title, source : str
        What it is called, and where its numbers are from.
    name : str
        What files are called after; not part of the scene's identity.

    Raises
    ------
    BadScene
        Anything is out of its rule; every fault is listed.

    Examples
    --------
    >>> scene = Scene(Top("3.28e-4", "6.60e-5", "0.0456"), State(theta="0.1", psidot=140), time=2)
    >>> scene.quantities, scene.samples, scene == read_scene(scene.to_toml())
    (('theta', 'phi'), 401, True)
    """

    top: Top
    start: State
    time: Exact | None
    periods: Exact | None
    quantities: tuple[str, ...]
    events: tuple[str, ...]
    samples: int
    digits: int
    title: str
    source: str
    name: str = field(compare=False)

    def __init__(
        self,
        top: Top,
        start: State,
        time: Number | None = None,
        periods: Number | None = None,
        quantities: Sequence[str] = ("theta", "phi"),
        events: Sequence[str] = ("turning",),
        samples: int = 401,
        digits: int = 12,
        title: str = "",
        source: str = "",
        name: str = "scene",
    ) -> None:
        spans = {k: v for k, v in (("time", time), ("periods", periods)) if v is not None}
        wants = {"quantities": quantities, "events": events, "samples": samples, "digits": digits}
        texts = {"title": title, "source": source}
        span, wrong = schema.read_span(spans)
        want, wrong_want = schema.checked(schema.WantKeys, wants)
        text, wrong_text = schema.checked(schema.SceneKeys, texts)
        parts = {"top": top, "start": start, "name": name}
        wrong += wrong_want + wrong_text + _wrong_types(parts)
        if wrong:
            given = spans | wants | texts | parts
            raise BadScene(tuple(_Place("Scene").fault("", given, fault) for fault in wrong))
        fields = {"time": None, "periods": None} | span | want | text
        for key, value in (parts | fields).items():
            object.__setattr__(self, key, value)

    def __repr__(self) -> str:
        length = {key: str(x) for key in ("time", "periods") if (x := getattr(self, key))}
        names = ("quantities", "events", "samples", "digits", "title", "source", "name")
        told_of = length | {name: getattr(self, name) for name in names}
        rest = ", ".join(f"{key}={value!r}" for key, value in told_of.items() if value != "")
        return f"Scene({self.top}, {self.start}, {rest})"

    def __str__(self) -> str:
        length = f"{self.time} s" if self.time is not None else f"{self.periods} periods"
        return f"{self.title or self.name}: {self.top}, {self.start}, {length}"

    def tables(self) -> dict[str, Any]:
        """The scene as the tables of its file: exact numbers, texts, tuples of names."""
        span = {"time": self.time, "periods": self.periods}
        return {
            "format": schema.FORMAT,
            "title": self.title,
            "source": self.source,
            "top": {"A": self.top.A, "C": self.top.C, "gMR": self.top.gMR},
            "start": dict(self.start.given),
            "span": {key: value for key, value in span.items() if value is not None},
            "want": {
                "quantities": self.quantities,
                "events": self.events,
                "samples": self.samples,
                "digits": self.digits,
            },
        }

    def to_toml(self) -> str:
        """The text of a scene file that `read_scene` reads back to an equal scene.

        Raises
        ------
        NotANumber
            The scene was built in Python with cosines or sines, which no scene file can say.
        """
        return scene_text.written(self.tables())

    def document(self) -> dict[str, Any]:
        """The scene for JSON: numbers where 15 digits say them exactly, else their exact text."""
        document: dict[str, Any] = scene_text.json_ready({"name": self.name} | self.tables())
        return document


def load_scene(name_or_path: str | os.PathLike[str], overrides: Sequence[str] = ()) -> Scene:
    """Read a shipped scene by its name, or a scene file by its path.

    Parameters
    ----------
    name_or_path : str or path
        A name of `shipped_scenes`, or the path of a TOML file.
    overrides : sequence of str
        Changes such as ``"start.phidot=-14"``. span.time and span.periods displace each other,
        and so do start.psidot and start.omega3.

    Returns
    -------
    Scene

    Raises
    ------
    BadScene
        The file cannot be read or the scene cannot be run; every fault is listed.
    WrongType
        It is neither a name nor a path.

    Examples
    --------
    >>> print(load_scene("sicm-kicked", ["start.phidot=-14"]).start.phidot)
    -14
    """
    path_of("name_or_path", name_or_path)
    given = os.fspath(name_or_path)
    shipped = isinstance(name_or_path, str) and given in shipped_names()
    path = FOLDER / f"{given}.toml" if shipped else Path(given)
    return read_scene(_text_of(path, given), where=given, overrides=overrides)


def read_scene(text: str, where: str = "scene", overrides: Sequence[str] = ()) -> Scene:
    """Read a scene from its TOML text.

    Parameters
    ----------
    text : str
        What a scene file holds.
    where : str
        A name for it, in messages and of files.
    overrides : sequence of str
        Changes, as of `load_scene`.

    Returns
    -------
    Scene

    Raises
    ------
    BadScene
        The scene cannot be run; every fault is listed.

    Examples
    --------
    >>> from heavytop.scene.shipped import shipped_text
    >>> read_scene(shipped_text("sicm-dropped"), "mine", ["span.time=3"]).name
    'mine'
    """
    if len(text) > MAX_BYTES:
        _refuse_file(where, f"a scene is at most {MAX_BYTES} bytes long")
    try:
        raw = scene_text.parse(text)
    except ValueError as error:
        _refuse_line(where, text, str(error))
    changed, faults = overridden(raw, overrides)
    place = _Place(harmless(where), scene_text.key_lines(text), changed)
    scene, more_faults = _built(raw, place, readable(Path(where).stem))
    if scene is None or faults:
        if overrides and _is_sound(text, where):  # what is wrong comes of the changes
            more_faults = [replace(fault, file=CHANGES, line=None) for fault in more_faults]
        raise BadScene(tuple(sorted((*faults, *more_faults), key=lambda fault: fault.line or 0)))
    return scene


def _is_sound(text: str, where: str) -> bool:
    try:
        read_scene(text, where)
    except BadScene:
        return False
    return True


def no_scene(what: object, verb: str) -> BadScene:
    """What is raised where something that is no scene, such as a name, is given to a function."""
    value, hint = told(what), "load_scene gives one by its name"
    if isinstance(getattr(what, "start", None), State):  # a Motion
        hint = "Scene(motion.top, motion.start, time=2) is one"
    if isinstance(what, str) and what in shipped_names():
        hint = f'load_scene("{what}") gives it'
    return BadScene((Fault(verb, None, "scene", value, "a Scene", hint),))


# --- files -----------------------------------------------------------------------------------


def _refuse_file(where: str, rule: str, hint: str = "", line: int | None = None) -> NoReturn:
    raise BadScene((Fault(harmless(where), line, "scene", "", rule, hint),))


def _text_of(path: Path, where: str) -> str:
    """The text of a regular file of bounded size; anything else is refused before it is opened."""
    try:
        mode = path.stat().st_mode
        if not stat.S_ISREG(mode):
            what = "a directory" if stat.S_ISDIR(mode) else "not a regular file"
            raise OSError(f"a scene is a TOML file, and this is {what}")
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        _refuse_file(where, "no shipped scene and no file has this name", _meant(path))
    except (OSError, ValueError) as error:  # a name with a null byte is a ValueError
        _refuse_file(where, getattr(error, "strerror", None) or str(error))
    if len(data) > MAX_BYTES:
        _refuse_file(where, f"a scene file is at most {MAX_BYTES} bytes long")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        _refuse_file(where, f"a scene is UTF-8 text, and byte {error.start} is not", line=line)


def _refuse_line(where: str, text: str, message: str) -> NoReturn:
    """Refuse a text that is no TOML, and show the line at fault."""
    match = re.search(r"at line ([0-9]+)", message)
    line = int(match[1]) if match else None
    key, value = scene_text.written_at(text, line)
    hint = "a key or a table stands twice" if "overwrite" in message else ""
    hint = hint or scene_text.mistake(value)
    rule = f"not TOML: {message}"
    place = harmless(where)
    raise BadScene((Fault(place, line, key or "scene", harmless(value), rule, hint),))


def _meant(path: Path) -> str:
    """A hint at the scene that may have been meant by a name that none has."""
    if path.suffix != ".toml" and Path(f"{path}.toml").exists():
        return f'did you mean "{harmless(str(path))}.toml"?'
    try:
        beside = sorted(file.name for file in islice(path.parent.glob("*.toml"), _MANY_FILES))
    except (OSError, ValueError):
        beside = []
    if meant := closest(path.name, beside):
        return f'did you mean "{harmless(str(path.with_name(meant)))}"?'
    return nearest(path.stem, shipped_names()) or "heavytop scenes lists those that are shipped"


# --- from keys to a scene --------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Place:
    """Where keys stand: in a file, on a line, or among the changes asked for."""

    file: str
    lines: Mapping[str, int] = field(default_factory=dict)
    changed: Collection[str] = ()

    def fault(self, table: str, raw: Mapping[str, object], wrong: Wrong) -> Fault:
        key = f"{table}.{wrong.key}" if table else wrong.key
        name = harmless(key[:100])
        value = scene_text.shown(raw[wrong.key]) if wrong.key in raw else ""
        if key in self.changed:
            return Fault(CHANGES, None, name, value, wrong.rule, wrong.hint)
        line = self.lines.get(key, self.lines.get(table))
        return Fault(self.file, line, name, value, wrong.rule, wrong.hint)


def _built(raw: dict[str, Any], place: _Place, name: str) -> tuple[Scene | None, list[Fault]]:
    """The scene that the tables describe, or every fault in them."""
    keys, wrong = schema.read_scene_keys(raw)
    faults = [place.fault("", raw, fault) for fault in wrong]
    top, wrong_top = schema.read_top(keys["top"])
    start, wrong_start = schema.read_start(keys["start"], top)
    span, wrong_span = schema.read_span(keys["span"])
    want, wrong_want = schema.checked(schema.WantKeys, keys["want"])
    tables = {"top": wrong_top, "start": wrong_start, "span": wrong_span, "want": wrong_want}
    for table, wrong in tables.items():
        if isinstance(raw.get(table, {} if table == "want" else None), dict):
            faults += [place.fault(table, keys[table], fault) for fault in wrong]
    if faults or top is None or start is None:
        return None, faults
    titles = {key: keys[key] for key in ("title", "source") if key in keys}
    return Scene(top, start, **span, **want, **titles, name=name), []


def _wrong_types(parts: Mapping[str, object]) -> list[Wrong]:
    rules = {"top": (Top, "a Top"), "start": (State, "a State"), "name": (str, "a text")}
    return [Wrong(k, rule) for k, (kind, rule) in rules.items() if not isinstance(parts[k], kind)]
