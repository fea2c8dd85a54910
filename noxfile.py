#!/usr/bin/env -S uv run --script

# /// script
# dependencies = ["nox>=2025.10.14"]
# ///
"""Sessions of nox, each in an environment of its own: ``nox -s tests-3.12``, ``nox -s check``.

`make test` and `make check` do the same in the environment of the lock, on Python 3.11.
"""

import nox

nox.needs_version = ">=2025.10.14"
nox.options.default_venv_backend = "uv|virtualenv"

PYTHONS = ["3.11", "3.12", "3.13", "3.14"]


def install(session: nox.Session) -> None:
    """Install the package with its extras, and what it is developed with."""
    groups = nox.project.dependency_groups(nox.project.load_toml("pyproject.toml"), "dev")
    session.install("-e.[rivals,cluster]", *groups)


@nox.session(python=PYTHONS, default=False)
def tests(session: nox.Session) -> None:
    """Run the tests: ``nox -s tests-3.12 -- -k cusp`` runs some of them."""
    install(session)
    session.run("pytest", "-q", "-n", "2", "--dist", "loadfile", *session.posargs)


@nox.session(python=PYTHONS[0])
def check(session: nox.Session) -> None:
    """Run ruff, mypy, the contracts between layers, and the examples in docstrings."""
    install(session)
    session.run("ruff", "check", ".")
    session.run("ruff", "format", "--check", ".")
    session.run("mypy")
    session.run("lint-imports")
    session.run("pytest", "-q", "--doctest-modules", "src")


if __name__ == "__main__":
    nox.main()
