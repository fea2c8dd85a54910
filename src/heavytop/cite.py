"""What to cite: the package, and the sources of the methods that a result used.

This is the one place for bibliographic data; CITATION.cff repeats the package and the first two
sources, paper/paper.bib what the paper cites, and tests compare them. Results are read as plain
JSON, so that citing imports neither the numerical libraries nor the integrator.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from heavytop import __version__
from heavytop.errors import ForeignFile
from heavytop.files import regular
from heavytop.spelling import harmless

SCHEMA: Final = "heavytop/cite/1"


@dataclass(frozen=True, slots=True)
class Source:
    """A publication or a program; an author without a comma is an organization."""

    key: str
    kind: str
    authors: tuple[str, ...]
    title: str
    year: int
    fields: Mapping[str, str] = field(default_factory=dict)

    def bibtex(self) -> str:
        """Return the entry for a BibTeX file."""
        authors = " and ".join(name if "," in name else f"{{{name}}}" for name in self.authors)
        title, year = f"{{{self.title}}}", str(self.year)
        entries = {"author": authors, "title": title, "year": year, **self.fields}
        lines = (f"  {name} = {{{text}}}," for name, text in entries.items())
        text = "\n".join((f"@{self.kind}{{{self.key},", *lines, "}"))
        return text.replace("–", "--").replace("&", r"\&")

    def document(self) -> dict[str, Any]:
        """Return the source for JSON."""
        known = {"key": self.key, "kind": self.kind, "authors": list(self.authors)}
        return {**known, "title": self.title, "year": self.year, **self.fields}


RELEASED: Final = "2026-11-23"
KEYWORDS: Final = (
    *("heavy top", "Lagrange top", "rigid body dynamics", "Taylor integration"),
    "elliptic functions",
)
LICENSE: Final = "BSD-3-Clause"
PACKAGE: Final = Source(
    "heavytop",
    "misc",
    ("The heavytop developers",),
    "heavytop: the axisymmetric heavy top, integrated to the last digits and checked",
    int(RELEASED[:4]),
    {"note": f"Software, version {__version__}"},
)


def _article(
    key: str,
    authors: Sequence[str],
    title: str,
    year: int,
    journal: str,
    place: str,
    doi: str = "",
) -> Source:
    """An article; `place` is its volume, with the issue if it is known, and its pages."""
    issue, _, pages = place.partition(": ")
    volume, _, number = issue.rstrip(")").partition("(")
    fields = {"journal": journal, "volume": volume, "number": number, "pages": pages, "doi": doi}
    return Source(
        key, "article", tuple(authors), title, year, {k: v for k, v in fields.items() if v}
    )


def _book(
    key: str, authors: Sequence[str], title: str, year: int, publisher: str, **more: str
) -> Source:
    return Source(key, "book", tuple(authors), title, year, {"publisher": publisher, **more})


def _program(key: str, authors: Sequence[str], title: str, year: int, **more: str) -> Source:
    return Source(key, "misc", tuple(authors), title, year, more)


_MNRAS = "Monthly Notices of the Royal Astronomical Society"
_HAIRER, _LUBICH, _WANNER = "Hairer, Ernst", "Lubich, Christian", "Wanner, Gerhard"
_ROWS: Final = (
    _article(
        "heyoka", ["Biscani, Francesco", "Izzo, Dario"],
        "Revisiting high-order Taylor methods for astrodynamics and celestial mechanics",
        2021, _MNRAS, "504(2): 2614–2628", "10.1093/mnras/stab1032",
    ),
    _book(
        "sicm", ["Sussman, Gerald Jay", "Wisdom, Jack"],
        "Structure and Interpretation of Classical Mechanics",
        2015, "MIT Press", edition="second", isbn="978-0-262-02896-7",
    ),
    _article(
        "jorba-zou", ["Jorba, Àngel", "Zou, Maorong"],
        "A software package for the numerical integration of ODEs by means of high-order Taylor "
        "methods", 2005, "Experimental Mathematics", "14(1): 99–117",
        "10.1080/10586458.2005.10128904",
    ),
    _article(
        "sympy", ["Meurer, Aaron", "others"], "SymPy: symbolic computing in Python",
        2017, "PeerJ Computer Science", "3: e103", "10.7717/peerj-cs.103",
    ),
    _article(
        "arb", ["Johansson, Fredrik"],
        "Arb: efficient arbitrary-precision midpoint-radius interval arithmetic",
        2017, "IEEE Transactions on Computers", "66(8): 1281–1292", "10.1109/TC.2017.2690633",
    ),
    _program(
        "flint", ["The FLINT team"], "FLINT: Fast Library for Number Theory", 2025,
        url="https://flintlib.org",
    ),
    _book(
        "whittaker", ["Whittaker, Edmund Taylor"],
        "A Treatise on the Analytical Dynamics of Particles and Rigid Bodies",
        1937, "Cambridge University Press", edition="fourth", note="Sections 71 to 73",
    ),
    _program(
        "dlmf", ["Olver, Frank W. J.", "others"], "NIST Digital Library of Mathematical Functions",
        2025, url="https://dlmf.nist.gov", note="Chapters 19, 20 and 22",
    ),
    _article(
        "brouwer", ["Brouwer, Dirk"], "On the accumulation of errors in numerical integration",
        1937, "Astronomical Journal", "46: 149–153", "10.1086/105423",
    ),
    _book(
        "cushman-bates", ["Cushman, Richard H.", "Bates, Larry M."],
        "Global Aspects of Classical Integrable Systems", 2015, "Birkhäuser", edition="second",
    ),
    _article(
        "lie-group-benchmark", ["Brüls, Olivier", "Cardona, Alberto", "Arnold, Martin"],
        "Lie group generalized-α time integration of constrained flexible multibody systems",
        2012, "Mechanism and Machine Theory", "48: 121–137", "10.1016/j.mechmachtheory.2011.07.017",
    ),
    _article(
        "simo-wong", ["Simo, Juan C.", "Wong, Kachung Kevin"],
        "Unconditionally stable algorithms for rigid body dynamics that exactly preserve energy "
        "and momentum", 1991, "International Journal for Numerical Methods in Engineering",
        "31(1): 19–52", "10.1002/nme.1620310103",
    ),
    _article(
        "strang", ["Strang, Gilbert"], "On the construction and comparison of difference schemes",
        1968, "SIAM Journal on Numerical Analysis", "5(3): 506–517", "10.1137/0705041",
    ),
    _article(
        "blanes-moan", ["Blanes, Sergio", "Moan, Per Christian"],
        "Practical symplectic partitioned Runge–Kutta and Runge–Kutta–Nyström methods",
        2002, "Journal of Computational and Applied Mathematics", "142(2): 313–330",
        "10.1016/S0377-0427(01)00492-7",
    ),
    _article(
        "sofroniou-spaletta", ["Sofroniou, Mark", "Spaletta, Giulia"],
        "Derivation of symmetric composition constants for symmetric integrators",
        2005, "Optimization Methods and Software", "20(4-5): 597–613", "10.1080/10556780500140664",
    ),
    _book(
        "geometric-integration", [_HAIRER, _LUBICH, _WANNER], "Geometric Numerical Integration",
        2006, "Springer", edition="second",
    ),
    _article(
        "butcher", ["Butcher, John C."], "Implicit Runge–Kutta processes",
        1964, "Mathematics of Computation", "18(85): 50–64", "10.1090/S0025-5718-1964-0159424-9",
    ),
    _article(
        "bobenko-suris", ["Bobenko, Alexander I.", "Suris, Yuri B."],
        "Discrete time Lagrangian mechanics on Lie groups, with an application to the Lagrange "
        "top", 1999, "Communications in Mathematical Physics", "204: 147–188",
    ),
    _book(
        "ode-1", [_HAIRER, "Nørsett, Syvert Paul", _WANNER],
        "Solving Ordinary Differential Equations I", 1993, "Springer", edition="second",
    ),
    _book(
        "ode-2", [_HAIRER, _WANNER], "Solving Ordinary Differential Equations II",
        1996, "Springer", edition="second",
    ),
    _article(
        "lsoda", ["Petzold, Linda"],
        "Automatic selection of methods for solving stiff and nonstiff systems of ordinary "
        "differential equations", 1983, "SIAM Journal on Scientific and Statistical Computing",
        "4(1): 136–148", "10.1137/0904010",
    ),
    _article(
        "dopri5", ["Dormand, John R.", "Prince, Peter J."],
        "A family of embedded Runge–Kutta formulae", 1980,
        "Journal of Computational and Applied Mathematics", "6(1): 19–26",
        "10.1016/0771-050X(80)90013-3",
    ),
    _article(
        "scipy", ["Virtanen, Pauli", "others"],
        "SciPy 1.0: fundamental algorithms for scientific computing in Python",
        2020, "Nature Methods", "17(3): 261–272", "10.1038/s41592-019-0686-2",
    ),
    _program("cyrk", ["Renaud, Joe P."], "CyRK", 2022, doi="10.5281/zenodo.7093266"),
    _program(
        "numba", ["Lam, Siu Kwan", "Pitrou, Antoine", "Seibert, Stanley"],
        "Numba: a LLVM-based Python JIT compiler", 2015, doi="10.1145/2833157.2833162",
    ),
    # what paper/paper.md compares with
    _article(
        "ias15", ["Rein, Hanno", "Spiegel, David S."],
        "IAS15: a fast, adaptive, high-order integrator for gravitational dynamics, accurate to "
        "machine precision over a billion orbits", 2015, _MNRAS, "446(2): 1424–1437",
        "10.1093/mnras/stu2164",
    ),
    _article(
        "rebound", ["Rein, Hanno", "Liu, Shang-Fei"],
        "REBOUND: an open-source multi-purpose N-body code for collisional dynamics",
        2012, "Astronomy & Astrophysics", "537: A128", "10.1051/0004-6361/201118085",
    ),
    Source(
        "mujoco", "inproceedings", ("Todorov, Emanuel", "Erez, Tom", "Tassa, Yuval"),
        "MuJoCo: a physics engine for model-based control", 2012,
        {"booktitle": "IEEE/RSJ International Conference on Intelligent Robots and Systems",
         "pages": "5026–5033", "doi": "10.1109/IROS.2012.6386109"},
    ),
    _article(
        "exudyn", ["Gerstmayr, Johannes"],
        "Exudyn – a C++-based Python package for flexible multibody systems",
        2024, "Multibody System Dynamics", "60(4): 533–561", "10.1007/s11044-023-09937-1",
    ),
    Source(
        "pydy", "inproceedings",
        ("Gede, Gilbert", "Peterson, Dale L.", "Nanjangud, Angadh S.", "Moore, Jason K.",
         "Hubbard, Mont"),
        "Constrained multibody dynamics with Python: from symbolic equation generation to "
        "publication", 2013,
        {"booktitle": "ASME 2013 International Design Engineering Technical Conferences and "
         "Computers and Information in Engineering Conference", "doi": "10.1115/DETC2013-13470"},
    ),
    _article(
        "differential-equations", ["Rackauckas, Christopher", "Nie, Qing"],
        "DifferentialEquations.jl – a performant and feature-rich ecosystem for solving "
        "differential equations in Julia",
        2017, "Journal of Open Research Software", "5(1): 15", "10.5334/jors.151",
    ),
    _article(
        "capd",
        ["Kapela, Tomasz", "Mrozek, Marian", "Wilczak, Daniel", "Zgliczyński, Piotr"],
        "CAPD::DynSys: a flexible C++ toolbox for rigorous numerical analysis of dynamical systems",
        2021, "Communications in Nonlinear Science and Numerical Simulation", "101: 105578",
        "10.1016/j.cnsns.2020.105578",
    ),
)  # fmt: skip
SOURCES: Final = {source.key: source for source in (PACKAGE, *_ROWS)}

# --- what a result rests on ------------------------------------------------------------------

ALWAYS: Final = ("heavytop", "heyoka", "sicm")  # cited without a result
TAYLOR: Final = ("heyoka", "jorba-zou", "sympy")
EXACT: Final = ("whittaker", "dlmf", "arb", "flint")  # elliptic theory, and what proves it
METHODS: Final[Mapping[str, tuple[str, ...]]] = {
    "auto": TAYLOR,
    "taylor": TAYLOR,
    "strang": ("strang", "numba"),
    "blanes-moan-rkn6": ("blanes-moan", "numba"),
    "sofroniou-spaletta10": ("sofroniou-spaletta", "numba"),
    "implicit-midpoint": ("geometric-integration", "numba"),
    "gauss8": ("butcher", "numba"),
    "bobenko-suris": ("bobenko-suris", "numba"),
    "dop853-scipy": ("ode-1", "scipy"),
    "lsoda-scipy": ("lsoda", "scipy"),
    "radau-scipy": ("ode-2", "scipy"),
    "dop853-cyrk": ("ode-1", "cyrk"),
    "solve-ivp-defaults": ("dopri5", "scipy"),
}
RESULTS: Final[Mapping[str, tuple[str, ...]]] = {  # others rest on the exact solution
    "run": (*TAYLOR, *EXACT),
    "plan": ("arb", "flint"),
    "drift": (*EXACT, "brouwer"),
    "derive": ("sicm", "sympy"),
    "validate": (*TAYLOR, *EXACT),
}
FORMULATIONS: Final = {"cubic": "whittaker", "subsystem": "sicm", "lagrange": "sicm"}
SCENES: Final = {  # words in the source of a scene
    "Sussman & Wisdom": "sicm",
    "SICM": "sicm",
    "Whittaker": "whittaker",
    "Cushman & Bates": "cushman-bates",
    "Brüls": "lie-group-benchmark",
    "Simo & Wong": "simo-wong",
}
ASIDE: Final = frozenset(  # texts there name no method that was run
    {"scene", "versions", "command", "files", "rules", "hard", "limits", "skipped", "left_out"}
)


def citation(results: Iterable[Path] = ()) -> dict[str, Any]:
    """What to cite for the package, or for results, as the document ``heavytop/cite/1``.

    Parameters
    ----------
    results : iterable of Path
        Folders or JSON files that the package wrote; without any, the package is cited.

    Returns
    -------
    dict
        ``results`` (of each: its file, kind, scene, formulations and methods), ``sources`` and
        ``bibtex``.

    Raises
    ------
    ForeignFile
        There is no result of this package.

    Examples
    --------
    >>> [source["key"] for source in citation()["sources"]]
    ['heavytop', 'heyoka', 'sicm']
    """
    used = [_used(path, found) for path in results for path, found in _documents(path)]
    keys = dict.fromkeys(("heavytop", *(key for each in used for key in each["sources"])))
    sources = [SOURCES[key] for key in (keys if used else ALWAYS)]
    return {
        "schema": SCHEMA,
        "results": used,
        "sources": [source.document() for source in sources],
        "bibtex": "\n\n".join(source.bibtex() for source in sources),
    }


def in_words(document: Mapping[str, Any]) -> str:
    """The document as a BibTeX file, with a comment for each result."""
    comments = [_comment(each) for each in document["results"]]
    return "\n\n".join([*comments, document["bibtex"]])


def _comment(used: Mapping[str, Any]) -> str:
    lines = [f"% {used['file']}: {used['kind']}"]
    named = {
        "scene from": [used["scene"]] if used["scene"] else [],
        "formulations": used["formulations"],
        "methods": used["methods"],
        "your own methods, to be cited by you": used["own"],
    }
    lines += (f"%   {what}: {', '.join(names)}" for what, names in named.items() if names)
    return "\n".join(lines)


def _documents(path: Path) -> Iterator[tuple[Path, dict[str, Any]]]:
    """The results in a file or a folder; of a study that is finished, not its parameters."""
    files = sorted(path.glob("*.json")) if path.is_dir() else [path]
    found = [(file, document) for file in files if (document := _read(file))]
    finished = [each for each in found if "schema" in each[1]]
    if not found:
        raise ForeignFile(f"{harmless(path)}: no result of heavytop in JSON, nor a folder of one")
    yield from finished or found


def _read(path: Path) -> dict[str, Any] | None:
    """The document of a result, or the parameters of a study; None where it is neither."""
    try:
        with regular(path) as file:
            found = json.loads(file.read())
    except (OSError, ValueError, RecursionError):
        return None
    if not isinstance(found, dict):
        return None
    if "schema" in found:
        return found if str(found["schema"]).startswith("heavytop/") else None
    versions = found.get("versions")
    study = "kind" in found and isinstance(versions, dict) and "heavytop" in versions
    return found if study else None


def _used(path: Path, document: Mapping[str, Any]) -> dict[str, Any]:
    """What a result used: its scene's source, formulations, methods, and what these rest on."""
    kind = str(document["schema"]).split("/")[1] if "schema" in document else document["kind"]
    scene = document.get("scene")
    origin = scene.get("source") if isinstance(scene, dict) else None
    origin = harmless(origin) if isinstance(origin, str) else ""
    words = tuple(dict.fromkeys(_words(document)))
    methods = [word for word in words if _stem(word)]
    formulations = [word.removeprefix("=") for word in words if word.startswith("=")]
    keys = [key for word, key in SCENES.items() if word in origin]
    keys += RESULTS.get(kind, EXACT)
    keys += (FORMULATIONS[each] for each in formulations if each in FORMULATIONS)
    keys += (key for method in methods for key in METHODS[_stem(method)])
    return {
        "file": harmless(path),
        "kind": harmless(str(kind)),
        "scene": origin,
        "formulations": [harmless(each) for each in formulations],
        "methods": [harmless(each) for each in methods],
        "own": [harmless(word) for word in words if word.startswith("own:") or ".py:" in word],
        "sources": list(dict.fromkeys(keys)),
    }


def _words(part: Any, name: str = "") -> Iterator[str]:
    """The texts that may name methods; formulations with ``=`` before them."""
    if isinstance(part, str):
        if name == "formulation":
            yield from ("=" + part,) if part != "auto" else ()
        else:
            yield part
    elif isinstance(part, list):
        for each in part:
            yield from _words(each, name)
    elif isinstance(part, dict) and not isinstance(part.get("skipped"), str):
        for key, each in part.items():
            if key not in ASIDE:
                if key != "auto":  # what a study says of it, run or not
                    yield key
                yield from _words(each, key)


def _stem(word: str) -> str:
    """The entry of `METHODS` that a method is of; empty for what is no method."""
    name = word.partition("=")[0]
    if name.startswith("taylor-") or name == "auto-angles":
        return "taylor"
    return next((stem for stem in METHODS if name == stem or name.startswith(f"{stem}-")), "")
