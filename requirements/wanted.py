"""Print what the lock must cover: the dependencies, extras but REBOUND's, dev and build groups."""

import tomllib
from pathlib import Path

project = tomllib.loads((Path(__file__).parent.parent / "pyproject.toml").read_text("utf-8"))
groups = project["dependency-groups"]
extras = dict(project["project"]["optional-dependencies"])
del extras["rebound"]
wanted = [each for extra in extras.values() for each in extra]
print("\n".join([*project["project"]["dependencies"], *wanted, *groups["dev"], *groups["build"]]))
