"""What is known of a motion can be copied and pickled, used or not, and then says the same."""

import copy
import pickle

import pytest

import heavytop as ht
from heavytop.analytic.motion import ClosedForm
from heavytop.classification.reduced import AxisMotion

from .motions import BOOK, KICKED


def scene(**more):
    return ht.Scene(BOOK, KICKED, time=1, **more)


def of_run(t):
    assert len({t.events, t(0.7)}) == 2  # of two that hold arrays == has an answer
    return t(0.7), t.events.t, t.samples.phi, repr(t.in_mpmath(["0.7"]))


MADE = {
    "motion": (
        lambda: ht.Motion(BOOK, KICKED),
        lambda m: (m.at(0.7).phi, m.at("0.7", 40).phi, m.kind, m.period, m.roots, m.constants)),
    "motion of an axis": (
        lambda: ClosedForm(AxisMotion((0.0, 0.6, 0.8), (1.0, 3.0, 4.0), 1.0)),
        lambda m: (*map(m.interval, ("period", "roots")), m.interval("theta", "0.7", 20), m.spin)),
    "run": (lambda: ht.propagate(scene()), of_run),
    "run of 20 digits, attitude": (
        lambda: ht.propagate(scene(digits=20), formulation="attitude"), of_run),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", MADE)
def test_a_copy_says_what_its_original_says(name):
    make, said = MADE[name]
    original = make()
    new = pickle.dumps(original), copy.deepcopy(original)
    expected = repr(said(original))
    used = pickle.dumps(original), copy.deepcopy(original)
    for pickled, copied in (new, used):
        assert repr(said(pickle.loads(pickled))) == expected
        assert repr(said(copied)) == expected
