"""Print what the lock must cover: dependencies, extras but two, dev and build groups."""

import tomllib
from pathlib import Path

project = tomllib.loads((Path(__file__).parent.parent / "pyproject.toml").read_text("utf-8"))
groups = project["dependency-groups"]
extras = project["project"]["optional-dependencies"]
outside = {"engines", "film"}
wanted = [each for name in extras.keys() - outside for each in extras[name]]
print("\n".join([*project["project"]["dependencies"], *wanted, *groups["dev"], *groups["build"]]))
