"""First-order equations as heyoka takes them: derived ones, and those a fold integrates.

heyoka holds the error of a step against one number, the largest state. An axis is of the size of
one whatever the top does; the angular momentum beside it may be a million times as large, or as
small, and then one of the two is held to few digits, unseen. So the same equations are had in
another way: with rates in a unit of theirs, a power of two that is loaded like a constant,

    x = s y,    dy/dt = f(s y) / s.

Products with powers of two are exact, in every coefficient of a series as well. So nothing changes
but the largest state, and with it the length of a step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import heyoka as hy

from heavytop.equations.formulation import Formulation
from heavytop.integration.translate import translate


@dataclass(frozen=True, slots=True, eq=False)
class Equations:
    """States and their time derivatives, every constant in them exact at some precision.

    Attributes
    ----------
    states, derivatives : tuple of heyoka expressions, equal length
    loaded : tuple of str
        Constants of a run, by symbol name: ``par[0]``, ``par[1]``, ... After them a scaled
        formulation has the unit of its rates and its reciprocal.
    zeros : tuple of heyoka expressions
        Event functions; scaled ones in that unit too: heyoka holds the error against their values.
    """

    states: tuple[Any, ...]
    derivatives: tuple[Any, ...]
    loaded: tuple[str, ...]
    zeros: tuple[Any, ...] = ()

    @classmethod
    def of(
        cls, form: Formulation, bits: int, events: tuple[str, ...] = (), *, scaled: bool = False
    ) -> Self:
        """Return those of a formulation and of its events, for numbers of so many bits."""
        watched = [form.events[name] for name in events]
        used = set().union(*(x.free_symbols for x in (*form.derivatives, *watched)))
        loaded = [p for p in (*form.parameters, *form.given) if p in used]
        states = tuple(hy.make_vars(*(s.name for s in form.states)))
        unit, reciprocal = (hy.par[len(loaded) + i] for i in range(2))
        rates = set(form.rates) if scaled else set()
        names = {s: unit * y if s in rates else y for s, y in zip(form.states, states, strict=True)}
        names |= {p: hy.par[i] for i, p in enumerate(loaded)}
        found = translate(form.derivatives, names, bits)
        pairs = zip(form.states, found, strict=True)
        derivatives = tuple(reciprocal * f if s in rates else f for s, f in pairs)
        zeros = translate(watched, names, bits)
        if scaled:
            zeros = [reciprocal * zero for zero in zeros]
        return cls(states, derivatives, tuple(p.name for p in loaded), tuple(zeros))

    @classmethod
    def of_attitude(cls, bits: int) -> Self:
        """Return those of the attitude form, written out: deriving them takes a tenth of a second.

        dq/dt = l q / 2 and dl/dt = g (-e_y, e_x, 0), with e = q z q*.
        """
        states = q_0, q_1, q_2, q_3, l_x, l_y = hy.make_vars(
            "q_0", "q_1", "q_2", "q_3", "l_x", "l_y"
        )
        g, l_z = hy.par[0], hy.par[1]
        half, two = (hy.expression(hy.real(text, bits)) for text in ("0.5", "2"))
        x, y, z = half * l_x, half * l_y, half * l_z
        derivatives = (
            -(x * q_1) - y * q_2 - z * q_3,
            x * q_0 + y * q_3 - z * q_2,
            y * q_0 + z * q_1 - x * q_3,
            x * q_2 + z * q_0 - y * q_1,
            -(g * (two * q_2 * q_3 - two * q_0 * q_1)),
            g * (two * q_0 * q_2 + two * q_1 * q_3),
        )
        return cls(tuple(states), derivatives, ("g", "l_z"))
