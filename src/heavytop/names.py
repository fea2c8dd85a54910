"""Names: which of those that are known may have been meant."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from typing import Final

LONGEST: Final = 60  # of what is compared, or told: no name is longer


def nearest(value: object, known: Iterable[str]) -> str:
    """Return a hint at the known name that a value most looks like, or nothing.

    Parameters
    ----------
    value : object
        What was given; only a text looks like a name, in capitals or not.
    known : iterable of str

    Returns
    -------
    str
        Empty where no name is near.

    Examples
    --------
    >>> nearest("Taylor-axes", ["taylor-axis", "taylor-cubic"])
    'did you mean "taylor-axis"?'
    >>> nearest(1, ["one"])
    ''
    """
    if not isinstance(value, str):
        return ""
    folded = {name.casefold(): name for name in known}
    close = get_close_matches(value[:LONGEST].casefold(), folded, n=1)
    return f'did you mean "{folded[close[0]]}"?' if close else ""
