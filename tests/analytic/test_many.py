"""Rows of arrays are those of Motion at 50 digits, of textbooks, and of each top alone."""

import numpy as np
import pytest

from heavytop.analytic.many import MOTIONS_AT_ONCE, Motions, motions_many
from heavytop.analytic.motion import Motion

from ..processes import begin, surroundings
from ..starts import nasty, regular, top_and_state

SICM = {"A": 3.28e-4, "C": 6.6e-5, "gMR": 0.0456}


def columns(found):
    return np.array([getattr(found, name) for name in Motions.columns])


def errors(numbers, found, rows=None):
    """Of rows against motions one by one: the largest relative error, of angles beside 1 or |x|."""
    given = dict(zip(numbers, np.broadcast_arrays(*numbers.values()), strict=True))
    off = []
    for at in range(found.period.size) if rows is None else rows:
        row = np.array([getattr(found, name).flat[at] for name in Motions.columns])
        alone = Motion(*top_and_state({name: float(each[at]) for name, each in given.items()}))
        want = np.array([getattr(alone, name) for name in Motions.columns], float)
        scale = abs(want)
        scale[[0, 1, 3, 4]] = np.maximum(1, scale[[0, 1, 3, 4]])
        with np.errstate(invalid="ignore"):
            off.append(np.where(np.isnan(row) & np.isnan(want), 0, abs(row - want) / scale).max())
    return np.array(off)


@pytest.mark.parametrize("held", ["omega3", "psidot"])
def test_each_row_is_that_of_a_motion_at_fifty_digits(held):
    random = np.random.default_rng(25)
    numbers = nasty(random, 2000, held)
    found = motions_many(**numbers)
    assert found.sent <= 320
    off = errors(numbers, found, random.choice(2000, 1010, replace=False).tolist())
    assert np.all(off < 1e-12)  # nan is below nothing


def test_a_row_is_the_same_bits_in_any_company():
    random = np.random.default_rng(8)
    n = MOTIONS_AT_ONCE + 1237
    numbers = regular(random, n)
    whole = columns(motions_many(**numbers))
    order = random.permutation(n)
    shuffled = columns(motions_many(**{name: each[order] for name, each in numbers.items()}))
    assert whole[:, order].tobytes() == shuffled.tobytes()
    for at in range(0, n, 97):
        alone = columns(motions_many(**{name: each[at] for name, each in numbers.items()}))
        assert alone.tobytes() == whole[:, at].tobytes()


HASHED = """
import hashlib, numpy as np
from heavytop.analytic.many import Motions, motions_many
names = "C", "gMR", "theta", "thetadot", "phidot", "psidot"
found = motions_many(A=4, **dict(zip(names, np.random.default_rng(1).uniform(0.1, 3, (6, 20_000)))))
columns = np.array([getattr(found, name) for name in Motions.columns])
print(hashlib.sha256(columns.tobytes()).hexdigest())
"""


@pytest.mark.processes
def test_a_row_is_the_same_bits_whatever_the_processor_can():
    found = np.show_config(mode="dicts")["SIMD Extensions"].get("found", [])
    if not found:
        pytest.skip("numpy has nothing here that it can leave unused")
    hashes = set()
    for without in ("", " ".join(found)):
        process = begin("-c", HASHED, env=surroundings(NPY_DISABLE_CPU_FEATURES=without))
        hashes.add(process.communicate()[0])
    assert [*map(len, hashes)] == [len("\n") + 64]


def test_what_is_steady_is_sent_to_no_motion():
    C, gMR = [6.6e-5, 6.6e-5, 6.6e-5, 3.28e-4], [0.0456, -0.0456, 0.0, 0.0]
    start = {"theta": [0.0, 0.0, 1.0, 1.0], "phidot": [0, 0, 0, 2], "psidot": [140, 140, 2, 0]}
    found = motions_many(**SICM | {"C": C, "gMR": gMR}, **start)
    assert found.theta_min.tolist() == found.theta_max.tolist() == start["theta"]
    assert np.isnan(columns(found)[2:]).all()
    assert found.sent == 0


def test_shapes_broadcast_and_the_impossible_is_nan():
    found = motions_many(**SICM, theta=[[0.1], [4.0]], phidot=[1.0, 2.0, 3.0], omega3=140)
    assert found.period.shape == found.theta_min.shape == found.verdicts.kind.shape == (2, 3)
    assert np.isnan(columns(found)).all(axis=0).tolist() == [[False] * 3, [True] * 3]
    assert found.sent == 0
    assert not found.period.flags.writeable
    assert found.verdicts.tags is None
    assert motions_many(**SICM, theta=0.1, tags=True).verdicts.tags is not None
