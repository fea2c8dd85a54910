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


def test_only_what_is_asked_is_measured_and_it_is_asked_for_by_names(fake):
    assert list(by_id(validate(["holds"], register=fake))) == ["holds"]
    assert set(by_id(validate(["50_fake"], register=fake))) == set(IDS)
    for wrong in ("hold", "50_fak", "", "a\n" * 100, "\udcff", 3):
        with pytest.raises(UnknownClaim, match="is neither a claim nor a script") as error:
            validate([wrong], register=fake)
        assert len(str(error.value)) < 200
        assert isinstance(error.value, HeavyTopError)
        assert ('did you mean "holds"' in str(error.value)) == (wrong == "hold")
    with pytest.raises(WrongType, match='names: a list of names, not "holds"'):
        validate("holds", register=fake)
    with pytest.raises(ValueError, match="jobs = 0: at least 1"):
        validate(jobs=0, register=fake)


def test_other_scripts_state_their_own_claims_and_all_are_told_of(tmp_path):
    own = 'from claim import claim\nclaim("one", 1, 2)\nclaim("two", 3, 2)\n'
    scripts = {"01_own.py": own, "02_worse.py": own + "raise SystemExit(3)\n", "50_fake.py": FAKE}
    register = made(tmp_path, scripts, {"50_fake.py": ("holds",)})
    assert register.proofs == ("01_own.py", "02_worse.py")
    assert set(by_id(validate(register=register))) == {"holds"}
    notes, parts = [], []
    told = {"note": notes.append, "progress": parts.append}
    all_of_them = validate(proofs=True, register=register, **told)
    assert [note.partition(" in ")[0] for note in notes] == [
        "running 50_fake.py", "50_fake.py: 1 passed", "running 01_own.py",
        "01_own.py: 1 passed, 1 failed", "running 02_worse.py", "02_worse.py: 3 failed",
    ]  # fmt: skip
    assert parts == [1 / 3, 2 / 3, 1.0]
    assert all_of_them.document()["authorities"] == 1  # a book; we are none
    found = by_id(all_of_them)
    assert [(name, each.passed, each.measured) for name, each in found.items()] == [
        ("holds", True, 0.5), ("01_own/1", True, 1), ("01_own/2", False, 3),
        ("02_worse/1", False, 1), ("02_worse/2", False, 3), ("02_worse/end", False, None),
    ]  # fmt: skip
    assert found["02_worse/1"].failure == "ended with code 3: it said nothing"


def test_what_an_installed_package_carries_is_run_from_a_copy_that_may_be_written(
    tmp_path, monkeypatch
):
    body = (
        f"from pathlib import Path\nhere = Path(__file__).parent\nassert str(here) != '{tmp_path}'"
        "\nassert all(p.stat().st_mode & 0o200 for p in (here, here / 'data'))\n"
    )
    inside = tmp_path / "data"
    inside.mkdir()
    known = one(tmp_path, body + GOOD)
    assert validate(register=known).failed
    monkeypatch.setattr(validating, "PACKED", tmp_path)
    for folder in (inside, tmp_path):
        folder.chmod(0o555)
    try:
        assert not validate(register=known).failed
    finally:
        tmp_path.chmod(0o755)


# --- what a script tells is taken for nothing that it is not -----------------------------------

NO_OBJECT = "line 2 of its output is not a JSON object"
NEEDLESS = "skipped, although the packages it needs are installed"
SKIPPED = 'tell({"id": "%s", "skipped": "no time"})\n'
OWN = 'tell({"statement": "s", "measured": %s, "bound": 1})'
JUDGED = [  # claims, those of a register or a script's own; what a script does; what comes of it
    ("x", 'tell({"id": "x", "measured": "0.5"})', None, "no finite number"),
    ("x", """tell(b'{"id": "x", "measured": NaN}')""", None, "no finite number"),
    ("x", GOOD + """tell(b'{"id": "x", "mea')""", 0.5, NO_OBJECT),
    ("x", GOOD + "tell(b'[0.5]')", 0.5, NO_OBJECT),
    ("x", GOOD + r"tell(b'\xff\xfe')", 0.5, NO_OBJECT),
    ("x", 'tell({"id": "x", "measured": -0.5})', -0.5, "negative, although it is a distance"),
    ("x", 'tell({"id": "x", "measured": 0.5, "failure": "worn"})', 0.5, "worn"),
    ("x", 'tell({"id": "x", "measured": 2, "passed": True})', 2, None),
    ("x", 'sys.stderr.write("x" * 99_999 + "\\nlast\\n \\n")\nsys.exit(1)', None,
     "ended with code 1: last"),
    ("x", 'tell({"id": "x", "failure": "no top"})\nraise SystemExit(3)', None, "no top"),
    ("x", GOOD + 'sys.exit("worn out")', 0.5, "ended with code 1: worn out"),
    ("x", GOOD + "os.kill(os.getpid(), 11)", 0.5, "ended by SIGSEGV: it said nothing"),
    ("x", GOOD + "os._exit(255)", 0.5, "ended with code 255: it said nothing"),
    ("x", GOOD + "time.sleep(60)", 0.5, "not done in 1 s"),
    ("x", GOOD + "sys.exit(5)", 0.5, "ended with code 5, but none of its claims fails"),
    ("x", SKIPPED % "x", None, NEEDLESS),
    ("present", SKIPPED % "present", None, NEEDLESS),
    ("absent", SKIPPED % "absent" + "sys.exit(3)", None, "ended with code 3: it said nothing"),
    ("50_one/1", OWN % 0.5, 0.5, None),
    ("50_one/1", OWN % '"0.5"', None, "no finite number"),
    ("50_one/1", 'tell({"skipped": "no time"})', None, NEEDLESS),
    ("50_one/end", "", None, "it claims nothing"),
    ("50_one/end", "1 / 0", None, "ended with code 1: ZeroDivisionError: division by zero"),
    ("50_one/end", "tell(b'[')", None, NO_OBJECT.replace("2", "1")),
]  # fmt: skip


@pytest.mark.parametrize(("claim", "body", "measured", "failure"), JUDGED)
def test_what_does_not_hold_says_why(tmp_path, monkeypatch, claim, body, measured, failure):
    if "sleep" in body:
        monkeypatch.setattr(validating, "LIMIT", 1.0)
    body = f"import os, sys, time\n{body}\n"
    known = one(tmp_path, body, () if "/" in claim else (claim,))
    [found] = validate(["50_one"], register=known).claims
    assert (found.id, found.measured, found.failure) == (claim, measured, failure)
    assert found.passed is (failure is None and measured <= 1)
    json.dumps(found, allow_nan=False)


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


def all_gone(path):
    return all(gone(int(pid)) for pid in soon(path).split())


def test_a_script_that_is_not_done_is_asked_and_killed_with_what_it_started(tmp_path, monkeypatch):
    monkeypatch.setattr(validating, "LIMIT", 1.0)
    monkeypatch.setattr(validating, "GRACE", 0.3)
    asked = tmp_path / "asked"
    deaf = f"import signal\nsignal.signal(15, lambda *_: open({str(asked)!r}, 'w').write('yes'))\n"
    on = "import time\nwhile True: time.sleep(1)\n"
    body = SLEEPING + noting(tmp_path / "pids", "os.getpid(), child.pid") + deaf + on
    assert validate(register=one(tmp_path, body)).failed
    assert asked.read_text() == "yes"
    assert all_gone(tmp_path / "pids")


def test_what_a_script_leaves_running_when_it_ends_is_ended(tmp_path):
    body = SLEEPING + noting(tmp_path / "pids", "child.pid") + GOOD
    assert not validate(register=one(tmp_path, body)).failed
    assert all_gone(tmp_path / "pids")


ALONE = """
import signal, sys
from pathlib import Path
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # nohup ignores it
signal.signal(signal.SIGINT, signal.default_int_handler)
from heavytop.claims import register, validate
known = register.load_register(Path(sys.argv[1]))
sys.modules["heavytop.claims.validate"].load_register = lambda: known
from heavytop.cli import main
sys.argv = ["heavytop", "validate", "-q"]
main()
"""
"""A process that validates what a folder claims, as the command does."""


@pytest.mark.parametrize(
    ("number", "own"), [("TERM", "import claim\n"), ("HUP", ""), ("INT", "import claim\n")]
)
def test_a_validation_that_is_ended_leaves_nothing_running(tmp_path, number, own):
    body = own + SLEEPING + noting(tmp_path / "pids", "os.getpid(), child.pid") + WAIT
    made(tmp_path, {"50_s.py": body}, {"50_s.py": ("x",)})
    here = os.environ | {"TMPDIR": str(tmp_path)}
    command = [sys.executable, "-c", ALONE, str(tmp_path)]
    with subprocess.Popen(command, stderr=subprocess.DEVNULL, env=here) as process:
        soon(tmp_path / "pids")
        process.send_signal(signal.Signals[f"SIG{number}"])
        assert process.wait(20) == 130
    assert all_gone(tmp_path / "pids")
    assert not list(tmp_path.glob("heavytop-*"))
    assert (tmp_path / "claims.toml").is_file()


def test_an_interrupt_in_python_leaves_nothing_running(tmp_path):
    begun = f"__import__('os').path.exists({str(tmp_path / 'pids')!r})"
    scripts = {
        "50_soon.py": f"import time\nwhile not {begun}: time.sleep(0.01)\n",
        "51_late.py": noting(tmp_path / "pids", "os.getpid()") + WAIT,
    }
    known = made(tmp_path, scripts, {"50_soon.py": ("x",), "51_late.py": ("y",)})

    def interrupted(_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as held:  # its traceback keeps the frames
        validate(register=known, progress=interrupted)
    assert all_gone(tmp_path / "pids")
    assert held.tb


# --- where it is measured changes nothing -------------------------------------------------------


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


MEASURED = 'from claim import claimed, finish\n@claimed("x")\ndef _():\n    return 0\nfinish()\n'


def test_the_environment_of_a_user_changes_nothing(tmp_path, monkeypatch):
    own = {f"HEAVYTOP_CLAIMS_{name}": str(tmp_path / "no" / name) for name in ("ASKED", "TOLD")}
    own |= {"HEAVYTOP_CLAIMS_OF": str(tmp_path), "PYTHONSAFEPATH": "1", "PYTHONUTF8": "0"}
    own |= {"TMPDIR": str(tmp_path / "no"), "PYTHONIOENCODING": "ascii", "LC_ALL": "C"}
    for name, value in own.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(tempfile, "tempdir", None)
    said = "import sys\nprint('\u03b8')\nprint('\u03b8', file=sys.stderr)\n"
    said += "open('/dev/null', 'w').write('\u03b8')\n"
    body = said + MEASURED
    known = made(tmp_path, {"50_c.py": body}, {"50_c.py": ("x",)})
    assert validate(register=known).counts["passed"] == 1


def test_another_package_of_this_name_is_not_measured(tmp_path, monkeypatch):
    other = tmp_path / "other" / "heavytop"
    other.mkdir(parents=True)
    (other / "__init__.py").touch()
    monkeypatch.setenv("PYTHONPATH", str(other.parent))
    known = made(tmp_path, {"50_c.py": MEASURED}, {"50_c.py": ("x",)})
    why = f"ended with code 1: it would measure another heavytop: {other}, not "
    assert validate(register=known).failed[0].failure.startswith(why)


def test_validations_at_the_same_time_do_not_meet(tmp_path):
    known = one(tmp_path, "import time\ntime.sleep(0.3)\n" + GOOD)
    with ThreadPoolExecutor(3) as pool:
        found = [pool.submit(validate, register=known) for _ in range(3)]
    assert all(each.result().counts["passed"] == 1 for each in found)
