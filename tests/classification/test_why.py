"""The numbers of a reason against their definitions, at 300 digits; and what is said to be zero."""

import re

import numpy as np
import pytest

from heavytop import Kind, State, Top, classify, load_scene
from heavytop.classification.kinds import KIND_DETAILS, RULES

from ..motions import FURTHER, MOTIONS, SCENES, named
from ..starts import CTX, nasty, regular, top_and_state

CLAUSE = re.compile(
    r"(?P<symbol>.+) = (?P<value>−?[\d.e+-]+)(?: (?P<unit>[^<>(]+?))?(?: (?P<side>[<>]) 0)?"
)


def table(top, start):
    """Of each symbol the number, of 300 digits, and its unit."""
    given = (top.A, top.C, top.gMR, start.theta, start.thetadot, start.phidot, start.omega3)
    A, C, g, theta, thetadot, phidot, omega3 = (x.mpf(CTX) for x in given)
    s, u, p_psi = CTX.sin(theta), CTX.cos(theta), C * omega3
    p_phi = A * phidot * s**2 + p_psi * u
    E = A * (thetadot**2 + phidot**2 * s**2) / 2 + g * u  # E′
    momentum, energy = "kg m²/s", "J"
    known = {
        "gMR": (g, energy), "θ̇": (thetadot, ""),
        "θ̇² + φ̇² sin² θ": (thetadot**2 + phidot**2 * s**2, ""), "sin θ": (s, ""),
        "φ̇ sin θ": (phidot * s, ""),
        "p_ψ": (p_psi, momentum), "gMR cos θ": (g * u, energy),
        "p_φ − p_ψ": (p_phi - p_psi, momentum), "p_φ + p_ψ": (p_phi + p_psi, momentum),
        "|p_φ| − |p_ψ|": (abs(p_phi) - abs(p_psi), momentum),
        "E′ − gMR": (E - g, energy), "E′ + gMR": (E + g, energy),
        "E′ − |gMR|": (E - abs(g), energy),
        "A cos θ φ̇² − p_ψ φ̇ + gMR": (A * u * phidot**2 - p_psi * phidot + g, energy),
        "|cos θ| (A φ̇² |cos θ| − |gMR|)": (
            abs(u) * (A * phidot**2 * abs(u) - abs(g)), energy),
        "p_ψ² − 4A |gMR|": (p_psi**2 - 4 * A * abs(g), "kg² m⁴/s²"),
    }  # fmt: skip
    if p_psi:
        known["E′ − gMR p_φ/p_ψ"] = E - g * p_phi / p_psi, energy
    return known


def held(top, start):
    """Hold the clauses of a reason to their definitions; give the kind and the symbols."""
    verdict, known, symbols = classify(top, start), table(top, start), set()
    assert verdict.certified
    for part in re.split(r"; | and |: |, ", verdict.why.replace(" (proved)", "")):
        if not (clause := CLAUSE.fullmatch(part)):
            assert "=" not in part
            continue
        truth, unit = known[clause["symbol"]]
        symbols.add(clause["symbol"])
        if clause["value"] == "0":
            assert abs(truth) < CTX.mpf(10) ** -200
            assert "(proved)" in verdict.why
            continue
        assert abs(CTX.mpf(clause["value"].replace("−", "-")) / truth - 1) < 6e-4, part
        assert clause["unit"] == unit
        assert clause["side"] in (None, "<" if truth < 0 else ">")
    return str(verdict.kind), symbols


def test_the_numbers_of_every_kind_are_those_of_their_definitions():
    motions = [named(each) for each in MOTIONS | FURTHER]
    scenes = [load_scene(name) for name in SCENES]
    found = [held(each.top, each.start) for each in (*motions, *scenes)]
    assert {kind for kind, _ in found} == {*map(str, Kind)} - {"undecided"}
    shown = {number for rule in RULES for number in (*rule.zeros, *(x for x, _ in rule.shown))}
    shown |= {detail.shown for detail in KIND_DETAILS.values()}
    assert set.union(*(symbols for _, symbols in found)) == {number.symbol for number in shown}
    assert all(symbols for _, symbols in found)


@pytest.mark.parametrize("seed", [3, 4])
def test_random_tops_have_the_numbers_of_their_definitions(seed):
    random = np.random.default_rng(seed)
    for numbers in (regular(random, 60), nasty(random, 120, "psidot")):
        for row in zip(*(each.tolist() for each in numbers.values()), strict=True):
            held(*top_and_state(dict(zip(numbers, row, strict=True))))


@pytest.mark.parametrize("off", ["1e-30", "-1e-30", "1e-200"])
def test_a_number_however_small_has_its_digits_and_its_sign(off):
    """A kick of 1e-30 rad/s: the energy to spare is 1e-32 J, not a rounding error of 1e-17."""
    kind, symbols = held(Top("3.28e-4", "6.6e-5", "0.0456"), State("0.1", phidot=off, psidot=140))
    assert kind == ("loops" if off.startswith("-") else "waves")
    assert "E′ − gMR p_φ/p_ψ" in symbols
