"""Print what the lock must cover: the dependencies, the extras, the dev and build groups."""

import tomllib
from pathlib import Path

project = tomllib.loads((Path(__file__).parent.parent / "pyproject.toml").read_text("utf-8"))
groups = project["dependency-groups"]
extras = [each for extra in project["project"]["optional-dependencies"].values() for each in extra]
print("\n".join([*project["project"]["dependencies"], *extras, *groups["dev"], *groups["build"]]))
