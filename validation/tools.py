"""What scripts share: motions, largest errors, interleaved times, and running one alone."""

import sys
from ast import literal_eval
from inspect import signature
from time import perf_counter

import numpy as np

import heavytop as ht
from heavytop.claims import CLAIMS, Authority
from heavytop.equations.registry import FORMULATIONS
from heavytop.results.validation import VERDICTS
from heavytop.scene.quantities import ANGLES, QUANTITIES

HUNDRED_STEPS = "rounding of some hundred steps in doubles, ten times"  # why a bound

EULER = Authority("Euler's equations of the rigid body, integrated by our rigid.py", "ours")


def most(*found):
    """Return the largest of some numbers, as max does, but no number where one of them is none."""
    values = list(found[0]) if len(found) == 1 else list(found)
    return next((value for value in values if value != value), None) or max(values)


def farthest(found, expected):
    """Return the largest difference of two arrays, no number where one of them is none."""
    return float(np.max(np.abs(np.subtract(found, expected))))


def relative(found, exact):
    """Return how far a number is from an mpmath number, relative to that, with its digits."""
    return abs(exact.context.mpf(found) / exact - 1)


def motion_of(scene):
    """Return the exact motion of a scene, or of a shipped one that is named."""
    scene = ht.load_scene(scene) if isinstance(scene, str) else scene
    return ht.Motion(scene.top, scene.start)


STATE = ("theta", "phi", "psi", "thetadot", "phidot", "psidot")


def state(*values):
    """Return the start of these angles and rates."""
    return ht.State(**dict(zip(STATE, values, strict=True)))


def angles_of(form):
    """Return the angles that a formulation, or auto, follows."""
    entry = FORMULATIONS.get(form)
    return tuple(x for x in ANGLES if entry is None or QUANTITIES[x].need <= entry.gives)


def angles(at):
    """Return theta, phi and psi of a state."""
    return at.theta, at.phi, at.psi


def interleaved(programs, repeats=15):
    """Return the best time of each program [s], all run in turn so that ratios hold.

    A program that returns a number has taken the time itself.
    """
    best = dict.fromkeys(programs, float("inf"))
    for _ in range(repeats):
        for name, program in programs.items():
            began = perf_counter()
            given = program()
            spent = given if isinstance(given, float) else perf_counter() - began
            best[name] = min(best[name], spent)
    return best


def integrating(scene, **how):
    """Return a program that runs a scene, and returns the time of the steps alone [s]."""
    return lambda: ht.propagate(scene, **how).statistics.integrate_s


class Digits:
    """The numbers of a motion as mpmath numbers of so many digits; call it with a time."""

    def __init__(self, motion, digits):
        from heavytop.exact.decimals import context

        self.motion, self.digits, self.ctx = motion, digits, context(digits + 10)

    def __getattr__(self, name):
        return self.motion.mpf(name, self.digits)

    def __call__(self, t):
        return self.motion.at(self.ctx.mpf(t), self.digits)


def main():
    """Measure here what the script that is run claims, and print it; exit code 5: not all holds.

    Words name what is measured, or are arguments of it: ``write`` for write=True, ``periods=1e4``.
    """
    words, every = sys.argv[1:], {each.id.rpartition("/")[2]: each for each in CLAIMS.values()}
    pairs = (word.partition("=") for word in words if word not in every)
    given = {name: literal_eval(value) if value else True for name, _, value in pairs}
    failed = False
    for claimed in [every[word] for word in words if word in every] or every.values():
        some = given.keys() & signature(claimed.measure).parameters.keys()
        for row in claimed.rows(**{name: given[name] for name in some}):
            failed |= not row.passed
            told = row.failure or f"{row.measured:.3g} (bound {row.bound:.3g})"
            print(f"{VERDICTS[row.passed]:4} {row.statement}: {told}", flush=True)
    sys.exit(5 * failed)
