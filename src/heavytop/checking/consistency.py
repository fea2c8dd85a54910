"""What data say of themselves, before any reference: lengths, turns, signs, times."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from heavytop.checking.comparison import FOLD_ALLOWED, Comparison, norm
from heavytop.checking.reading import Data

LENGTH: Final = 1e-6  # relative, by which a length may differ from 1 unsaid
JUMP: Final = 0.5  # of a turn, from which on a step of an angle is a wrap


def scale_lengths(data: Data) -> Data:
    """The data with lengths of 1, and what was found in remarks.

    Lengths are divided by their first, so that a drift of them stays in the data.
    """
    remarks, values = [*data.remarks], dict(data.values)
    for name in [name for name in ("axis", "quaternion", "vertical") if name in values]:
        length = norm(values[name])
        first = float(np.median(length[:5]))
        values[name] = values[name] / first
        if abs(first - 1) > LENGTH:
            remarks.append(f"the {name} is scaled to length 1: it has {first:.6g}")
        drift = abs(length / first - 1)
        if drift.max() > LENGTH:
            row = int(drift.argmax()) + 1
            remarks.append(f"the length of the {name} changes by {drift.max():.2g} (row {row})")
    if "quaternion" in values:
        q = values["quaternion"]
        if flips := int((np.einsum("ni,ni->n", q[1:], q[:-1]) < 0).sum()):
            remarks.append(f"the quaternion changes its sign {flips} times, which is no motion")
    if "matrix" in values:
        R = values["matrix"]
        off = norm(np.einsum("nij,nik->njk", R, R) - np.eye(3))
        if off.max() > LENGTH:
            remarks.append(f"R is not orthogonal by {off.max():.2g} (row {int(off.argmax()) + 1})")
        if (np.linalg.det(R) < 0).any():
            remarks.append("R is improper: its determinant is −1")
    return replace(data, values=values, remarks=tuple(remarks))


def remark_angles(c: Comparison) -> list[str]:
    """That θ is folded, with the first row, and that angles are unwrapped."""
    remarks, data = [], c.data
    if c.folded is not c:
        theta = data.values["theta"]
        row = int(np.argmax((theta < -FOLD_ALLOWED) | (theta > np.pi + FOLD_ALLOWED)))
        where = f"row {row + 1} (t = {data.t[row]:g} s, {theta[row]:.6g})"
        remarks.append(f"θ leaves [0, π] in {where}: folded")
    jumps = {x: abs(np.diff(data.values[x])) for x in ("phi", "psi") if x in data.values}
    if wrapped := [name for name, step in jumps.items() if (step > JUMP * 2 * np.pi).any()]:
        remarks.append(f"unwrapped: {', '.join(wrapped)}")
    return remarks
