"""A study that was killed, wherever and however often, is the study that was not: bit for bit."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from collections import defaultdict
from pathlib import Path

import pytest

import heavytop
from heavytop.errors import HeavyTopError, InUse, Stop, StoppedEarly
from heavytop.studies.ledger import Folder, Study, run
from heavytop.studies.ledger.crew import BrokenTask
from heavytop.studies.ledger.entry import FULL

SOURCE = str(Path(heavytop.__file__).parents[1])
TOYS = Path(__file__).parent / "toys"
IDENTITY = {
    "kind": "toy",
    "scene": {"start": {"theta": "0.1"}},
    "options": {"tasks": 3, "blocks": 60},
    "versions": {"heyoka": "7.10.1"},
}
STEPS = 50 * 60  # of one task
LONGEST = 50 * 8  # of one piece
SLOWLY = {"TOY_PAUSE": "0.03"}  # so that it is not done before it is killed
NAMES = tuple(f"henon/{i:03d}" for i in range(3))
STUDY = Study(IDENTITY, NAMES, "toy_study")


@pytest.fixture(autouse=True)
def toys(monkeypatch):
    monkeypatch.syspath_prepend(str(TOYS))


def results(path):
    """Return every file that must be the same: all but the lock and the costs."""
    files = (p for p in path.rglob("*") if p.is_file() and p.name not in ("lock", "cost.json"))
    return {p.relative_to(path).as_posix(): p.read_bytes() for p in files}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return the files of a study that nothing happened to."""
    path = tmp_path_factory.mktemp("whole")
    assert finished(path, 1, path.parent / "log") == (0, "")
    return results(path)


def driven(path, jobs, log, **environment):
    """Start a process that does the study."""
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([SOURCE, str(TOYS)]), "TOY_LOG": str(log)}
    return subprocess.Popen(
        [sys.executable, str(TOYS / "drive.py"), str(path), str(jobs), json.dumps(IDENTITY)],
        env=env | environment,
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        start_new_session=True,
    )


def finished(path, jobs, log, **environment):
    """Let a process do the study; return its exit code and what it said."""
    process = driven(path, jobs, log, **environment)
    said = process.communicate(timeout=60)[1]
    return process.returncode, said


def killed(process):
    process.kill()
    process.communicate(timeout=60)


def lines(log):
    """Return what was done: task, first and last step, process, in the order it was done."""
    words = (line.split() for line in log.read_text().splitlines()) if log.exists() else ()
    return [(task, int(a), int(b), int(pid)) for task, a, b, pid in words]


def wait_for(condition, seconds=60):
    end = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)
    return found


def alive(pid):
    """Whether a process is there and not only waits to be buried."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.parametrize("jobs", [1, 2])
def test_killed_at_any_moment_it_goes_on(jobs, whole, tmp_path):
    """Each kill loses no more than the piece at hand of each worker."""
    path, log, moments = tmp_path / "study", tmp_path / "log", random.Random(jobs)
    kills = 0
    for _ in range(4):
        before = len(lines(log))
        process = driven(path, jobs, log, **SLOWLY)
        wait_for(lambda n=before, p=process: len(lines(log)) > n or p.poll() is not None)
        time.sleep(moments.uniform(0, 0.1))
        kills += process.poll() is None
        killed(process)
    assert kills == 4
    assert finished(path, jobs, log) == (0, "")
    assert results(path) == whole
    done = sum(last - first for _, first, last, _ in lines(log))
    assert 3 * STEPS <= done <= 3 * STEPS + kills * jobs * LONGEST


def test_it_goes_on_from_its_checkpoint_and_not_from_the_start(tmp_path):
    path, log = tmp_path / "study", tmp_path / "log"
    process = driven(path, 1, log, **SLOWLY)
    wait_for(lambda: len(lines(log)) > 2)
    killed(process)
    with Folder.look(path) as folder:
        there = folder.entry(NAMES[0]).checkpoint["steps"]
    assert 0 < there < STEPS
    before = len(lines(log))
    assert finished(path, 1, log)[0] == 0
    after = defaultdict(list)
    for task, first, last, _ in lines(log)[before:]:
        after[task].append((first, last))
    assert after[NAMES[0]][0][0] == there
    for pieces in after.values():  # and each goes on where the one before it ended
        assert [b for _, b in pieces[:-1]] == [a for a, _ in pieces[1:]]


class Killed(BaseException):
    """What nobody catches."""


def test_killed_between_any_two_writes_it_goes_on(whole, tmp_path, monkeypatch):
    """The moments a clock does not hit: before each renaming, among segment, checkpoint, cost."""
    moments, rename, left, kills = random.Random(0), Path.replace, [0], 0

    def replace(self, target):
        left[0] -= 1
        if left[0] < 0:
            raise Killed
        return rename(self, target)

    monkeypatch.setenv("TOY_PAUSE", "0")
    monkeypatch.setattr(Path, "replace", replace)
    while True:
        left[0] = moments.randint(0, 9)
        try:
            with Folder.create_or_open(tmp_path / "study", IDENTITY) as folder:
                run(STUDY, folder)
            break
        except Killed:
            kills += 1
    assert kills > 8
    assert results(tmp_path / "study") == whole


def test_what_is_finished_is_not_done_again(tmp_path):
    log = tmp_path / "log"
    assert finished(tmp_path / "study", 1, log)[0] == 0
    before = lines(log)
    assert finished(tmp_path / "study", 2, log) == (0, "")
    assert lines(log) == before
    with Folder.open(tmp_path / "study", IDENTITY["versions"]) as folder:
        assert folder.finished(NAMES)
        assert not folder.finished((*NAMES, "henon/003"))


def test_the_number_of_workers_changes_nothing(whole, tmp_path):
    with Folder.create_or_open(tmp_path / "three", IDENTITY) as folder:
        book = run(STUDY, folder, jobs=3)
        rows = {task: list(book.rows(task)) for task in NAMES}
    assert results(tmp_path / "three") == whole
    memory = run(STUDY, jobs=2)
    assert {task: list(memory.rows(task)) for task in NAMES} == rows
    assert [row["steps"] for row in rows[NAMES[1]]] == list(range(50, STEPS + 1, 50))
    assert min(folder.spent_s(task) for task in NAMES) > 0.01


def test_workers_die_with_the_one_that_writes(tmp_path):
    log = tmp_path / "log"
    process = driven(tmp_path / "study", 2, log, TOY_PAUSE="0.05")
    workers = wait_for(lambda: len(found := {pid for *_, pid in lines(log)}) == 2 and found)
    assert process.pid not in workers
    assert all(map(alive, workers))
    held = {f.resolve().name for pid in workers for f in Path(f"/proc/{pid}/fd").iterdir()}
    assert "lock" not in held
    killed(process)
    wait_for(lambda: not any(map(alive, workers)), seconds=2)


def test_a_killed_worker_is_replaced_once(whole, tmp_path):
    path, log = tmp_path / "study", tmp_path / "log"
    process = driven(path, 2, log, **SLOWLY)
    wait_for(lambda: len(lines(log)) > 4)
    os.kill(lines(log)[0][3], signal.SIGKILL)
    assert process.communicate(timeout=60)[1] == ""
    assert process.returncode == 0
    assert results(path) == whole
    assert len({pid for *_, pid in lines(log)}) == 3
    done = sum(last - first for _, first, last, _ in lines(log))
    assert done <= 3 * STEPS + LONGEST


def test_a_task_that_kills_its_worker_twice_ends_the_study(whole, tmp_path):
    path, log = tmp_path / "study", tmp_path / "log"
    code, said = finished(path, 2, log, TOY_DEADLY=NAMES[1], TOY_PAUSE="0")
    assert code == 4
    assert f"the worker on {NAMES[1]} died twice (killed by SIGKILL; out of memory?)" in said
    assert len({pid for task, *_, pid in lines(log) if task == NAMES[1]}) == 2
    with Folder.look(path) as folder:
        assert folder.entry(NAMES[1]).checkpoint["steps"] > 30 * 50 - LONGEST
    assert finished(path, 2, log) == (0, "")
    assert results(path) == whole


@pytest.mark.parametrize(
    ("jobs", "number"), [(1, signal.SIGINT), (2, signal.SIGINT), (2, signal.SIGTERM)]
)
def test_ctrl_c_saves_and_says_how_to_go_on(jobs, number, whole, tmp_path):
    path, log = tmp_path / "a study", tmp_path / "log"
    process = driven(path, jobs, log, **SLOWLY)
    wait_for(lambda: len(lines(log)) > 4)
    if number == signal.SIGINT:
        os.killpg(process.pid, number)  # as a terminal does: to the workers too
    else:
        process.send_signal(number)
    said = process.communicate(timeout=60)[1]
    assert process.returncode == 130
    assert said.startswith("interrupted; what was done is in ")
    assert said.endswith(f"\nheavytop resume '{path}'\n")
    assert not any(alive(pid) for *_, pid in lines(log))
    assert finished(path, jobs, log) == (0, "")
    assert results(path) == whole
    done = sum(last - first for _, first, last, _ in lines(log))
    assert done <= 3 * STEPS + (jobs > 1) * jobs * LONGEST  # alone, not even the piece at hand


def test_a_second_ctrl_c_does_not_wait_for_the_piece(tmp_path):
    path = tmp_path / "study"
    process = driven(path, 1, tmp_path / "log", TOY_PAUSE="60")
    wait_for((path / "study.json").exists)
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    time.sleep(0.5)
    assert process.poll() is None
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=40)
    assert process.returncode == 130


def test_signals_are_given_back():
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    seen = []
    run(
        Study(IDENTITY, NAMES[:1], "toy_study"),
        on_progress=lambda _: seen.append(signal.getsignal(signal.SIGINT)),
    )
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before
    assert before[0] not in seen[1:]


def test_one_writes_and_the_second_is_refused_by_name(tmp_path):
    path = tmp_path / "study"
    process = driven(path, 2, tmp_path / "log", TOY_PAUSE="0.1")
    wait_for(lambda: lines(tmp_path / "log"))
    with pytest.raises(InUse, match=rf"is being written by process {process.pid} on \S+$"):
        Folder.create_or_open(path, IDENTITY)
    code, said = finished(path, 1, tmp_path / "log")
    assert code == 2
    assert f"process {process.pid} on" in said
    with Folder.look(path) as folder:  # reading is for everybody
        assert folder.identity == IDENTITY
        with pytest.raises(ValueError, match="not opened for writing"):
            folder.fail(NAMES[0], "no")
    killed(process)
    with Folder.open(path) as folder:  # what a killed writer left is no lock
        assert folder.identity == IDENTITY


def test_a_forked_child_does_not_keep_the_lock(tmp_path):
    folder = Folder.create_or_open(tmp_path, IDENTITY)
    child = os.fork()
    if child == 0:
        time.sleep(60)
        os._exit(0)
    try:
        folder.close()
        with Folder.open(tmp_path) as again:
            assert again.identity == IDENTITY
            assert alive(child)  # had it died, its hold would have gone with it
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_full_disk_leaves_a_folder_that_goes_on(jobs, whole, tmp_path):
    path, log = tmp_path / "study", tmp_path / "log"
    code, said = finished(path, jobs, log, TOY_FILE_LIMIT="40000", TOY_PAUSE="0")
    assert code == 4
    assert f"cannot write {path / 'tasks' / 'henon'}" in said
    assert "File too large" in said
    assert not list(path.rglob(".*"))
    with Folder.look(path) as folder:
        begun = [task for task in NAMES if folder.entry(task).checkpoint]  # whichever was first
        assert begun
        assert all(list(folder.rows(task)) for task in begun)
    assert finished(path, jobs, log) == (0, "")
    assert results(path) == whole


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_task_that_fails_stops_no_other(jobs, monkeypatch):
    monkeypatch.setenv("TOY_REFUSES", NAMES[1])
    monkeypatch.setenv("TOY_PAUSE", "0")
    book = run(STUDY, jobs=jobs)
    assert [book.entry(task).failed for task in NAMES] == [None, "too steep", None]
    assert [book.entry(task).done for task in NAMES] == [True, False, True]
    assert list(book.rows(NAMES[1]))  # what it gave before is kept


def test_what_failed_stays_so(tmp_path, monkeypatch):
    monkeypatch.setenv("TOY_REFUSES", NAMES[1])
    monkeypatch.setenv("TOY_PAUSE", "0")
    with Folder.create_or_open(tmp_path, IDENTITY) as folder:
        run(STUDY, folder)
    with Folder.open(tmp_path) as folder:
        assert folder.finished(NAMES)
        assert folder.entry(NAMES[1]).failed == "too steep"
        assert list(folder.rows(NAMES[1]))


def test_a_bug_in_a_worker_is_shown_with_its_traceback(monkeypatch):
    monkeypatch.setenv("TOY_BUG", NAMES[1])
    with pytest.raises(BrokenTask, match=f"{NAMES[1]}: ZeroDivisionError: a slip") as bug:
        run(STUDY, jobs=2)
    assert "in _misbehave" in bug.value.__notes__[0]
    assert not isinstance(bug.value, HeavyTopError)
    with pytest.raises(ZeroDivisionError):
        run(STUDY)


def test_what_a_library_prints_is_no_message(whole, tmp_path):
    code, said = finished(tmp_path / "study", 2, tmp_path / "log", TOY_NOISE="1", TOY_PAUSE="0")
    assert code == 0
    assert "printed by a library" in said
    assert results(tmp_path / "study") == whole


def test_nothing_beside_the_person_is_imported(tmp_path, monkeypatch):
    """A file in the folder one happens to be in does not run in the workers."""
    for name in ("json", "queue", "ctypes"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('executed')")
    monkeypatch.chdir(tmp_path)
    book = run(Study(IDENTITY, NAMES[:1], "toy_study"), jobs=2)
    assert book.entry(NAMES[0]).done


def test_no_more_than_a_segment_is_in_memory(tmp_path):
    with Folder.create_or_open(tmp_path, IDENTITY) as folder:
        sizes = []
        run(
            STUDY,
            folder,
            on_progress=lambda _: sizes.append(
                sum(len(line) for task in NAMES for line in folder.entry(task).pending)
            ),
        )
        assert 0 < max(sizes) < FULL
        assert sizes[-1] == 0
        assert len(folder.entry(NAMES[0]).segments) > 2


def test_no_workers_is_no_number():
    with pytest.raises(ValueError, match="jobs = 0: at least 1"):
        run(STUDY, jobs=0)


def test_progress_grows_and_knows_what_is_left(tmp_path):
    seen = []
    run(STUDY, jobs=2, on_progress=seen.append)
    fractions = [p.fraction for p in seen]
    assert fractions == sorted(fractions)
    assert (seen[0].fraction, seen[0].left_s) == (0, None)
    assert (seen[-1].fraction, seen[-1].ended, seen[-1].left_s) == (1, 3, 0)
    half = next(p for p in seen if p.fraction > 0.5)
    assert half.left_s == pytest.approx(half.elapsed_s / half.gained * (1 - half.fraction))


def test_the_rate_is_that_of_this_process(tmp_path, monkeypatch):
    monkeypatch.setenv("TOY_PAUSE", "0")
    seen = []
    with Folder.create_or_open(tmp_path, IDENTITY) as folder:
        run(Study(IDENTITY, NAMES[:1], "toy_study"), folder)
        run(STUDY, folder, on_progress=seen.append)
    assert (seen[0].fraction, seen[0].gained) == pytest.approx((1 / 3, 0))
    assert seen[-1].gained == pytest.approx(2 / 3)


def test_an_interrupted_study_without_a_folder_says_so():
    assert str(StoppedEarly(Stop.INTERRUPTED, "interrupted", None)) == (
        "interrupted; without a folder nothing is kept"
    )
