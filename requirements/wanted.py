"""Print what the lock must cover: the package's dependencies, its dev group and its build group."""

import tomllib
from pathlib import Path

project = tomllib.loads((Path(__file__).parent.parent / "pyproject.toml").read_text("utf-8"))
groups = project["dependency-groups"]
print("\n".join([*project["project"]["dependencies"], *groups["dev"], *groups["build"]]))
