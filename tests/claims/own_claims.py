"""Scripts of claims made for a test."""

HEAD = """
import os, time
from pathlib import Path
from heavytop.claims import Authority, claim, proof
BOOK = Authority("a book", "formula")
def of_a_book(name, **more):
    return claim(BOOK, 1, "so it is", "closed form", name=name, **more)
"""
FAKE = (
    HEAD
    + '''
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
'''
)
SLOW = (
    HEAD
    + '''
for name in "abcd":
    @of_a_book(name, of=(name,))
    def _(name):
        """{0}."""
        time.sleep(0.5)
        return ord(name) / 1000
'''
)


def script(folder, body):
    """Write a script whose name no other test has; return the folder, and the name."""
    name = f"50_{folder.name}"
    (folder / f"{name}.py").write_text(body, "utf-8")
    return folder, name


def by_id(found):
    return {each.id: each for each in found.claims}
