"""Numbers of a stated number of digits."""

import copy
import pickle

import mpmath

from heavytop.exact.decimals import context


def test_a_copied_number_is_exact_and_of_its_own_precision():
    ctx = context(50)
    for value in (ctx.mpf(1) / 3, ctx.mpf(0), -ctx.ldexp(7, -3000), ctx.inf, +ctx.pi):
        for again in (pickle.loads(pickle.dumps(value)), copy.deepcopy(value)):
            assert again == value
            assert again.context is ctx
    assert abs(pickle.loads(pickle.dumps(ctx.pi)) - mpmath.mpf(mpmath.pi)) < 1e-15
