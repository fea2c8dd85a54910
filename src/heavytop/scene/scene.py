"""Scene: a top, its start, how long, and what is wanted of the motion; read exactly from TOML."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Final, NoReturn

from heavytop.errors import BadScene, Fault, Impossible, refuse
from heavytop.exact import Exact, Number
from heavytop.scene import arguments, scene_file
from heavytop.scene.quantities import QUANTITIES
from heavytop.scene.scene_file import (
    FOLDER,
    FORMAT,
    MAX_TITLE,
    SCENE_READERS,
    TABLES,
    shipped_names,
)
from heavytop.scene.state import State
from heavytop.scene.top import Top
from heavytop.text import Shown, closest, cut, nearest, printable

MAX_BYTES: Final = 1_000_000
CHANGES_SOURCE: Final = "--set"
_RIVALS: Final = (
    ("time", "periods"), ("psidot", "omega3"), ("omega3", "p_psi"), ("E", "E_prime"),
    ("A", "A_cm"), ("C", "C_cm"),
)  # fmt: skip
"""Pairs of keys of which a table has one: setting one removes the other."""
_IN_QUOTES: Final = 'texts, units and expressions stand in quotes, such as theta = "30 deg"'

_ARGUMENTS: Final = {
    **TABLES["want"],
    **{name: SCENE_READERS[name] for name in ("title", "source")},
    "top": arguments.instance_of(Top),
    "start": arguments.instance_of(State),
    "name": arguments.instance_of(str),
}


@dataclass(frozen=True, slots=True, init=False, repr=False)
class Scene(Shown):
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
        The span in nutation periods; at most one of `time` and `periods` is given, and what
        integrates the scene needs one.
    quantities : sequence of str
        Any of those that docs/scenes.md lists.
    events : sequence of str
        Any of turning, reversal, cusp.
    samples : int
        Number of samples over the span, both ends included.
    digits : int
        Correct digits wanted, at all times: error ≤ 10^-digits · max(1, |x|).
    title, source : str
        What it is called, and where its numbers are from.
    name : str
        What files are called after; not part of the scene's identity.

    Raises
    ------
    BadScene
        A value breaks its rule; every fault is listed.

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
        given = locals()
        spans = arguments.drop_none(time=time, periods=periods)
        others = {key: given[key] for key in _ARGUMENTS}
        values, faults = arguments.parse_options("Scene", others, _ARGUMENTS)
        try:
            values |= {"time": None, "periods": None} | scene_file.read_span(spans)
        except Impossible as error:
            faults += scene_file.faults_of(error, "Scene", spans)
        top_read = values.get("top")
        for quantity in values.get("quantities", ()) if top_read else ():
            if missing := QUANTITIES[quantity].missing(top_read):
                rule = f"missing: {quantity} needs {' and '.join(missing)}"
                faults.append(Fault(name, None, f"top.{missing[0]}", "", rule))
        refuse(faults)
        arguments.set_fields(self, values)

    def __repr__(self) -> str:
        values = {each.name: getattr(self, each.name) for each in fields(self)}
        stated = {name: value for name, value in values.items() if value not in (None, "")}
        return arguments.call_text("Scene", **stated)

    def __str__(self) -> str:
        return f"{self.title or self.name}: {self.top}, {self.start}"

    def tables(self) -> dict[str, Any]:
        """The scene as the tables of its file: exact numbers, texts, tuples of names."""
        top = {name: getattr(self.top, name) for name in ("A", "C", "gMR", "mass", "distance")}
        gravity = dict(self.top.given).get("gravity")
        if gravity is not None and self.top.distance == 0:  # gMR = 0 does not give the weight
            top |= {"gMR": None, "gravity": gravity}
        return {
            "format": FORMAT,
            "title": self.title,
            "source": self.source,
            "top": arguments.drop_none(**top),
            "start": dict(self.start.given),
            "span": arguments.drop_none(time=self.time, periods=self.periods),
            "want": {key: getattr(self, key) for key in TABLES["want"]},
        }

    def to_toml(self) -> str:
        """The text of a scene file that `read_scene` reads back to an equal scene."""
        return scene_file.toml_text(self.tables())

    def document(self) -> dict[str, Any]:
        """The scene for JSON: numbers where 15 digits are exact, else their exact text."""
        return dict(scene_file.json_ready({"name": self.name} | self.tables()))

    def changed(self, key: str, value: Number) -> Scene:
        """The scene with another value of a key such as ``start.psidot``.

        Parameters
        ----------
        key : str
            A key of the top or of the start, among those that they can be given by.
        value : number
            The new value; it removes a value that excludes it, as ψ̇ removes ω3.

        Raises
        ------
        BadScene
            The key is not of the top or of the start, or the changed scene is impossible.

        Examples
        --------
        >>> print(load_scene("spherical-pendulum").changed("top.mass", 2).top.gMR)
        19.6133
        """
        tables = self.tables() | {"top": dict(self.top.given), "start": dict(self.start.given)}
        table, _, name = key.rpartition(".")
        if table not in ("top", "start"):
            _refuse(self.name, "a number of the top or of the start, as start.psidot", key=key)
        _displace(tables[table], name, value)
        values, faults = scene_file.read_tables(self.name, tables)
        refuse(faults)
        return Scene(**values, name=self.name)

    def problem(self) -> dict[str, Any]:
        """The top and its start for JSON, with their names: what studies integrate.

        Examples
        --------
        >>> list(load_scene("sicm-kicked").problem())
        ['name', 'title', 'source', 'top', 'start']
        """
        tables = self.document()
        return {name: tables[name] for name in ("name", "title", "source", "top", "start")}


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
    arguments.path_of("name_or_path", name_or_path)
    name = os.fspath(name_or_path)
    shipped = isinstance(name_or_path, str) and name in shipped_names()
    path = FOLDER / f"{name}.toml" if shipped else Path(name)
    return read_scene(_text_of(path, name), where=name, overrides=overrides)


def read_scene(text: str, where: str = "scene", overrides: Sequence[str] = ()) -> Scene:
    """Read a scene from its TOML text.

    Parameters
    ----------
    text : str
        The content of a scene file.
    where : str
        Its name in messages; without folder and ending also the name of the scene.
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
    >>> from heavytop.scene.scene_file import shipped_text
    >>> text = shipped_text("sicm-dropped")
    >>> read_scene(text, "mine", ["span.time=3"]).name
    'mine'
    """
    try:
        raw = scene_file.parse(text)
    except ValueError as error:
        _refuse_line(where, text, str(error))
    changed, faults = apply_changes(raw, overrides)
    values, faults_in_tables = scene_file.read_tables(where, raw)
    if faults or faults_in_tables:
        lines = {key: line for line, key, _ in reversed([*scene_file.written_keys(text)])}
        for fault in faults_in_tables:
            line = lines.get(fault.key, lines.get(fault.key.partition(".")[0]))
            place = {"file": CHANGES_SOURCE} if fault.key in changed else {"line": line}
            faults.append(replace(fault, **place))
        faults.sort(key=lambda fault: fault.line or 0)
        raise BadScene(faults)
    return Scene(**values, name=Path(where).stem)


def scene_of(document: Mapping[str, Any]) -> Scene:
    """Return the scene with top and start of a stored `Scene.document`, over one nutation period.

    Examples
    --------
    >>> scene = load_scene("sicm-kicked")
    >>> again = scene_of(scene.document())
    >>> (again.top, again.start) == (scene.top, scene.start)
    True
    """
    tables = {name: document[name] for name in ("title", "source", "top", "start")}
    text = scene_file.toml_text({"format": FORMAT, **tables, "span": {"periods": 1}})
    return read_scene(text, where=document["name"])


def expect_scene(scene: object) -> Scene:
    """Return an argument that is a scene; raise `WrongType` for anything else, such as a name."""
    return arguments.expect("scene", scene, Scene, "load_scene gives one by its name")


# --- files -----------------------------------------------------------------------------------


def _refuse(
    where: str, rule: str, hint: str = "", line: int = 0, key: str = "scene", value: str = ""
) -> NoReturn:
    """Raise `BadScene` with one fault."""
    raise BadScene((Fault(where, line or None, key, value, rule, hint),))


def _text_of(path: Path, where: str) -> str:
    """The text of a file of at most `MAX_BYTES` bytes; `BadScene` where it cannot be read."""
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        _refuse(where, "no shipped scene and no file has this name", _hint_at_scene(path))
    except (OSError, ValueError) as error:  # a directory; a name with a null byte
        _refuse(where, getattr(error, "strerror", None) or str(error))
    if len(data) > MAX_BYTES:
        _refuse(where, f"a scene file is at most {MAX_BYTES} bytes long")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        _refuse(where, f"a scene is UTF-8 text, and byte {error.start} is not", line=line)


def _refuse_line(where: str, text: str, message: str) -> NoReturn:
    """Raise `BadScene` for a text that is no TOML, with the line at fault."""
    match = re.search(r"at line ([0-9]+)", message)
    line = int(match[1]) if match else 0
    at_line = (words for number, *words in scene_file.written_keys(text) if number == line)
    key, value = (cut(words, 60) for words in next(at_line, ("scene", "")))
    _refuse(where, f"not TOML: {message}", _IN_QUOTES, line, key, value)


def _hint_at_scene(path: Path) -> str:
    """A hint for the message about an unknown name: the existing scene with the nearest name."""
    if similar := closest(path.stem, sorted(file.stem for file in path.parent.glob("*.toml"))):
        return f'did you mean "{path.with_name(similar + ".toml")}"?'
    return nearest(path.stem, shipped_names()) or "heavytop scenes lists those that are shipped"


# --- changes: KEY=VALUE each, of --set and of `overrides` ------------------------------------


def apply_changes(raw: dict[str, Any], overrides: Any) -> tuple[set[str], list[Fault]]:
    """Change the tables `raw`; return the changed keys, and a fault for each impossible change.

    Changes of top and start are appended to the title, which may no longer be true after them.
    """
    if not isinstance(overrides, list | tuple) or not all(isinstance(x, str) for x in overrides):
        rule = 'a list of texts, such as ["start.phidot=-14"]'
        return set(), [Fault("heavytop", None, "overrides", arguments.value_text(overrides), rule)]
    changed, of_motion, faults = set(), dict[str, Any](), []
    for change in overrides:
        key, equals, text = (part.strip() for part in change.partition("="))
        name, _, last = key.rpartition(".")
        readable = equals and last and "." not in name
        table = raw.setdefault(name, {}) if name and readable else raw
        if not readable or not isinstance(table, dict):
            rule = "a change is KEY=VALUE, such as start.phidot=-14"
            faults.append(Fault(CHANGES_SOURCE, None, change[:60], "", rule))
            continue
        _displace(table, last, _override_value(text))
        changed.add(key)
        if name in ("top", "start"):
            _displace(of_motion, last, f"{key} = {text}")
    title = raw.get("title")
    if of_motion and "title" not in changed and type(title) is str and len(title) <= MAX_TITLE:
        raw["title"] = cut(printable(f"{title}; with {', '.join(of_motion.values())}"), MAX_TITLE)
    return changed, faults


def _displace(table: dict[str, Any], key: str, value: object) -> None:
    """Set a value in a table, and remove the key that excludes it."""
    for pair in _RIVALS:
        if key in pair:
            table.pop(pair[1 - pair.index(key)], None)
    table[key] = value


def _override_value(text: str) -> object:
    """The TOML value of a text, or the text itself, so that pi/3 needs no quotes."""
    try:
        value = scene_file.parse(f"value = {text}")
    except ValueError:
        value = {}
    return value["value"] if value.keys() == {"value"} else text
