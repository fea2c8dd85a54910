"""Kinds of motion: their names, the criteria that distinguish them, and the proofs."""

from heavytop.classification.kinds import Kind, Verdict

__all__ = ["Kind", "Verdict"]
