"""CyRK's DOP853 as a march: compiled steps over a compiled right-hand side.

CyRK gives no solver to step by hand, but stops after ``max_num_steps`` and keeps every step it
took: so a block is a call with a bound in time that it does not reach and a fixed number of steps,
which also bounds its memory. CyRK does not say which step it would take next; the next block
starts with the length of the last one. A look at a time between two steps is a call from the step
before it to that time.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from heavytop.comparison.equations import constants, derivatives, later, values
from heavytop.comparison.march import Array, Place, Stopped
from heavytop.equations.formulation import Formulation
from heavytop.numbers.double_double import DoubleDouble, add

_STEPS = 1000
_MEGABYTES = 2000  # CyRK's own bound; a block takes a thousandth of it
_FAR = 2.0**40  # a bound in time [s] that no block reaches


def cyrk_march(
    equations: Formulation,
    start: tuple[float, ...],
    parameters: Mapping[str, float],
    tolerance: float,
    direction: int,
    steps: int | None,
) -> CyRKMarch:
    """Return the march of CyRK's DOP853."""
    began = time.perf_counter()
    compiled = _compiled(equations)
    return CyRKMarch(
        right_hand_side=compiled,
        start=start,
        parameters=values(equations, parameters),
        tolerance=tolerance,
        direction=direction,
        steps=_STEPS if steps is None else steps,
        compile_s=time.perf_counter() - began,
    )


@dataclass(frozen=True, slots=True, eq=False)
class CyRKMarch:
    """A march of CyRK's DOP853.

    Attributes
    ----------
    right_hand_side : numba cfunc
        The derivatives; kept here, since CyRK knows only its address.
    start : tuple of float
        The states at the start.
    parameters : tuple of float
        The constants of the derivatives.
    tolerance : float
        Relative and absolute; CyRK keeps the relative one above 2.2e-14.
    direction : int
        1 forwards, -1 backwards.
    steps : int
        Steps in a block.
    compile_s : float
        What compiling took [s]; next to nothing where it was done before.
    """

    right_hand_side: Any
    start: tuple[float, ...]
    parameters: tuple[float, ...]
    tolerance: float
    direction: int
    steps: int
    compile_s: float

    def begin(self) -> Place:
        """Return the place at the start, time 0."""
        return Place((0.0, 0.0), self.start)

    def block(self, place: Place) -> Place:
        """Take a block of steps."""
        times, states, evaluations = self._block(place)
        return Place(
            time=later(place.time, float(times[-1])),
            state=tuple(states[-1].tolist()),
            carry=(abs(float(times[-1] - times[-2])),),
            steps=place.steps + self.steps,
            evaluations=place.evaluations + evaluations,
        )

    def seen(self, place: Place, times: Sequence[DoubleDouble]) -> Array:
        """Return the states at times in the block after a place: a call aside for each.

        Raises
        ------
        ValueError
            A time is not in the block.
        """
        local = [add(t, (-place.time[0], -place.time[1]))[0] for t in times]
        ends, states, _ = self._block(place)
        rows = np.empty((len(local), len(self.start)))
        for i, t in enumerate(local):
            if not 0 <= self.direction * t <= self.direction * ends[-1]:
                raise ValueError("a time is outside the block")
            last = int(np.searchsorted(self.direction * ends, self.direction * t, "right")) - 1
            rows[i] = states[last] if t == ends[last] else self._to(states[last], t - ends[last])
        return rows

    def offered(self, t: float) -> DoubleDouble:
        """Return t itself."""
        return t, 0.0

    def _block(self, place: Place) -> tuple[Array, Array, int]:
        first = place.carry[0] if place.carry else 0.0
        far = self.direction * _FAR
        times, states, evaluations = self._called(np.array(place.state), far, first, self.steps)
        if len(times) < self.steps + 1:
            raise Stopped("the solver gave up: its step vanished, or its numbers are not finite")
        return times, states, evaluations

    def _to(self, state: Array, t: float) -> Array:
        times, states, _ = self._called(state, t, 0.0, _STEPS)
        if times[-1] != t:
            raise Stopped("the solver gave up between two steps")
        return states[-1]  # type: ignore[no-any-return]

    def _called(
        self, state: Array, end: float, first: float, steps: int
    ) -> tuple[Array, Array, int]:
        times, states, evaluations = _solved(
            self.right_hand_side.address, state, end, self.parameters, self.tolerance, first, steps
        )
        if not np.isfinite(states).all():
            raise Stopped("the numbers are no longer finite")
        return times, states, evaluations


def _solved(
    address: int,
    state: Array,
    end: float,
    parameters: Sequence[float],
    tolerance: float,
    first: float,
    steps: int,
) -> tuple[Array, Array, int]:
    """Return times (k,), states (k, n) of the steps from time 0, and the evaluations.

    What CyRK's `nbsolve2_ivp` does, which takes seconds to compile and says less.
    """
    from CyRK.nb import numba_solver as api

    state = np.ascontiguousarray(state)
    known = np.array([*parameters, 0.0])  # the last counts the evaluations
    rtol, atol = np.array([tolerance]), np.array([tolerance])
    solution = api.c_numba_cysolve_ivp(
        address,
        0.0,
        end,
        state.ctypes.data,
        state.size,
        api.find_ode_method_int("DOP853"),
        steps + 1,  # states to make room for
        0,  # extra outputs
        known.ctypes.data,
        known.nbytes,
        steps,
        _MEGABYTES,
        False,  # dense output
        None,  # times to interpolate at
        0,
        None,  # what runs before an evaluation
        None,  # events
        0,
        rtol.ctypes.data,
        rtol.size,
        atol.ctypes.data,
        atol.size,
        float("inf"),  # the longest step
        first,
        True,  # keeps the solver, and with it the count
    )
    if not solution:
        raise Stopped("the solver could not be set up")
    try:
        size = api.c_get_size(solution)
        if size == 0:
            raise Stopped("the solver gave up at its start")
        times = np.ctypeslib.as_array(api.c_get_t_ptr(solution), (size,)).copy()
        states = np.ctypeslib.as_array(api.c_get_y_ptr(solution), (size, state.size)).copy()
        counted = np.ctypeslib.as_array(api.c_get_args_ptr(solution), (known.nbytes,))
        return times, states, int(counted.view(np.float64)[-1])
    finally:
        api.c_free(solution)


@cache
def _compiled(equations: Formulation) -> Any:
    """Return the derivatives as a C function; the last of its arguments counts the calls."""
    from CyRK import cyjit
    from numba import carray, njit
    from numba.np.unsafe.ndarray import to_fixed_tuple

    n, k = len(equations.states), len(constants(equations))
    rates = njit(error_model="numpy")(derivatives(equations))  # 1/0 is inf; nothing is raised there

    def at(dy: Any, t: float, y: Any, arguments: Any) -> None:
        known = carray(arguments, (k + 1,))
        result = rates(*to_fixed_tuple(carray(y, (n,)), n), *to_fixed_tuple(known[:k], k))
        for i in range(n):
            dy[i] = result[i]
        known[k] += 1

    return cyjit(at)
