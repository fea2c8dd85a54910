"""The Lie-group heavy-top benchmark (Geradin & Cardona; Bruls, Cardona & Arnold 2012).

The benchmark as it is stated, symmetry axis along the body's y, is integrated by rigid.py, which is
ours; against that stand our closed form, our run, and what others have printed (PROVENANCE.md).
"""

from functools import cache

from rigid import Body, attitudes_apart, conjugate, farthest, mp, mpf, times
from tools import EULER, most, motion_of

import heavytop as ht
from heavytop.claims import Authority, claim

LIE_GROUP = Authority(
    "the Lie-group heavy-top benchmark (Géradin & Cardona; Brüls, Cardona & Arnold 2012), "
    "integrated by our rigid.py",
    "ours",
)
EXUDYN = Authority("EXUDYN's printed solutions of the Lie-group benchmark", "printed")
KYNEMA = Authority("Kynema's reference solution of the Lie-group benchmark", "printed")


TIMES = ("0.01", "0.2", "1", "2", "10")
NEAREST = "-106.16380414311477"  # RK67, steps of 2e-5: the nearest of those printed
FIRST = "149.8473939540758"  # t = 0.01, "converged to 14 digits"
PRINTED = {  # every other value of omega_y, too
    "2": (
        "-106.16651966441937",  # its solver in Python
        "-106.16651966442174", "-106.16380619750855", "-106.163804141195",  # RK44
        "-106.16380495843258", "-106.1638041430917", "-106.16380414217615",  # RK67
        NEAREST, "-106.16380414096614",  # RK67
        "-106.1628865531392", "-106.16380001820764", "-106.16380410174922",  # ODE23
        "-106.16368051203796", "-106.16380356935012", "-106.16380413741084",  # DOPRI5
        "-106.16380414306643",
    ),
    "0.01": (
        FIRST, "149.84738885863888", "149.85635042397638", "149.8473836771092",
        "149.84739395298053", "149.84739395407394", "149.89507599262697", "149.88651478249065",
    ),
}  # fmt: skip
DISPLACED = ("-0.150416985652933", "-1.724164450779749", "-0.673023460701136")  # from (0, 1, 0)
QUATERNION = ("0.122947275600560", "-0.491079359219981", "0.350430794926147", "-0.787986857972906")


@cache
def exact():
    """The benchmark at its times: axis, angular velocity in space, quaternion."""
    body = Body(
        ("15.234375", "0.46875", "15.234375"), "147.15", (0, 1, 0),
        (1, 0, 0, 0), ("0", "150", "-4.61538"),
    )  # fmt: skip
    return {t: (at.axis, at.omega, at.q) for t, at in zip(TIMES, body.at(TIMES), strict=True)}


@cache
def run():
    return ht.propagate(ht.load_scene("lie-group-benchmark", ["span.time=10"]))


def our_quaternion(t):
    """Our attitude with the benchmark's body axes: R(0) = 1 there."""
    now, start = (map(mpf, run()(x).quaternion.tolist()) for x in (t, 0.0))
    return times(now, conjugate(start))


@claim(EULER, 4e-39, "2^-140 = 7e-43 in each of some hundred steps of rigid.py", "closed form")
def lie_closed_form():
    """axis at the benchmark's five times vs Euler's equations."""
    motion = motion_of("lie-group-benchmark")
    return most(farthest(motion.at(mp.mpf(t), 45).axis, exact()[t][0]) for t in TIMES)


SOON = "rounding of the axis over a few hundred steps, ten times"
LATE = "rounding of the axis over a thousand steps, ten times; φ has grown"


@claim(LIE_GROUP, 4e-14, LATE, "integrator", name="lie-axis-10", of=("10",))
@claim(LIE_GROUP, 4e-15, SOON, "integrator", name="lie-axis-2", of=("2",))
def axis_of_the_run(t):
    """axis of the run, at the benchmark's times up to {0} s, vs exact, by rigid.py."""
    early = TIMES[: TIMES.index(t) + 1]
    return most(farthest(run()(float(x)).axis.tolist(), exact()[x][0]) for x in early)


@claim(LIE_GROUP, 4e-12, "rounding of 150 rad/s over the same steps, ten times", "integrator")
def lie_omega():
    """angular velocity of the run in space at five times vs exact, by rigid.py [rad/s]."""
    return most(farthest(run()(float(t)).omega.tolist(), exact()[t][1]) for t in TIMES)


@claim(LIE_GROUP, 4e-14, LATE, "integrator")
def lie_quaternion():
    """quaternion of the run at five times vs exact, by rigid.py."""
    return most(attitudes_apart(our_quaternion(float(t)), exact()[t][2]) for t in TIMES)


def beside(t):
    """Our distance from exact omega_y over that of the nearest that is printed."""
    truth = exact()[t][1][1]
    theirs = (abs(mpf(value) - truth) for value in PRINTED[t])
    return abs(mpf(float(run()(float(t)).omega[1])) - truth) / min(theirs)


@claim(EXUDYN, 1.2e-11, "the reference's own error, 1.0e-11 by rigid.py", "integrator")
def exudyn_omega_2():
    """ω_y at t = 2 s vs the value printed for RK67 with steps of 2e-5 [rad/s]."""
    return abs(mpf(float(run()(2.0).omega[1])) - mpf(NEAREST))


@claim(EXUDYN, 2e-12, "the reference's own error, 1.3e-12 by rigid.py", "integrator")
def exudyn_omega_0_01():
    """ω_y at t = 0.01 s vs the value printed as converged to 14 digits [rad/s]."""
    return abs(mpf(float(run()(0.01).omega[1])) - mpf(FIRST))


@claim(EXUDYN, 0.05, "rounding of 106 rad/s, thirty times, over their 1.0e-11", "integrator")
def exudyn_beside():
    """our error in ω_y (exact: rigid.py) at t = 2 s over the least of 16 that EXUDYN prints."""
    return beside("2")


@claim(EXUDYN, 0.5, "rounding of 150 rad/s, nine times, over their 5.2e-13", "integrator")
def exudyn_first_beside():
    """our error in ω_y (exact: rigid.py) at t = 0.01 s over the least of 8 that EXUDYN prints."""
    return beside("0.01")


def printed_axis():
    return [mpf(x) + y for x, y in zip(DISPLACED, (0, 1, 0), strict=True)]


@claim(KYNEMA, 1.3e-6, "the reference's own error, 1.2e-6 by rigid.py", "integrator")
def kynema_axis():
    """axis at t = 2 s vs the printed displacement."""
    return farthest(run()(2.0).axis.tolist(), printed_axis())


@claim(KYNEMA, 9e-7, "the reference's own error, 7.6e-7 by rigid.py", "integrator")
def kynema_attitude():
    """attitude at t = 2 s vs the printed quaternion."""
    return attitudes_apart(our_quaternion(2.0), [mpf(x) for x in QUATERNION])


@claim(KYNEMA, 1e-8, "rounding of the axis, fifty times, over their 1.2e-6", "integrator")
def kynema_beside():
    """our error of the axis (exact: rigid.py) at t = 2 s over Kynema's."""
    truth = exact()["2"][0]
    return farthest(run()(2.0).axis.tolist(), truth) / farthest(printed_axis(), truth)
