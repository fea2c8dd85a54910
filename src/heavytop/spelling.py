"""Foreign letters: what a terminal would act on, spelled out."""

from __future__ import annotations


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
