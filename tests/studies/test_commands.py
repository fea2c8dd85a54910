"""The commands of studies: what they write, how they end, and that a killed one is finished."""

import json
import random
import shlex
import time

import pytest

from heavytop.report.page import page_of
from heavytop.studies import study, workers
from heavytop.studies.methods import stress_methods
from heavytop.studies.stress_cases import cases

from ..commands import document, names, printed, refused
from ..processes import begin, wait_for
from .toy import drop_line, results

QUICK = ("drift", "sicm-kicked", "--periods", 300, "--samples", 5, "--methods")
LONG = {
    "drift": ("sicm-kicked", "--periods", 200_000, "--samples", 9,
              "--methods", "taylor-attitude,taylor-axis"),
    "stress": ("--cases", "cusp,through-top,lie-group",
               "--methods", "auto,taylor-lagrange,dop853-scipy", "--time-limit", 60),
    "workprec": ("sicm-kicked", "--periods", 5, "--budget", 60,
                 "--methods", "auto=9,taylor-axis,taylor-lagrange,strang=50"),
    "atlas": ("sicm-kicked", "--x", "phidot=-20:20:900", "--y", "psidot=-150:150:900"),
}  # fmt: skip
JOBS = {"workprec": 1, "drift": 2, "stress": 1, "atlas": 2}


def files(folder):
    """What lies in a folder, beside the journal."""
    return {name: (folder / name).read_bytes() for name in names(folder)}


# --- killed and stopped ----------------------------------------------------------------------

DROPPED = {"us_per_period", "us_spread", "setup_s", "runs", "kinds_per_s", "rows_per_s",
           "front", "cheapest", "files", "versions", "command"}  # fmt: skip


def without_times(value):
    """A document without what depends on the clock."""
    if isinstance(value, dict):
        return {key: without_times(each) for key, each in value.items() if key not in DROPPED}
    return [without_times(each) for each in value] if isinstance(value, list) else value


def wait_for_records(folder, count, process):
    wait_for(lambda: len(results(folder)) >= count or process.poll() is not None, seconds=120)


@pytest.mark.slow
@pytest.mark.processes
@pytest.mark.parametrize(("verb", "jobs"), JOBS.items())
def test_killed_at_any_moment_and_resumed_it_is_the_study_that_was_not(verb, jobs, tmp_path):
    whole, folder, draw = tmp_path / "whole", tmp_path / "made" / "here", random.Random(jobs)
    complete = document(verb, *LONG[verb], "-o", whole)
    words = [verb, *LONG[verb], "--no-figures", "-o", folder, *("-j", jobs) * (jobs > 1)]
    process = begin("-m", "heavytop", *words)
    for count in (1, 4):
        wait_for_records(folder, 1 if verb == "drift" else count, process)
        time.sleep(draw.uniform(0.0, 0.5))
        process.kill()
        process.communicate(timeout=300)
        before = results(folder)
        assert before
        process = begin("-m", "heavytop", "resume", folder, "--json", "--no-figures", "-j", jobs)
    out, err = process.communicate(timeout=300)
    assert process.returncode == 0, err
    assert without_times(json.loads(out)) == without_times(complete)
    if verb == "workprec":
        assert results(folder).keys() == results(whole).keys()
    else:
        made, there = files(folder), files(whole)  # one without figures
        once, twice = (json.loads(each.pop(f"{verb}.json")) for each in (made, there))
        assert once | {n: twice[n] for n in ("command", "files")} == twice
        assert made.items() <= there.items()
    if verb in ("workprec", "stress"):
        assert before.items() <= results(folder).items()  # what was run is not run again
    assert shlex.split(json.loads(out)["command"]) == ["heavytop", *map(str, words)]
    before = results(whole), verb == "workprec" or files(whole)
    document("resume", whole)  # what is finished does not change
    assert (results(whole), verb == "workprec" or files(whole)) == before
    drop_line(whole)
    assert page_of([whole]).sections


# --- what is refused, and listed -------------------------------------------------------------


def test_other_versions_are_refused(tmp_path, monkeypatch):
    printed(*QUICK, "taylor-axis", "-o", tmp_path, "--no-figures")
    before = files(tmp_path)
    printed("resume", tmp_path)  # without figures, too
    assert files(tmp_path) == before
    here = study._versions()
    monkeypatch.setattr(study, "_versions", lambda: here | {"heyoka": "99"})
    assert "versions.heyoka" in refused(3, "resume", tmp_path)
    assert files(tmp_path) == before


def test_a_study_of_missing_packages_is_refused_and_beside_others_they_are_skipped(monkeypatch):
    place = "heavytop.comparison.methods.find_spec"
    monkeypatch.setattr(place, lambda name: None if name == "numba" else name)
    for words in (*QUICK, "strang"), ("stress", "--methods", "dop853-cyrk", "--cases", "cusp"):
        refused(2, *words)
    assert "numba" in printed(*QUICK, "strang,auto")


def test_the_cases_are_listed_with_what_they_are():
    known = document("stress", "--list")
    assert [case["name"] for case in known["cases"]] == list(cases())
    assert [each["name"] for each in known["methods"]] == list(stress_methods())


# --- a scheduler -----------------------------------------------------------------------------


def test_dask_that_is_missing_is_named_before_anything_is_made(monkeypatch, tmp_path):
    monkeypatch.setattr(workers, "find_spec", lambda name: None)
    words = (*QUICK, "taylor-axis", "-o", tmp_path / "a", "--scheduler", "tcp://192.0.2.1:8786")
    refused(2, *words)
    assert not (tmp_path / "a").exists()
