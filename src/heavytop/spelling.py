"""Words for people: foreign letters spelled out, and times in the unit in which they are read."""

from __future__ import annotations

from typing import Final

_SHORT_S: Final = 60.0  # below which a time is told in seconds
_LONGER: Final = ((31_557_600, "years"), (86_400, "days"), (3600, "h"), (60, "min"))


def harmless(text: object) -> str:
    r"""The text on one line, with what a terminal would act on spelled out.

    Examples
    --------
    >>> print(harmless("a\nb"), harmless("caf\udce9"))
    a\nb caf\xe9
    """
    return "".join(c if c.isprintable() else _letter(c) for c in str(text))


def cut(text: str, most: int) -> str:
    """The text, or its beginning where it is longer than `most` letters.

    Examples
    --------
    >>> cut("a long title", 7)
    'a long…'
    """
    return text if len(text) <= most else text[: most - 1] + "…"


def readable(name: str) -> str:
    r"""The name of a file as UTF-8, where Python read it as ASCII for the locale's sake.

    Examples
    --------
    >>> readable("caf\udcc3\udca9"), readable("café"), readable("caf\udce9")
    ('café', 'café', 'caf\\xe9')
    """
    if not any("\udc80" <= letter <= "\udcff" for letter in name):
        return name
    return name.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")


def _letter(letter: str) -> str:
    if "\udc80" <= letter <= "\udcff":  # a byte that is no UTF-8, as os.fsdecode gives it
        return f"\\x{ord(letter) - 0xDC00:02x}"
    return ascii(letter)[1:-1]


def duration(seconds: float) -> str:
    """A time in the unit in which it is read: seconds, minutes, hours, days or years.

    >>> [duration(x) for x in (3.17, 90, 24_400, 3e5, 1e12)]
    ['3.17 s', '1.5 min', '6.78 h', '3.47 days', '3.17e+04 years']
    """
    if seconds < _SHORT_S:
        return f"{seconds:.3g} s"
    unit, name = next((u, n) for u, n in _LONGER if seconds >= u)
    return f"{seconds / unit:.3g} {name}"
