"""``--scheduler`` lets other workers do a study; what is wrong with it is said in one sentence."""

from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import pytest
from typer.testing import CliRunner

from heavytop import errors
from heavytop.cli.command import app
from heavytop.studies import executors

ADDRESS = "tcp://192.0.2.1:8786"
ASKED = ("drift", "sicm-kicked", "--periods", "50", "--methods", "taylor-axis", "--no-figures")


def heavytop(*arguments):
    return CliRunner().invoke(app, list(map(str, arguments)))


@pytest.fixture
def asked(monkeypatch):
    """Return the addresses at which a cluster was asked for; it is a thread here."""
    found = []

    @contextmanager
    def at(address):
        found.append(address)
        with ThreadPoolExecutor(1) as pool:
            yield pool

    monkeypatch.setattr(executors, "executor_at", at)
    return found


def test_the_workers_of_a_scheduler_write_the_same_files(asked, tmp_path):
    there, here = tmp_path / "there", tmp_path / "here"
    assert heavytop(*ASKED, "-o", there, "--scheduler", ADDRESS).exit_code == 0
    assert heavytop("resume", there, "--scheduler", ADDRESS, "--no-figures").exit_code == 0
    assert asked == [ADDRESS, ADDRESS]
    assert heavytop(*ASKED, "-o", here).exit_code == 0
    files = [p.relative_to(here) for p in (here / "tasks").rglob("*.json")]
    assert len(files) == 1
    assert all((there / name).read_bytes() == (here / name).read_bytes() for name in files)


def test_its_workers_are_its_own(asked):
    found = heavytop(*ASKED, "--scheduler", ADDRESS, "--jobs", 2)
    assert found.exit_code == 2
    assert "Invalid value for --jobs: a scheduler has its own workers" in found.stderr
    assert not asked


def test_nobody_there(monkeypatch, tmp_path):
    def nobody(address):
        raise errors.NoScheduler(f"{address}: no dask scheduler answers there")

    monkeypatch.setattr(executors, "executor_at", nobody)
    found = heavytop(*ASKED, "-o", tmp_path / "study", "--scheduler", ADDRESS)
    assert found.exit_code == 2
    assert f"heavytop: {ADDRESS}: no dask scheduler answers there" in found.stderr
    assert not (tmp_path / "study").exists()


def test_without_dask(monkeypatch):
    monkeypatch.setattr(executors, "find_spec", lambda name: None)
    found = heavytop(*ASKED, "--scheduler", ADDRESS)
    assert found.exit_code == 2
    assert "a cluster needs distributed: pip install 'heavytop[cluster]'" in found.stderr


def test_a_run_is_no_study(asked, tmp_path):
    (tmp_path / "trajectory.nc").touch()
    found = heavytop("resume", tmp_path, "--scheduler", ADDRESS)
    assert found.exit_code == 2
    assert "--scheduler: for studies; this is a run" in found.stderr
