"""Hold a trajectory of the heavy top to its exact values. This needs Python, and nothing else.

    python score.py SCENE mine.csv

mine.csv has columns t, with the times of SCENE.csv, and axis_x, axis_y, axis_z or theta, phi; and
maybe quaternion_w, quaternion_x, quaternion_y, quaternion_z; omega_x, omega_y, omega_z (in space).
"""

import csv
import math
import sys
from pathlib import Path

VECTORS = {"axis": "xyz", "quaternion": "wxyz", "omega": "xyz"}
Columns = dict[str, list[float]]
Vector = tuple[float, ...]


def read(path: str | Path) -> Columns:
    """The columns of a file, as numbers; a line on what is wrong with it ends the program."""
    try:
        lines = Path(path).read_text("utf-8-sig").splitlines()
        header, *rows = filter(None, csv.reader(lines))
        columns = [[float(x) for x in column] for column in zip(*rows, strict=True)]
        found = dict(zip(header, columns, strict=True))
    except OSError as fault:
        raise SystemExit(f"{path}: {fault.strerror}") from None
    except (ValueError, csv.Error) as fault:
        raise SystemExit(f"{path}: no table of numbers below their names ({fault})") from None
    if not all(math.isfinite(x) for column in columns for x in column):
        raise SystemExit(f"{path}: a number is not finite")
    return found


def vectors(columns: Columns, name: str) -> list[Vector] | None:
    """The vectors of a name, a row each; None where the columns are not there."""
    names = [f"{name}_{part}" for part in VECTORS[name]]
    if all(each in columns for each in names):
        return list(zip(*(columns[each] for each in names), strict=True))
    if name == "axis" and "theta" in columns and "phi" in columns:
        return [
            (math.sin(a) * math.sin(b), -math.sin(a) * math.cos(b), math.cos(a))
            for a, b in zip(columns["theta"], columns["phi"], strict=True)
        ]
    return None


def cross(a: Vector, b: Vector) -> Vector:
    """A × b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def ahead(e: Vector, v: Vector) -> float:
    """How far an axis is ahead of one that moves by v, which is at right angles to that one [s]."""
    return sum(x * y for x, y in zip(e, v, strict=True)) / math.hypot(*v) ** 2


def score(exact: Columns, data: Columns) -> Columns:
    """The errors of the data at all times, by name; the phase is how far ahead the axis is [s]."""
    row = {t: k for k, t in enumerate(data.get("t", []))}
    if missing := [t for t in exact["t"] if t not in row]:
        raise SystemExit(f"t = {missing[0]!r} is missing")
    found: Columns = {}
    for name in VECTORS:
        true, all_mine = vectors(exact, name), vectors(data, name)
        if true is None or all_mine is None:
            continue
        mine = [all_mine[row[t]] for t in exact["t"]]
        found[name] = list(map(math.dist, mine, true))
        if name == "quaternion":  # q and -q are one attitude
            other = ([-x for x in q] for q in mine)
            found[name] = list(map(min, found[name], map(math.dist, other, true)))
        if name == "axis":
            moving = list(map(cross, vectors(exact, "omega") or [], true))
            least = max(math.hypot(*v) for v in moving) / 1000  # an axis at rest tells no time
            pairs = zip(mine, moving, strict=True)
            found["phase"] = [ahead(e, v) if math.hypot(*v) > least else 0.0 for e, v in pairs]
    return found


def main() -> None:
    """Print the errors of a file."""
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    exact = read(Path(__file__).with_name(f"{sys.argv[1]}.csv"))
    found = score(exact, read(sys.argv[2]))
    if "axis" not in found:
        raise SystemExit("axis_x, axis_y, axis_z, or theta, phi, are missing")
    for name, errors in found.items():
        worst = max(range(len(errors)), key=lambda k: abs(errors[k]))
        rms = math.hypot(*errors) / math.sqrt(len(errors))
        unit = {"phase": " s", "omega": " rad/s"}.get(name, "")
        print(f"{name:10}  {errors[worst]:.2e}{unit} at t = {exact['t'][worst]:g} s, RMS {rms:.2e}")
    largest = max(found["axis"]) or sys.float_info.min
    print(f"digits      {-math.log10(largest):.1f}")


if __name__ == "__main__":
    main()
