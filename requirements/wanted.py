"""Print what the lock must cover: the dependencies, extras, dev and build groups."""

import tomllib
from pathlib import Path

project = tomllib.loads((Path(__file__).parent.parent / "pyproject.toml").read_text("utf-8"))
groups = project["dependency-groups"]
extras = project["project"]["optional-dependencies"]
wanted = [each for extra in extras.values() for each in extra]
print("\n".join([*project["project"]["dependencies"], *wanted, *groups["dev"], *groups["build"]]))
