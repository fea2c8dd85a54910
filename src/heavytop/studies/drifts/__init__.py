"""Drift: how the errors of a method grow over long runs, in every invariant and in phase."""
