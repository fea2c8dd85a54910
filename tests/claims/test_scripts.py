"""No script outlives its validation, and none holds that does not come to its end."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

import pytest

from heavytop.claims import validate as validating
from heavytop.claims.validate import validate

from .own_claims import GOOD, by_id, made, one
from .processes import gone, soon

CHILD = 'import subprocess, sys\nchild = subprocess.Popen([sys.executable, "-c", {program!r}])\n'
SLEEPING = CHILD.format(program="import time; time.sleep(60)")
WAIT = "import time\ntime.sleep(60)\n"


def noting(path, what):
    """What writes numbers of processes to a file, whole at once."""
    return (
        f"import os\nwith open({f'{path}.new'!r}, 'w') as file:\n    print({what}, file=file)\n"
        f"os.rename({f'{path}.new'!r}, {str(path)!r})\n"
    )


@pytest.mark.parametrize(
    ("end", "failure"),
    [
        ('sys.exit("worn out")', "ended with code 1: worn out"),
        ("sys.exit(3)", "ended with code 3: it said nothing"),
        ("os._exit(255)", "ended with code 255: it said nothing"),
        ("os.kill(os.getpid(), 11)", "ended by SIGSEGV: it said nothing"),
        ("os.kill(os.getpid(), 9)", "ended by SIGKILL: it said nothing"),
        ("time.sleep(60)", "not done in 1 s"),
        ("sys.exit(5)", "ended with code 5, but nothing that it told fails"),
    ],
)
def test_a_script_that_does_not_come_to_its_end_holds_nothing_of_what_it_measured(
    tmp_path, monkeypatch, end, failure
):
    monkeypatch.setattr(validating, "LIMIT", 1.0)
    found = validate(register=one(tmp_path, f"{GOOD}import sys, time\n{end}\n"))
    [measured] = found.results
    assert (measured.passed, measured.measured, measured.failure) == (False, 0.5, failure)


def test_what_failed_by_itself_keeps_its_reason_and_what_was_skipped_fails(tmp_path):
    body = (
        'tell({"id": "x", "failure": "no such top"}, {"id": "absent", "skipped": "absent"})\n'
        "raise SystemExit(3)"
    )
    found = by_id(validate(register=one(tmp_path, body, ("x", "absent", "y"))))
    assert found["x"].failure == "no such top"
    for name in ("absent", "y"):
        assert (found[name].passed, found[name].skipped) == (False, None)
        assert found[name].failure == "ended with code 3: it said nothing"


def test_code_0_hides_no_claim_that_fails(tmp_path):
    found = validate(register=one(tmp_path, 'tell({"id": "x", "measured": 2, "passed": True})'))
    assert (found.results[0].passed, found.results[0].failure) == (False, None)


def test_of_what_a_script_says_at_length_the_last_line_is_told(tmp_path):
    body = 'import sys\nsys.stderr.write("x" * 200_000 + "\\nat last\\n \\n")\nsys.exit(1)'
    found = validate(register=one(tmp_path, body))
    assert found.failed[0].failure == "ended with code 1: at last"


def test_a_script_that_is_not_done_is_killed_with_what_it_started(tmp_path, monkeypatch):
    monkeypatch.setattr(validating, "LIMIT", 1.0)
    deaf = "import signal\nsignal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
    monkeypatch.setattr(validating, "GRACE", 0.3)
    body = deaf + SLEEPING + noting(tmp_path / "pids", "os.getpid(), child.pid") + WAIT
    assert validate(register=one(tmp_path, body)).failed
    assert all(gone(int(pid)) for pid in soon(tmp_path / "pids").split())


def test_what_a_script_leaves_running_when_it_ends_is_ended(tmp_path):
    body = SLEEPING + noting(tmp_path / "pids", "child.pid") + GOOD
    assert not validate(register=one(tmp_path, body)).failed
    assert gone(int(soon(tmp_path / "pids")))


def test_a_script_that_is_ended_is_asked_first(tmp_path, monkeypatch):
    monkeypatch.setattr(validating, "LIMIT", 1.0)
    body = (
        "import signal, sys\n"
        f"signal.signal(signal.SIGTERM, lambda *_: (open({str(tmp_path / 'asked')!r}, 'w')\n"
        "    .write('asked'), sys.exit(0)))\n" + WAIT
    )
    assert validate(register=one(tmp_path, body)).failed[0].failure == "not done in 1 s"
    assert (tmp_path / "asked").read_text() == "asked"


def alone(folder):
    """A process that validates what a folder claims, as the command does."""
    program = (
        "import signal\nsignal.signal(signal.SIGHUP, signal.SIG_DFL)\n"  # nohup ignores it
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "import sys\nfrom pathlib import Path\nfrom heavytop.claims import register\n"
        "from heavytop.claims import validate as validating\n"
        f"known = register.load_register(Path({str(folder)!r}))\n"
        "validating.load_register = lambda: known\n"
        "from heavytop.cli import main\nsys.argv = ['heavytop', 'validate', '-q']\nmain()\n"
    )
    here = os.environ | {"TMPDIR": str(folder)}
    return subprocess.Popen([sys.executable, "-c", program], stderr=subprocess.DEVNULL, env=here)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
@pytest.mark.parametrize("own", ["import subprocess\n", "import claim\n"])
def test_a_validation_that_is_ended_leaves_nothing_running(tmp_path, number, own):
    body = own + SLEEPING + noting(tmp_path / "pids", "os.getpid(), child.pid") + WAIT
    made(tmp_path, {"50_s.py": body}, {"50_s.py": ("x",)})
    process = alone(tmp_path)
    pids = [int(pid) for pid in soon(tmp_path / "pids").split()]
    process.send_signal(number)
    assert process.wait(20) == 130
    assert all(gone(pid) for pid in pids)
    assert not list(tmp_path.glob("heavytop-*"))
    assert (tmp_path / "claims.toml").is_file()


def test_an_interrupt_in_python_leaves_nothing_running(tmp_path):
    scripts = {
        "50_soon.py": "import time\n"
        + f"while not __import__('os').path.exists({str(tmp_path / 'pids')!r}):"
        " time.sleep(0.01)\n",
        "51_late.py": noting(tmp_path / "pids", "os.getpid()") + WAIT,
    }
    known = made(tmp_path, scripts, {"50_soon.py": ("x",), "51_late.py": ("y",)})

    def interrupted(_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as held:  # its traceback keeps the frames
        validate(register=known, progress=interrupted)
    assert gone(int(soon(tmp_path / "pids")))
    assert held.tb


def test_scripts_read_nothing_and_leave_nothing_in_the_folder_for_what_is_temporary(
    tmp_path, monkeypatch
):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", None)
    body = (
        "import sys, tempfile\nassert not sys.stdin.read()\ntempfile.mkdtemp()\n"
        f"assert tempfile.gettempdir() != {str(tmp_path)!r}\n" + GOOD
    )
    before = {"50_one.py", "claim.py", "claims.toml"}
    assert not validate(register=one(tmp_path, body)).failed
    assert {path.name for path in tmp_path.iterdir()} - {"__pycache__"} == before


def test_the_environment_of_a_user_changes_nothing(tmp_path, monkeypatch):
    for name in ("ASKED", "TOLD", "OF"):
        monkeypatch.setenv(f"HEAVYTOP_CLAIMS_{name}", str(tmp_path / "nowhere" / name))
    monkeypatch.setenv("PYTHONSAFEPATH", "1")
    monkeypatch.setenv("TMPDIR", str(tmp_path / "not there"))
    monkeypatch.setattr(tempfile, "tempdir", None)
    body = 'from claim import claimed, finish\n@claimed("x")\ndef _():\n    return 0\nfinish()\n'
    known = made(tmp_path, {"50_c.py": body}, {"50_c.py": ("x",)})
    assert validate(register=known).counts["passed"] == 1


def test_letters_of_a_statement_are_printed_wherever_the_person_is(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONIOENCODING", "ascii")
    monkeypatch.setenv("PYTHONUTF8", "0")
    monkeypatch.setenv("LC_ALL", "C")
    body = "import sys\nprint('\u03b8')\nprint('\u03b8', file=sys.stderr)\n" + GOOD
    assert not validate(
        register=one(tmp_path, body + "open('/dev/null', 'w').write('\u03b8')\n")
    ).failed


def test_a_script_by_itself_measures_all_whatever_the_environment(tmp_path):
    body = 'from claim import claimed, finish\n@claimed("x")\ndef _():\n    return 2\nfinish()\n'
    made(tmp_path, {"50_c.py": body}, {"50_c.py": ("x",)})
    here = os.environ | {"HEAVYTOP_CLAIMS_ASKED": "y"}
    run = subprocess.run([sys.executable, tmp_path / "50_c.py"], env=here, capture_output=True)
    assert run.returncode == 5


def test_another_package_of_this_name_is_not_measured(tmp_path, monkeypatch):
    other = tmp_path / "other" / "heavytop"
    other.mkdir(parents=True)
    (other / "__init__.py").touch()
    monkeypatch.setenv("PYTHONPATH", str(other.parent))
    body = 'from claim import claimed, finish\n@claimed("x")\ndef _():\n    return 0\nfinish()\n'
    known = made(tmp_path, {"50_c.py": body}, {"50_c.py": ("x",)})
    why = f"ended with code 1: it would measure another heavytop: {other}, not "
    assert validate(register=known).failed[0].failure.startswith(why)


def test_validations_at_the_same_time_do_not_meet(tmp_path):
    known = one(tmp_path, "import time\ntime.sleep(0.3)\n" + GOOD)
    with ThreadPoolExecutor(3) as pool:
        found = [pool.submit(validate, register=known) for _ in range(3)]
    assert all(each.result().counts["passed"] == 1 for each in found)


def test_an_installed_package_may_be_read_only(tmp_path, monkeypatch):
    inside = tmp_path / "data"
    inside.mkdir()
    body = (
        "import os, stat\nfrom pathlib import Path\n"
        "here = Path(__file__).parent\nmodes = [p.stat().st_mode for p in (here, here / 'data')]\n"
        "assert all(mode & stat.S_IWUSR for mode in modes)\n" + GOOD
    )
    known = one(tmp_path, body)
    monkeypatch.setattr(validating, "PACKED", tmp_path)
    for folder in (inside, tmp_path):
        folder.chmod(0o555)
    try:
        found = validate(register=known)
    finally:
        tmp_path.chmod(0o755)
    assert not found.failed
