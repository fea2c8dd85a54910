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
    """The columns of a file, as numbers."""
    header, *rows = csv.reader(Path(path).read_text("utf-8").splitlines())
    return {name: [float(row[k]) for row in rows] for k, name in enumerate(header)}


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


def dot(a: Vector, b: Vector) -> float:
    """A · b."""
    return sum(x * y for x, y in zip(a, b, strict=True))


def minus(a: Vector, b: Vector) -> Vector:
    """A − b."""
    return tuple(x - y for x, y in zip(a, b, strict=True))


def score(exact: Columns, data: Columns) -> Columns:
    """The errors of the data at all times, by name; the phase is how far ahead the axis is [s]."""
    row = {t: k for k, t in enumerate(data["t"])}
    if missing := [t for t in exact["t"] if t not in row]:
        raise SystemExit(f"t = {missing[0]!r} is missing")
    pick = [row[t] for t in exact["t"]]
    found: Columns = {}
    turning, axis = vectors(exact, "omega") or [], vectors(exact, "axis") or []
    speed = [cross(w, e) for w, e in zip(turning, axis, strict=True)]
    for name in VECTORS:
        true, mine = vectors(exact, name), vectors(data, name)
        if true is None or mine is None:
            continue
        off = [minus(mine[k], e) for k, e in zip(pick, true, strict=True)]
        if name == "quaternion":  # q and -q are one attitude
            other = [minus(tuple(-x for x in mine[k]), e) for k, e in zip(pick, true, strict=True)]
            off = [min(pair, key=lambda x: dot(x, x)) for pair in zip(off, other, strict=True)]
        found[name] = [math.sqrt(dot(d, d)) for d in off]
        if name == "axis":  # what its error has along the motion
            pairs = zip(off, speed, strict=True)
            found["phase"] = [dot(d, v) / dot(v, v) if dot(v, v) else 0.0 for d, v in pairs]
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
        rms = math.sqrt(dot(tuple(errors), tuple(errors)) / len(errors))
        unit = {"phase": " s", "omega": " rad/s"}.get(name, "")
        print(f"{name:10}  {errors[worst]:.2e}{unit} at t = {exact['t'][worst]:g} s, RMS {rms:.2e}")
    largest = max(found["axis"]) or sys.float_info.min
    print(f"digits      {-math.log10(largest):.1f}")


if __name__ == "__main__":
    main()
