"""Names: which of those that are known may have been meant."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from difflib import get_close_matches
from typing import Final

LONGEST: Final = 60  # of what is compared, or told: no name is longer
MANY: Final = 20  # names, of which no more are told at once
FEW: Final = 6  # of many


def article(name: str) -> str:
    """Return a name with its indefinite article.

    Examples
    --------
    >>> article("int"), article("float")
    ('an int', 'a float')
    """
    return f"an {name}" if name[:1] in "aeiouAEIOU" else f"a {name}"


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
    meant = closest(value, known)
    return f'did you mean "{meant}"?' if meant else ""


def closest(value: object, known: Iterable[str]) -> str:
    """Return the known name that a value most looks like; empty where none is near.

    Examples
    --------
    >>> closest("Cups", ["cusp", "kick"])
    'cusp'
    """
    return next(iter(_alike(value, known, 1)), "")


def listed(value: object, known: Collection[str], everything: str = "") -> str:
    """Return the known names, in words; of many, those that look most like a value.

    Parameters
    ----------
    value : object
        What was given in place of one.
    known : collection of str
    everything : str
        Where all of them are to be had.

    Examples
    --------
    >>> listed("c", ["a", "b"])
    'a, b'
    >>> listed("n77", [f"n{i}" for i in range(100)], "heavytop stress --list")
    'n77, n7, n97, n87, n79, n78, … (100 in all: heavytop stress --list)'
    """
    if len(known) <= MANY:
        return ", ".join(known)
    few = _alike(value, known, FEW, 0.0) or list(known)[:FEW]
    where = f": {everything}" if everything else ""
    return f"{', '.join(few)}, … ({len(known)} in all{where})"


def _alike(
    value: object, known: Iterable[str], most: int, least_likeness: float = 0.6
) -> list[str]:
    if not isinstance(value, str):
        return []
    folded = {name.casefold(): name for name in known}
    given = value[:LONGEST].casefold()
    return [folded[each] for each in get_close_matches(given, folded, most, least_likeness)]
