"""What `validate` promises: measured beside bound, honestly, and no script outlives it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

import pytest

from heavytop.claims import validate as validating
from heavytop.claims.validate import UnknownClaim, validate
from heavytop.errors import HeavyTopError, WrongType

from ..processes import gone, soon
from .own_claims import FAKE, GOOD, IDS, by_id, made, one


@pytest.fixture
def fake(tmp_path):
    return made(tmp_path, {"50_fake.py": FAKE}, {"50_fake.py": IDS})


def test_each_claim_is_judged_by_its_bound(fake):
    found = by_id(validate(register=fake))
    assert {name: each.passed for name, each in found.items()} == {
        "holds": True, "fails": False, "raises": False, "nan": False, "absent": None,
        "lies": False, "unsaid": False,
    }  # fmt: skip
    assert (found["holds"].measured, found["fails"].measured) == (0.5, 2.0)
    assert found["raises"].failure == "ValueError: no such top"
    assert found["nan"].measured is None
    assert found["unsaid"].failure == "nothing was measured"
    assert found["absent"].skipped == "needs no_such_package: pip install no_such_package"


def test_only_what_is_asked_is_measured(fake):
    assert list(by_id(validate(["holds"], register=fake))) == ["holds"]
    assert set(by_id(validate(["50_fake"], register=fake))) == set(IDS)
    with pytest.raises(UnknownClaim, match='did you mean "holds"'):
        validate(["hold"], register=fake)


def test_what_is_asked_for_is_names(fake):
    for wrong in ("hold", "50_fak", "", "a\n" * 100, "\udcff"):
        with pytest.raises(UnknownClaim, match="is no claim and no script") as error:
            validate([wrong], register=fake)
        assert len(str(error.value)) < 200
        assert isinstance(error.value, HeavyTopError)
    with pytest.raises(UnknownClaim):
        validate([3], register=fake)
    with pytest.raises(WrongType, match='names: a list of names, not "holds"'):
        validate("holds", register=fake)
    with pytest.raises(ValueError, match="jobs = 0: at least 1"):
        validate(jobs=0, register=fake)


def test_each_script_is_told_of_as_it_begins_and_ends(tmp_path):
    scripts = {"01_own.py": "from claim import claim\nclaim('one', 1, 2)\n", "50_fake.py": FAKE}
    known = made(tmp_path, scripts, {"50_fake.py": IDS})
    notes, parts = [], []
    validate(proofs=True, register=known, note=notes.append, progress=parts.append)
    assert [note.partition(" in ")[0] for note in notes] == [
        "running 50_fake.py", "50_fake.py: 1 passed, 5 failed, 1 skipped",
        "running 01_own.py", "01_own.py: 1 passed",
    ]  # fmt: skip
    assert parts == [0.5, 1.0]


def test_other_scripts_state_their_own_claims(tmp_path):
    own = (
        '"""About tops.\n\nMore."""\nfrom claim import claim\n'
        'claim("one", 1, 2)\nclaim("two", 3, 2)\n'
    )
    scripts = {"01_own.py": own, "02_worse.py": own + "raise SystemExit(3)\n", "50_fake.py": FAKE}
    register = made(tmp_path, scripts, {"50_fake.py": ("holds",)})
    assert register.proofs == ("01_own.py", "02_worse.py")
    assert set(by_id(validate(register=register))) == {"holds"}
    all_of_them = validate(proofs=True, register=register)
    assert all_of_them.document()["authorities"] == 1  # a book; we are none
    found = by_id(all_of_them)
    assert [(name, each.passed) for name, each in found.items()] == [
        ("holds", True), ("01_own/1", True), ("01_own/2", False),
        ("02_worse/1", False), ("02_worse/2", False), ("02_worse/end", False),
    ]  # fmt: skip
    assert [found[f"02_worse/{n}"].measured for n in (1, 2, "end")] == [1, 3, None]
    assert found["02_worse/1"].failure == "ended with code 3: it said nothing"


def test_what_an_installed_package_carries_is_run_from_a_copy(tmp_path, monkeypatch):
    at_home = (
        "from pathlib import Path\nfrom claim import claim\n"
        f"claim('at home', Path(__file__).parent == Path({str(tmp_path)!r}), 0)\n"
    )
    register = made(tmp_path, {"01_where.py": at_home}, {})
    assert validate(["01_where"], register=register).failed
    monkeypatch.setattr(validating, "PACKED", tmp_path)
    assert not validate(["01_where"], register=register).failed


# --- what a script tells is taken for nothing that it is not -----------------------------------

X = '{"id": "x", "measured": %s}'


def told(tmp_path, body, ids=("x",)):
    return by_id(validate(register=one(tmp_path, body, ids)))


@pytest.mark.parametrize("measured", ['"0.5"', "[0.5]", "NaN", "-Infinity", "null"])
def test_what_is_no_number_does_not_hold(tmp_path, measured):
    found = told(tmp_path, f"tell({(X % measured).encode()!r})")["x"]
    assert (found.passed, found.measured, found.failure) == (False, None, "no finite number")
    json.dumps(found.document(), allow_nan=False)


@pytest.mark.parametrize(
    ("body", "measured", "failure"),
    [
        (GOOD + """tell(b'{"id": "x", "mea')""", 0.5, "line 2 of what it told is no JSON object"),
        (GOOD + "tell(b'[0.5]')", 0.5, "line 2 of what it told is no JSON object"),
        (GOOD + r"tell(b'\xff\xfe')", 0.5, "line 2 of what it told is no JSON object"),
        ('tell({"id": "x", "measured": -0.5})', -0.5, "negative, as no distance is"),
        ('tell({"id": "x", "measured": 0.5, "failure": "worn"})', 0.5, "worn"),
        ('tell({"id": "x", "measured": 2, "passed": True})', 2, None),
        ('import sys\nsys.stderr.write("x" * 99_999 + "\\nat last\\n \\n")\nsys.exit(1)',
         None, "ended with code 1: at last"),
        ('tell({"id": "x", "failure": "no such top"})\nraise SystemExit(3)', None, "no such top"),
        ("raise SystemExit(3)", None, "ended with code 3: it said nothing"),
    ],
)  # fmt: skip
def test_what_does_not_hold_says_why(tmp_path, body, measured, failure):
    found = told(tmp_path, body)["x"]
    assert (found.passed, found.measured, found.failure) == (False, measured, failure)


@pytest.mark.parametrize(
    ("name", "end", "failure"),
    [
        ("x", "", "skipped, but what it needs is there"),
        ("present", "", "skipped, but what it needs is there"),
        ("absent", "", None),
        ("absent", "raise SystemExit(3)", "ended with code 3: it said nothing"),
    ],
)
def test_only_what_an_absent_package_prevents_is_skipped(tmp_path, name, end, failure):
    body = f'tell({{"id": "{name}", "skipped": "no time"}})\n{end}'
    found = told(tmp_path, body, (name,))[name]
    assert found.failure == failure
    assert found.skipped == (None if failure else "no time")
    assert found.passed is (False if failure else None)


@pytest.mark.parametrize(
    ("body", "name", "measured", "failure"),
    [
        ('tell({"statement": "s", "measured": 0.5, "bound": 1})', "1", 0.5, None),
        ('tell({"statement": "s", "measured": "0.5", "bound": 1})', "1", None, "no finite number"),
        ('tell({"skipped": "no time"})', "1", None, "skipped, but what it needs is there"),
        ("", "end", None, "it claims nothing"),
        ("1 / 0", "end", None, "ended with code 1: ZeroDivisionError: division by zero"),
        ("tell(b'[')", "end", None, "line 1 of what it told is no JSON object"),
    ],
)
def test_other_scripts_are_not_trusted_either(tmp_path, body, name, measured, failure):
    [found] = validate(["50_one"], register=one(tmp_path, body, ())).claims
    assert (found.id, found.measured) == (f"50_one/{name}", measured)
    assert (found.passed, found.failure) == (failure is None, failure)


# --- no script outlives its validation ----------------------------------------------------------

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
    [measured] = found.claims
    assert (measured.passed, measured.measured, measured.failure) == (False, 0.5, failure)


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
