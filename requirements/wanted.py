"""Print what the lock must cover: the dependencies, those of rivals, the dev and build groups."""

import tomllib
from pathlib import Path

project = tomllib.loads((Path(__file__).parent.parent / "pyproject.toml").read_text("utf-8"))
groups = project["dependency-groups"]
rivals = project["project"]["optional-dependencies"]["rivals"]
print("\n".join([*project["project"]["dependencies"], *rivals, *groups["dev"], *groups["build"]]))
