"""A script of claims that end in every way."""

import os

from heavytop.claims import Authority, claim, proof

BOOK = Authority("a book", "formula")


def of_a_book(name, **more):
    return claim(BOOK, 1, "so it is", "closed form", name=name, **more)


def raises(error):
    raise error


for name, measure in {
    "fails": lambda: 2,
    "raises": lambda: raises(ValueError("no such top")),
    "nan": lambda: float("nan"),
    "negative": lambda: -0.5,
    "dies": lambda: os.kill(os.getpid(), 11),
}.items():
    of_a_book(name)(measure)


@of_a_book("holds")
def _():
    """a distance."""
    print("not on stdout")
    return 0.5


@of_a_book("absent", needs="no_such_package")
def _():
    return 0.0


@of_a_book("last", of=("axis", 2))
@of_a_book("first", of=("tilt", 1))
def _(name, number):
    """{0} of the top,
    {1}.

    And how.
    """
    return number - 1


@proof
def own():
    yield from (("one", 1, 2), ("two", -3, 2), ("three", 3, 2))
    raise OSError("no disk")


@proof
def empty():
    yield from ()
