"""Conventions planted in trajectories of random tops: what `check` says of them.

The trajectories are exact, or by an integrator of their own: Runge and Kutta's of order four to
nine digits, or semi-implicit Euler's, five per cent off at the end. The plants share no code with
the package: they are made from the attitude and the angular velocity in the body.
"""

import warnings
from collections import Counter
from itertools import combinations, product

import numpy as np
from rigid import body_rates
from scipy.spatial.transform import Rotation
from tools import STATE, main, motion_of

import heavytop as ht
from heavytop.claims import proof

QUALITIES = ("exact", "order 4, nine digits", "order 1, five per cent")
SPAN, ROWS, HALVINGS, OFF = 6.0, 301, 12, 0.05
TIMES = np.linspace(0, SPAN, ROWS)

# --- integrators: a state is the rotation matrix, and below it the angular velocity in the body --


def start(scene):
    theta, phi, psi, *rates = numbers(scene.start, STATE).values()
    R = Rotation.from_euler("ZXZ", [phi, theta, psi]).as_matrix()
    return np.vstack([R, [float(x) for x in body_rates(theta, psi, *rates)]])


def numbers(thing, names):
    return {name: float(getattr(thing, name)) for name in names}


def cross(a, b):
    return hat(a) @ b


def hat(w):
    return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


def turn(w):
    """The rotation by a vector."""
    angle, k = float(np.sqrt(w @ w)), hat(w)
    return np.eye(3) + np.sin(angle) / angle * k + (1 - np.cos(angle)) / angle**2 * k @ k


class Physics:
    """Euler's equations in the body, right or wrong."""

    def __init__(self, scene, wrong=""):
        A, C, self.gMR = numbers(scene.top, TOP).values()
        if wrong == "inertia-about-centre":
            A = max(0.7 * A, 0.51 * C)
        if wrong == "gravity-sign":
            self.gMR = -self.gMR
        self.moments = np.array([A, A, C])
        self.gyroscopic = {"gyroscopic-sign": -1.0, "no-gyroscopic-term": 0.0}.get(wrong, 1.0)
        self.friction = 0.15 * C if wrong == "friction" else 0.0
        self.motor = wrong == "motor"

    def rates(self, y):
        return np.vstack([y[:3] @ hat(y[3]), self.acceleration(y)])

    def acceleration(self, y):
        g, w = y[2], y[3]  # the vertical in the body
        moment = self.gyroscopic * cross(self.moments * w, w)
        moment += [self.gMR * g[1], -self.gMR * g[0], -self.friction * w[2]]
        found = moment / self.moments
        if self.motor:
            found[2] = self.held(g, w, found)
        return found

    def held(self, g, w, wdot):
        """d/dt (phi' cos theta): a motor about the axis keeps psi' = w3 - phi' cos(theta)."""
        gdot, across = cross(g, w)[:2], g[:2] @ g[:2]
        phidot = w[:2] @ g[:2] / across
        slope = (wdot[:2] @ g[:2] + w[:2] @ gdot - phidot * 2 * (g[:2] @ gdot)) / across
        return float(slope * g[2] + phidot * cross(g, w)[2])


def runge_kutta(physics, y, h):
    k1 = physics.rates(y)
    k2 = physics.rates(y + h / 2 * k1)
    k3 = physics.rates(y + h / 2 * k2)
    k4 = physics.rates(y + h * k3)
    return y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


def euler(physics, y, h):
    w = y[3] + h * physics.acceleration(y)
    return np.vstack([y[:3] @ turn(h * w), w])


def integrate(scene, wrong, step, parts):
    """The states at each row, with so many steps between two."""
    physics, y = Physics(scene, wrong), start(scene)
    rows, h = [y], SPAN / (ROWS - 1) / parts
    for _ in range(ROWS - 1):
        for _ in range(parts):
            y = step(physics, y, h)
        rows.append(y)
    return np.array(rows)


def integrate_coarsely(scene, wrong):
    """By Euler's method, with steps halved until the axis is as near as it has to be."""
    parts, found = 1, integrate(scene, wrong, euler, 1)
    while parts < 2**HALVINGS:
        finer = integrate(scene, wrong, euler, 2 * parts)
        if 2 * abs(finer[:, :3, 2] - found[:, :3, 2]).max() <= OFF:
            break
        parts, found = 2 * parts, finer
    return found


def exact(scene):
    record = motion_of(scene).at(TIMES)
    R = Rotation.from_quat(np.roll(record.quaternion, -1, axis=1)).as_matrix()
    return np.concatenate([R, record.omega[:, None, :] @ R], axis=1)


def trajectory(scene, quality, wrong=""):
    """All columns of a trajectory of a quality."""
    if quality == QUALITIES[2]:
        return columns(integrate_coarsely(scene, wrong))
    if quality == QUALITIES[0] and not wrong:
        return columns(exact(scene))
    return columns(integrate(scene, wrong, runge_kutta, 16 if wrong else 8))


def columns(states):
    """Everything that people write of attitudes and angular velocities in the body."""
    R, w = states[:, :3], states[:, 3]
    theta = np.arctan2(np.hypot(R[:, 0, 2], R[:, 1, 2]), R[:, 2, 2])
    phi = np.unwrap(np.arctan2(R[:, 0, 2], -R[:, 1, 2]))
    psi = np.unwrap(np.arctan2(R[:, 2, 0], R[:, 2, 1]))
    s, c = np.sin(psi), np.cos(psi)
    thetadot = w[:, 0] * c - w[:, 1] * s
    phidot = (w[:, 0] * s + w[:, 1] * c) / np.sin(theta)
    psidot = w[:, 2] - phidot * np.cos(theta)
    angles = dict(zip(STATE, (theta, phi, psi, thetadot, phidot, psidot), strict=True))
    omega = np.einsum("nij,nj->ni", R, w)
    return {"t": TIMES, **angles, "axis": R[:, :, 2], "matrix": R, "omega_body": w, "omega": omega}


# --- plants ----------------------------------------------------------------------------------

FORMS = {
    "angles": STATE[:3],
    "angles and rates": STATE,
    "axis": ("axis",),
    "attitude": ("matrix",),
    "attitude and ω": ("matrix", "omega"),
    "attitude and ω in the body": ("matrix", "omega_body"),
}
ANGULAR = ("angles", "angles and rates")
VECTORS = ("axis", "attitude", "attitude and ω", "attitude and ω in the body")
SPINNING = tuple(FORMS)[1:2] + tuple(FORMS)[4:]
ATTITUDES = VECTORS[1:]
ALL = tuple(FORMS)
TOP = ("A", "C", "gMR")


def scaled(x, factor, *names):
    return x | {name: factor * x[name] for name in names if name in x}


def world(x, P, carried):
    """The same in a world whose axes are the rows of P, the body's too where it is carried."""
    B, sign = P.T if carried else np.eye(3), np.linalg.det(P) if carried else 1
    made = {
        "axis": lambda axis: axis @ P.T,
        "matrix": lambda R: P @ R @ B,
        "omega": lambda omega: np.linalg.det(P) * omega @ P.T,
        "omega_body": lambda omega: sign * omega @ B,
    }
    return x | {name: made[name](x[name]) for name in made if name in x}


Y_UP = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
Z_DOWN = np.diag([1, -1, -1])
PERMUTED = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
MIRROR = np.diag([1, -1, 1])


def with_spin(x, every):
    s, psi = np.sin(every["theta"]), every["psi"]
    return x | {"axis": np.stack([s * np.sin(psi), s * np.cos(psi), np.cos(every["theta"])], 1)}


def exchanged(x):
    pairs = {"phi": "psi", "psi": "phi", "phidot": "psidot", "psidot": "phidot"}
    return x | {a: x[b] for a, b in pairs.items() if a in x}


def frame(x):
    names = {"omega": "omega_body", "omega_body": "omega"}
    return {names.get(name, name): value for name, value in x.items()}


def scalar_last(x):
    """With quaternions for matrices, x, y, z, w, continued from row to row."""
    q = Rotation.from_matrix(x["matrix"]).as_quat()
    same = np.sum(q[1:] * q[:-1], axis=1) > 0
    q[1:] *= np.cumprod(np.where(same, 1, -1))[:, None]
    return {name: value for name, value in x.items() if name != "matrix"} | {"quaternion": q}


def origin(x, phi, psi):
    world_turn, body_turn = (Rotation.from_euler("Z", a).as_matrix() for a in (phi, psi))
    found = world(x, world_turn, False)
    found |= {n: found[n] @ body_turn for n in ("matrix", "omega_body") if n in x}
    return found | {n: x[n] + a for n, a in (("phi", phi), ("psi", psi)) if n in x}


def in_unit_of_time(x, seconds, rng):
    """The times in another unit, and the rates too, or not."""
    rates = (*STATE[3:], "omega", "omega_body") if rng.random() < 0.5 else ()
    return scaled(scaled(x, 1 / seconds, "t"), seconds, *rates)


# Of each convention: the forms of data that it may be planted in, and the plant. They are planted
# in this order: a unit comes last, and an origin is one of the package's angles.
PLANTS = {
    "axis-with-spin": (("axis",), lambda x, every, **_: with_spin(x, every)),
    "spin-origin": ((*ANGULAR, *ATTITUDES),
                    lambda x, rng, **_: origin(x, 0, rng.uniform(0.3, 2.8))),
    "azimuth-origin": (ALL, lambda x, rng, **_: origin(x, rng.uniform(0.3, 2.8), 0)),
    "mirrored": (VECTORS, lambda x, **_: world(x, MIRROR, True)),
    "axes-permuted": (VECTORS, lambda x, rng, **_: world(x, PERMUTED, rng.random() < 0.5)),
    "z-down": (VECTORS, lambda x, **_: world(x, Z_DOWN, False)),
    "y-up": (VECTORS, lambda x, rng, **_: world(x, Y_UP, rng.random() < 0.5)),
    "from-below": (ANGULAR, lambda x, **_: scaled(x, -1, "thetadot")
                   | {"theta": np.pi - x["theta"]}),
    "elevation": (ANGULAR, lambda x, **_: scaled(x, -1, "thetadot")
                  | {"theta": np.pi / 2 - x["theta"]}),
    "exchanged-angles": (ANGULAR, lambda x, **_: exchanged(x)),
    "inverse-rotation": (ATTITUDES, lambda x, **_: x | {"matrix": x["matrix"].swapaxes(1, 2)}),
    "omega-sign": (ATTITUDES[1:], lambda x, **_: scaled(x, -1, "omega", "omega_body")),
    "omega-body": (ATTITUDES[1:], lambda x, **_: frame(x)),
    "quaternion-xyzw": (ATTITUDES, lambda x, **_: scalar_last(x)),
    "rpm": (ANGULAR[1:], lambda x, **_: scaled(x, 30 / np.pi, "thetadot", "phidot", "psidot")),
    "degrees": (ANGULAR, lambda x, **_: scaled(x, 180 / np.pi, *FORMS["angles and rates"])),
    "time-scale": (ALL, lambda x, rng, **_: x | {"t": x["t"] * rng.choice([0.5, 2])}),
    **{name: (ALL, lambda x, rng, seconds=seconds, **_: in_unit_of_time(x, seconds, rng))
       for name, seconds in (("milliseconds", 1e-3), ("minutes", 60), ("hours", 3600))},
    "spin-sign": (ALL, None), "spin-held": (ALL, None), "gravity-sign": (ALL, None),
    "gyroscopic-sign": (ALL, None), "no-gyroscopic-term": (ALL, None),
    "inertia-about-centre": (ALL, None), "motor": (SPINNING, None), "friction": (SPINNING, None),
}  # fmt: skip
PHYSICS = tuple(name for name, (_, plant) in PLANTS.items() if plant is None)


def random_scene(rng):
    """A top and a start of ordinary size."""
    A = rng.uniform(0.5, 2)
    top = ht.Top(A, A * rng.uniform(0.1, 1.9), rng.uniform(0.5, 5))
    rates = {name: rng.uniform(-3, 3) for name in ("thetadot", "phidot", "psi", "phi")}
    return ht.Scene(
        top, ht.State(rng.uniform(0.2, 2.8), psidot=rng.uniform(2, 9), **rates), time=SPAN
    )


def changed(scene, name):
    """The scene whose start has the other spin."""
    values = numbers(scene.start, STATE)
    spin = values.pop("psidot")
    spins = {"spin-sign": {"psidot": -spin}, "spin-held": {"omega3": spin}}
    return ht.Scene(scene.top, ht.State(**values, **spins[name]), time=SPAN)


def planted(scene, quality, names, rng):
    """The columns of a trajectory with the conventions planted, or None where they cannot be."""
    physics = [name for name in names if name in PHYSICS]
    forms = [form for form in ALL if all(form in PLANTS[name][0] for name in names)]
    if len(physics) > 1 or not forms:
        return None
    form = forms[rng.integers(len(forms))]
    wrong, made = physics[0] if physics else "", scene
    if wrong in ("spin-sign", "spin-held"):
        wrong, made = "", changed(scene, wrong)
    every = trajectory(made, quality, wrong)
    if not all(np.isfinite(x).all() for x in every.values()):
        return None  # a motor has no bound where the axis is vertical
    x = {name: every[name] for name in ("t", *FORMS[form])}
    for name in PLANTS:
        if name in names and name not in PHYSICS:
            x = PLANTS[name][1](x, rng=rng, every=every)
    return x, form


def verdict(data, scene, names):
    """Whether the names are named, in part or as one of several; or none is, or a wrong one."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = ht.check(data, scene).document()
    sure = {each["name"] for each in found["conventions"]}
    others = [set(each["names"]) for each in found["alternatives"]]
    said = f"{sorted(sure)} or {[sorted(x) for x in others]}"
    if sure - {*names}:
        return "wrong", said
    if sure == {*names}:
        return "named", said
    if others:
        return "ambiguous", said
    return ("in part", said) if sure else ("none", said)


# Each yields what was planted, the quality, the form, the verdict and what is said.


def judged(names, quality, rng):
    """The verdict of conventions in a random scene, if they can be planted there."""
    scene = random_scene(rng)
    if (made := planted(scene, quality, names, rng)) is not None:
        what = " and ".join(names) or "nothing"
        yield what, quality, made[1], *verdict(made[0], scene, names)


def singles(seed, scenes):
    """Of each convention, quality and scene."""
    for name, quality, k in product(PLANTS, QUALITIES, range(scenes)):
        yield from judged((name,), quality, np.random.default_rng([seed, k, *map(ord, name)]))


def pairs(seed, count):
    """Of random pairs in random scenes and qualities."""
    possible, rng = [*combinations(PLANTS, 2)], np.random.default_rng(seed)
    while count:
        names = possible[rng.integers(len(possible))]
        for found in judged(names, QUALITIES[rng.integers(3)], rng):
            count -= 1
            yield found


def good(seed, count):
    """Of good data."""
    rng = np.random.default_rng(seed)
    for k in range(count):
        yield from judged((), QUALITIES[k % 3], rng)


def other(scene, name, part):
    """The trajectory of a problem in which one number, or all, are others than the scene's."""
    top, start = numbers(scene.top, TOP), numbers(scene.start, STATE)
    if name in top:
        top[name] *= 1 + part
    if name in start:
        start[name] *= -1 if name in ("thetadot", "phidot") else 1 + part / 2
    top["C"] = min(top["C"], 2 * top["A"])
    every = trajectory(ht.Scene(ht.Top(**top), ht.State(**start), time=SPAN), QUALITIES[0])
    if name == "the first row":
        return {x: values[: -ROWS // 6] if x == "t" else values[ROWS // 6 + 1 :]
                for x, values in every.items()}  # fmt: skip
    if name == "the clock":
        every["t"] = every["t"] * (1 + part / 3)
    if name == "a constant ψ̇":
        every["psi"] = start["psi"] + every["t"] * start["psidot"]
    return every


OTHERS = ("A", "C", "gMR", "theta", "thetadot", "phidot", "psidot", "the first row", "the clock",
          "a constant ψ̇", "everything")  # fmt: skip


def others(seed, count):
    """Of data of another problem than the scene's, which no convention makes right."""
    for k in range(count):
        name = OTHERS[k % len(OTHERS)]
        rng = np.random.default_rng([seed, k])
        scene, part = random_scene(rng), rng.choice([-0.3, 0.1, 0.3])
        if name == "A":  # a smaller one is that about the centre of mass
            part = abs(part)
        every = other(random_scene(rng) if name == "everything" else scene, name, part)
        form = ANGULAR[0] if name == "a constant ψ̇" else ALL[rng.integers(len(ALL))]
        data = {x: every[x] for x in ("t", *FORMS[form])}
        yield name, QUALITIES[0], form, *verdict(data, scene, ())


def counted(found):
    """How often each verdict is given, and the wrong ones."""
    counts = Counter()
    wrong = []
    for name, quality, form, said, words in found:
        counts[name, quality, said] += 1
        if said == "wrong":
            wrong.append(f"{name}, {quality}, {form}: {words}")
    return counts, wrong


# --- what is claimed -------------------------------------------------------------------------


@proof
def conventions(seed=0, part=1):
    """No wrong name is sure, of one in `part` of all cases."""
    # Another start, such as one whose φ̇ has the other sign, may be the same as several conventions.
    for what, found, share in (
        ("planted alone", singles(seed, 20 // part), 0),
        ("planted in pairs", pairs(seed, 300 // part), 0),
        ("good data", good(seed, 300 // part), 0),
        ("another problem", others(seed, 330 // part), 0.02),
    ):
        counts, wrong = counted(found)
        print(*wrong, *counts.items(), sep="\n")
        cases = counts.total()
        yield f"{what}: {cases} cases, a wrong name stated as sure", len(wrong), share * cases


if __name__ == "__main__":
    main()
