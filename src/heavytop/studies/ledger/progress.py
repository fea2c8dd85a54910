"""Progress, as of the runner."""

from heavytop.studies.runner import Progress

__all__ = ["Progress"]
