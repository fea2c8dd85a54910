"""Proved bounds of the error of a run, over all of its times."""
