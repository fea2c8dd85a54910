"""A script of claims that take half a second each."""

import time

from heavytop.claims import Authority, claim

for each in "abcd":

    @claim(Authority("a book", "formula"), 1, "so it is", "closed form", name=each, of=(each,))
    def _(name):
        """{0}."""
        time.sleep(0.5)
        return ord(name) / 1000
