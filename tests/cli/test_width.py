"""Tables fit the width they are printed in: no number is cut, and nothing stands behind a line."""

import fcntl
import json
import os
import pty
import re
import struct
import subprocess
import sys
import termios

import pytest
from click.testing import CliRunner
from rich.cells import cell_len

from heavytop.cli import app
from heavytop.results.run_texts import settled

NARROW = 80
HELP = [(verb, "--help") for verb in app.verbs]
TABLES = [
    ("scenes",),
    ("stress", "--list"),
    ("stress", "--cases", "kick-1e-9", "--methods", "auto,taylor-axis,taylor-attitude,gauss8"),
    ("drift", "sicm-kicked", "--periods", "30", "--methods", "taylor-axis-projected,gauss8"),
    ("atlas", "sicm-kicked", "--x", "phidot=-20:20:9", "--y", "psidot=-150:150:9", "-j", "1"),
    *(("classify", name) for name in ("sicm-kicked", "steady-betsch", "separatrix", "sleeping")),
    *(("plan", name) for name in ("sicm-kicked", "planar-rotating", "sleeping")),
    ("plan", "sicm-kicked", "--digits", "60"),
    *HELP,
    ("--help",),
]
# whose rows have long numbers, poles, no φ, 25 digits, or no events at all
RUNS = ("sicm-kicked", "through-top", "lie-group-benchmark", "planar-pendulum", "sleeping")


def printed(*words, width=NARROW):
    """What a command prints into a pipe where COLUMNS is set."""
    result = CliRunner().invoke(app, list(words), env={"COLUMNS": str(width)})
    assert result.exit_code == 0, result.output
    return result.stdout


def fits(text):
    lines = text.splitlines()
    assert max(map(cell_len, lines)) <= NARROW
    assert [line for line in lines if line != line.rstrip()] == []
    assert [line for line in lines if "…" in line and not re.match(r"… and \d+ more", line)] == []


@pytest.mark.slow
@pytest.mark.parametrize("words", TABLES, ids=" ".join)
def test_what_a_verb_prints_fits_eighty_columns(words):
    text = printed(*words)
    if "atlas" in words:  # their ends are written low … high
        text = re.sub(r" … (?=-?\d)", " to ", text)
    if "--help" in words:
        text = text.replace("…", "")  # NAME,…
    fits(text)


def shown(text):
    """The numbers of the events shown, a row for each."""
    rows = [line.split() for line in text.split("\nevent ")[1].splitlines()[1:]]
    return [row[1:] for row in rows if row and row[0] not in ("…", "at")]


@pytest.mark.parametrize("name", RUNS)
def test_every_number_of_a_run_is_whole(name):
    rows = json.loads(printed("run", name, "--json"))["events"]["table"]
    columns = ("t", "theta", "phi", "phidot")
    scales = {each: max((abs(row[each] or 0) for row in rows), default=0) for each in columns}
    for width in (NARROW, 100):
        text = printed("run", name, width=width)
        assert max(map(cell_len, text.splitlines())) <= width
        for row, texts in zip(rows, shown(text) if rows else (), strict=False):
            for each, told in zip(columns, texts, strict=False):
                if row[each] is None:
                    assert told == "–"
                else:  # at least seven digits, or nothing but rounding
                    near = max(5e-7 * abs(row[each]), 8 * sys.float_info.epsilon * scales[each])
                    assert abs(float(told) - row[each]) <= near
            assert float(texts[-1]) == pytest.approx(row["residual"], rel=6e-3)


@pytest.mark.processes
def test_the_first_command_of_the_readme_at_a_terminal():
    ours, its = pty.openpty()
    fcntl.ioctl(its, termios.TIOCSWINSZ, struct.pack("4H", 24, NARROW, 0, 0))
    command = [sys.executable, "-m", "heavytop", "run", "sicm-kicked", "-q"]
    env = dict(os.environ, TERM="xterm")
    with subprocess.Popen(command, stdin=its, stdout=its, stderr=its, env=env) as process:
        os.close(its)
        said = b"".join(iter(lambda: _read(ours), b""))
    os.close(ours)
    assert process.returncode == 0, said
    text = re.sub(r"\x1b\[[\d;?]*[a-zA-Z]", "", said.decode()).replace("\r\n", "\n")
    fits(text)
    assert [row[3] for row in shown(text)][:4] == ["-15", "0", "12.338715", "0"]


def _read(terminal):
    try:
        return os.read(terminal, 65536)
    except OSError:  # its end, on Linux
        return b""


def test_a_cell_is_0_only_where_it_is_rounding_beside_its_column():
    rows = json.loads(printed("run", "sicm-kicked", "--json"))["events"]["table"]
    assert 0 < min(abs(row["phidot"]) for row in rows) < 1e-14  # documents keep what tables do not
    assert settled([1.0, 1e-15, 2e-15, None, "-3e-16"]) == [1.0, 0.0, 2e-15, None, 0.0]
    assert settled([1e-15, 2e-15]) == [1e-15, 2e-15]
    assert settled([]) == []
