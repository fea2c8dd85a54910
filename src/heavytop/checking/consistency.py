"""What data say of themselves, before any reference: lengths, turns, signs, times."""

from __future__ import annotations

from typing import Final

import numpy as np

from heavytop.checking.comparison import FOLDED, fold, norm
from heavytop.checking.reading import Data

LENGTH: Final = 1e-6  # relative, by which a length may differ from 1 unsaid
JUMP: Final = 0.5  # of a turn, from which on a step of an angle is a wrap


def prepare(data: Data) -> Data:
    """The data with lengths of 1, and what was found in remarks.

    Lengths are divided by their first, so that a drift of them stays in the data.
    """
    remarks, values = [*data.remarks], dict(data.values)
    for name, what in (("axis", "axis"), ("quaternion", "quaternion"), ("vertical", "vertical")):
        if name in values:
            length = norm(values[name])
            first = float(np.median(length[:5]))
            values[name] = values[name] / first
            if abs(first - 1) > LENGTH:
                remarks.append(f"the {what} is scaled to length 1: it has {first:.6g}")
            if (drift := float(abs(length / first - 1).max())) > LENGTH:
                row = int(abs(length / first - 1).argmax()) + 1
                remarks.append(f"the length of the {what} changes by {drift:.2g} (row {row})")
    if "quaternion" in values:
        q = values["quaternion"]
        flips = int((np.einsum("ni,ni->n", q[1:], q[:-1]) < 0).sum())
        remarks += [f"the quaternion changes its sign {flips} times, which is no motion"] * (
            flips > 0
        )
    if "matrix" in values:
        product = np.einsum("nij,nik->njk", values["matrix"], values["matrix"])
        off = norm(product - np.eye(3))
        if off.max() > LENGTH:
            remarks.append(f"R is not orthogonal by {off.max():.2g} (row {int(off.argmax()) + 1})")
        if (np.linalg.det(values["matrix"]) < 0).any():
            remarks.append("R is improper: its determinant is −1")
    return Data(data.name, data.t, values, data.scene, data.columns, data.declared, (*remarks,))


def angle_remarks(data: Data) -> list[str]:
    """That θ is folded, with the first row, and that angles are unwrapped."""
    remarks = []
    theta = data.values.get("theta")
    if theta is not None and fold(data) is not data:
        out = (theta < -FOLDED) | (theta > np.pi + FOLDED)
        row = int(np.argmax(out))
        remarks.append(
            f"θ leaves [0, π] in row {row + 1} (t = {data.t[row]:g} s, {theta[row]:.6g}): folded"
        )
    wrapped = [
        name
        for name in ("phi", "psi")
        if name in data.values and (abs(np.diff(data.values[name])) > JUMP * 2 * np.pi).any()
    ]
    if wrapped:
        remarks.append(f"unwrapped: {', '.join(wrapped)}")
    return remarks
