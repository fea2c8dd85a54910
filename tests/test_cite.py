"""What is cited: one set of bibliographic data, and what each result used."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

import heavytop as ht
from heavytop import cite
from heavytop.comparison import METHODS
from heavytop.errors import ForeignFile
from heavytop.results.documents import FILES
from heavytop.scene.scene import shipped_scenes
from heavytop.studies.methods import stress_methods, taylor_methods

from .commands import heavytop_

CFF = Path(__file__).parents[1] / "CITATION.cff"
REFERENCE = {  # CFF's words for those of BibTeX
    "journal": "journal",
    "volume": "volume",
    "number": "issue",
    "doi": "doi",
    "edition": "edition",
    "isbn": "isbn",
}


def keys(*results):
    return {source["key"] for source in cite.citation(results)["sources"]}


def written(folder, **document):
    path = folder / "result.json"
    path.write_text(json.dumps(document))
    return path


# --- CITATION.cff --------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def cff():
    yaml = pytest.importorskip("yaml", reason="it comes with the extra docs")
    return yaml.safe_load(CFF.read_text("utf-8"))


def person(name):
    family, comma, given = name.partition(", ")
    return {"family-names": family, "given-names": given} if comma else {"name": name}


def test_the_citation_file_has_what_its_format_requires(cff):
    assert {"cff-version", "message", "title", "authors"} <= cff.keys()
    assert cff["cff-version"] == "1.2.0"
    assert cff["type"] in {"software", "dataset"}
    for each in (cff, *cff["references"]):
        assert {"title", "authors", "type"} <= each.keys()
        for author in each["authors"]:
            assert author.keys() in ({"name"}, {"family-names", "given-names"})


def test_the_citation_file_says_what_the_package_says(cff):
    assert cff["title"] == cite.PACKAGE.title
    assert cff["authors"] == [person(name) for name in cite.PACKAGE.authors]
    assert str(cff["version"]) == ht.__version__
    assert str(cff["date-released"]) == cite.RELEASED
    assert cff["license"] == cite.LICENSE
    assert cff["keywords"] == list(cite.KEYWORDS)
    cited = [cite.SOURCES[key] for key in cite.ALWAYS if key != "heavytop"]
    for each, source in zip(cff["references"], cited, strict=True):
        assert (each["type"], each["title"], each["year"]) == (
            source.kind,
            source.title,
            source.year,
        )
        assert each["authors"] == [person(name) for name in source.authors]
        for name, theirs in REFERENCE.items():
            assert str(each.get(theirs, "")) == source.fields.get(name, "")
        if "pages" in source.fields:
            assert f"{each['start']}–{each['end']}" == source.fields["pages"]
        else:
            assert each["publisher"]["name"] == source.fields["publisher"]


# --- the data ------------------------------------------------------------------------------------


def test_every_entry_is_bibtex_with_what_its_kind_needs():
    assert len(cite.SOURCES) == len({source.title for source in cite.SOURCES.values()})
    needed = {"article": {"journal", "volume", "pages"}, "book": {"publisher"}, "misc": set(),
              "inproceedings": {"booktitle"}}  # fmt: skip
    for source in cite.SOURCES.values():
        entry = source.bibtex()
        assert entry.count("{") == entry.count("}")
        assert re.match(rf"@{source.kind}\{{{source.key},\n  author = \{{", entry)
        assert not re.search(r"(?<!\\)[&%#]", entry)
        assert needed[source.kind] <= source.fields.keys()
        assert re.fullmatch(r"10\.\d{4,}/\S+", source.fields.get("doi", "10.0000/none"))


def test_what_is_named_is_there():
    every = [cite.ALWAYS, *cite.METHODS.values(), *cite.RESULTS.values(), cite.SCENES.values()]
    for named in (*every, cite.FORMULATIONS.values(), cite.TAYLOR, cite.EXACT):
        assert set(named) <= cite.SOURCES.keys()


@pytest.mark.parametrize("name", METHODS)
def test_a_method_is_cited_as_its_own_table_says(name):
    method = METHODS[name]
    first, *programs = (cite.SOURCES[key] for key in cite.METHODS[name])
    assert str(first.year) in method.source
    assert all(author.partition(",")[0] in method.source for author in first.authors)
    assert {each.key for each in programs} & {need.lower() for need in method.needs}


def test_every_method_that_can_be_run_is_known(tmp_path):
    for name in ["auto", "auto=9", *taylor_methods(), *stress_methods(), *METHODS]:
        path = written(tmp_path, schema="heavytop/drift/1", methods=[{"name": name}])
        assert cite.citation([path])["results"][0]["methods"] == [name], name


# --- results -------------------------------------------------------------------------------------


def test_alone_it_is_the_package_the_integrator_and_the_book():
    said = heavytop_("cite")
    assert said.exit_code == 0
    assert re.findall(r"^@\w+\{(.*),$", said.stdout, re.M) == ["heavytop", "heyoka", "sicm"]
    document = json.loads(heavytop_("cite", "--json").stdout)
    assert document["schema"] == "heavytop/cite/1"
    assert document["bibtex"] == said.stdout.rstrip("\n")


def test_a_run_is_cited_with_its_formulation(tmp_path):
    words = ("--set", "span.time=0.1", "--formulation", "lagrange", "--no-figures")
    assert heavytop_("run", "simo-wong", *words, "-o", tmp_path / "run").exit_code in {0, 5}
    said = heavytop_("cite", tmp_path / "run").stdout
    assert "run.json: run\n" in said
    assert "formulations: lagrange" in said
    found = set(re.findall(r"^@\w+\{(.*),$", said, re.M))
    assert {"heavytop", "heyoka", "sympy", "sicm", "simo-wong", "whittaker", "arb"} <= found
    assert not found & {"numba", "scipy", "strang"}


def test_a_study_is_cited_with_its_methods_and_without_those_that_were_skipped(tmp_path):
    methods = [
        {"name": "taylor-cubic", "formulation": "cubic", "skipped": None},
        {"name": "dop853-scipy-lagrange", "formulation": "lagrange", "skipped": None},
        {"name": "gauss8", "formulation": "axis", "skipped": "no numba"},
        {"name": "mine.py:rk4=200", "formulation": "axis", "skipped": None},
    ]
    path = written(tmp_path, schema="heavytop/drift/1", methods=methods)
    document = cite.citation([path])
    [used] = document["results"]
    assert used["methods"] == ["taylor-cubic", "dop853-scipy-lagrange"]
    assert used["formulations"] == ["cubic", "lagrange", "axis"]
    assert used["own"] == ["mine.py:rk4=200"]
    assert {"ode-1", "scipy", "brouwer", "whittaker"} <= keys(path)
    assert not keys(path) & {"butcher", "numba"}
    assert "your own methods, to be cited by you: mine.py:rk4=200" in cite.in_words(document)


def test_an_unfinished_study_is_cited_by_its_parameters(tmp_path):
    study = {"kind": "drift", "methods": ["strang=50"], "versions": {"heavytop": "0.1.0"}}
    (tmp_path / "study.json").write_text(json.dumps(study))
    assert {"strang", "numba"} <= keys(tmp_path)
    (tmp_path / "drift.json").write_text('{"schema": "heavytop/drift/1", "methods": []}')
    assert "strang" not in keys(tmp_path)  # the result says what was run


@pytest.mark.parametrize("name", FILES)
def test_every_kind_of_result_rests_on_something(name, tmp_path):
    schema = FILES[name].schema
    assert keys(written(tmp_path, schema=schema)) >= {"heavytop", "arb"}


@pytest.mark.parametrize("name", [name for name in shipped_scenes() if "sicm" in name])
def test_the_scenes_of_the_book_are_cited_with_it(name, tmp_path):
    path = tmp_path / "classified.json"
    path.write_text(heavytop_("classify", name, "--json").stdout)
    assert "sicm" in keys(path)


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", '{"schema": "other/1"}', '{"kind": "drift"}', "{"]
)
def test_what_is_no_result_is_refused(text, tmp_path):
    (tmp_path / "x.json").write_text(text)
    for path in (tmp_path, tmp_path / "x.json", tmp_path / "none"):
        with pytest.raises(ForeignFile, match="no result of heavytop"):
            cite.citation([path])
    assert heavytop_("cite", tmp_path).exit_code == 3


@pytest.mark.processes
def test_no_library_of_numbers_is_imported(tmp_path):
    path = written(tmp_path, schema="heavytop/run/1")
    code = (
        "import sys\nfrom heavytop.cli import app\n"
        f"app(['cite', {str(path)!r}], standalone_mode=False)\n"
        "print(*sys.modules, file=sys.stderr)"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "@article{heyoka," in result.stdout
    slow = {"numpy", "heyoka", "sympy", "scipy", "matplotlib", "xarray", "flint", "mpmath"}
    assert slow.isdisjoint(result.stderr.split())
