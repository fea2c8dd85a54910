"""The toy study as a kind that is known, in a process that does errands for a test."""

from heavytop.studies.ledger.kinds import KINDS


def enroll():
    KINDS["toy"] = "toy_study"


def dask_setup(worker):  # dask worker --preload enrolled
    enroll()
