"""Stress: the motions at which methods fail, every method at each of them, and how each fails."""
