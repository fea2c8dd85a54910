"""Methods of one's own: how they are named, loaded and run, and how what goes wrong is named."""

import math
import sys
import warnings
from types import SimpleNamespace

import numpy as np
import pytest

from heavytop.comparison import IntegrationFailed, user
from heavytop.comparison.steppers import MethodError, TopConstants
from heavytop.errors import Impossible

from ..integrators import dop853, midpoint_on_rotations, raises, rk4
from .kicked import SPAN, axis_error, set_up

FILE = """
import numpy as np
from beside import factor

def euler(f, y, h):
    return y + factor * h * f(y)
"""


@pytest.mark.parametrize(("method", "order", "steps"), [
    *((user.Method(rk4, formulation=x), 4, 200) for x in ("axis", "lagrange", *user.BODY_FORMS)),
    (user.Method(midpoint_on_rotations, formulation="rotation"), 2, 800),
])  # fmt: skip
def test_a_step_has_its_order_in_every_form(method, order, steps):
    errors = [axis_error(set_up(method, n), SPAN) for n in (steps, 2 * steps)]
    assert errors[1] < 0.02
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.6)


def test_a_compiled_step_has_the_bits_of_the_plain_one():
    compiled = user.Method(pytest.importorskip("numba").njit(rk4), name="compiled")
    plain, fast = (set_up(m, 100, steps=300) for m in (user.Method(rk4), compiled))
    assert fast.block(fast.begin()).state == plain.block(plain.begin()).state


def test_what_a_body_form_says_of_itself_follows_from_its_own_states():
    """Momenta and energy against matrices in numpy, of states that are no motion's at all."""
    form = set_up(user.Method(rk4, formulation="rotation"), 100).form
    g, inertia = form.constants
    R, w = np.random.default_rng(1).normal(size=(3, 3)), np.array([0.3, -2.0, 5.0])
    u, udot, energy, p_phi, p_psi, length, off, *axis = form.observe([*R.ravel(), *w], math.sqrt)
    space = R @ np.diag([1, 1, inertia]) @ w
    kinetic = w @ np.diag([1, 1, inertia]) @ w / 2 - inertia * form.omega3**2 / 2
    hat = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    assert (u, *axis) == (R[2, 2], *R[:, 2])
    assert udot == pytest.approx((R @ hat)[2, 2])
    assert energy == pytest.approx(kinetic + g * R[2, 2])
    assert (p_phi, p_psi) == pytest.approx((space[2], inertia * w[2]))
    assert length == pytest.approx(R[:, 2] @ R[:, 2])  # as of the axis form
    assert off == pytest.approx(np.linalg.norm(R.T @ R - np.eye(3)))


def test_a_step_and_a_solver_may_read_the_top():
    found = {}

    def step(f, y, h):
        found["step"] = f.top
        return rk4(f, y, h)

    def solver(fun, *given, t_eval, **options):
        found["solver"] = fun.top
        return dop853(fun, *given, t_eval=t_eval, **options)

    top = TopConstants(2.0, 1.0, 3.0)
    for method, setting in ((step, 100), (user.Method(solver, solver=True), 1e-6)):
        set_up(method, setting, top=top)
    assert found["step"] is found["solver"] is top


class Foreign(list):
    """An array that only its own library reads, as those are that JAX traces."""

    def __array_namespace__(self):
        return SimpleNamespace(stack=Foreign)

    def __array__(self, *_, **__):
        raise TypeError("traced")


def test_a_step_may_compute_in_its_states_or_in_arrays_of_another_library():
    def in_place(f, y, h):
        y += h * f(y)
        return y

    steps = [in_place, lambda f, y, h: y + h * f(y)]
    steps.append(lambda f, y, h: y + h * np.array(list(f(Foreign(y)))))
    assert len({axis_error(set_up(step, 100), SPAN) for step in steps}) == 1


def test_a_solver_is_as_good_as_its_tolerance_and_blocks_lead_on_from_what_is_stored():
    tight, loose = (axis_error(set_up(dop853, setting), SPAN) for setting in (1e-11, 1e-5))
    assert tight < 1e-9 < loose < 1e-1
    for method, setting in ((rk4, 100), (dop853, 1e-8)):
        stepper = set_up(method, setting)
        first = stepper.block(stepper.begin())
        assert set_up(method, setting).block(first) == stepper.block(first)


# --- what goes wrong is named --------------------------------------------------------------------


def loses(fun, t_span, y0, **_):
    return SimpleNamespace(t=[*t_span], y=np.array([y0, y0 * np.nan]).T)


def stops(fun, t_span, y0, **_):
    return SimpleNamespace(t=[0.0, t_span[1] / 2], y=np.array([y0, y0]).T, message="too stiff.")


@pytest.mark.parametrize(("function", "setting", "said"), [
    (raises, 100, "it raises ValueError: no step"),
    (lambda f, y, h: sys.exit(3), 100, "it raises SystemExit: 3"),
    (lambda f, y, h: y[:2], 100, r"it returns an array of shape \(2,\), not \(5,\)"),
    (lambda f, y, h: None, 100, "it returns numbers of type object, not reals"),
    (lambda f, y, h: y + 1j, 100, "it returns numbers of type complex128, not reals"),
    (lambda f, y, h: y * np.nan, 100, "it returns nan"),
    (lambda f, y, h: y * 1e9, 100, "the numbers are no longer finite"),
    (stops, 1e-2, "it stops after .* s: too stiff"),
    (loses, 1e-2, "the numbers are no longer finite"),
])  # fmt: skip
def test_what_a_method_does_wrong_is_named(function, setting, said):
    stepper = set_up(function, setting)
    with pytest.raises(IntegrationFailed, match=said) as failed:
        stepper.block(stepper.begin())
    assert isinstance(failed.value, MethodError) == said.startswith(("it raises", "it ret"))


def test_the_first_call_whose_result_is_dropped_warns_nobody(recwarn):
    def step(f, y, h):
        warnings.warn("near a pole", stacklevel=1)
        return rk4(f, y, h)

    def solver(fun, t_span, y0, **options):
        warnings.warn("stiff", stacklevel=1)
        return dop853(fun, t_span, y0, **options)

    for method, setting, count in ((step, 100, 200), (solver, 1e-6, 1)):
        stepper = set_up(method, setting)
        assert not stepper.warned
        stepper.block(stepper.begin())
        assert [*stepper.warned.values()] == [count]
    assert not recwarn.list


# --- how a method is had -------------------------------------------------------------------------


@pytest.fixture
def file(tmp_path):
    (tmp_path / "beside.py").write_text("factor = 1.0\n")
    path = tmp_path / "mine.py"
    path.write_text(FILE)
    yield path
    sys.modules.pop("beside", None)


@pytest.mark.parametrize(("text", "fault"), {
    "nowhere.py:rk4": "there is no such file",
    "mine.py:rk5": "has no 'rk5'",
    "bad.py:rk4": "raises SystemExit: 7",
    "no_such_module:rk4": "raises ModuleNotFoundError",
    "mine.py:np": "must be a function",
}.items())  # fmt: skip
def test_what_cannot_be_loaded_is_told(file, text, fault, monkeypatch):
    file.with_name("bad.py").write_text("raise SystemExit(7)\n")
    monkeypatch.chdir(file.parent)
    with pytest.raises(Impossible, match=fault):
        user.register(text)


@pytest.mark.parametrize("setting", [0, -1.0, np.inf, "1e-9", 10**400])
def test_a_setting_is_a_positive_number_and_an_order_a_small_one(setting):
    with pytest.raises(Impossible, match=r"formulation: .*\nsetting: .*\norder"):
        user.Method(rk4, formulation="x", setting=setting, order=setting)


def test_a_step_that_wants_the_time_too_is_refused():
    assert user.Method(lambda f, y, h, half=0.5: y).label
    with pytest.raises(Impossible, match="a step takes f, y and h alone"):
        user.Method(lambda f, t, y, h: y)


def test_another_process_loads_the_same_file_or_none(file):
    name = user.register(f"{file}:euler")
    origins = user.origins([name])
    user.load(origins)
    file.write_text(FILE + "\n# changed\n")
    user._REGISTERED.pop(name)
    with pytest.raises(Impossible, match="another file"):
        user.load(origins)
