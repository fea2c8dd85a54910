"""A process that does a toy study: run_toy.py FOLDER JOBS PARAMETERS."""

import json
import os
import resource
import sys

from heavytop.errors import HeavyTopError
from heavytop.studies import study
from heavytop.studies.journal import Journal


def main(path, jobs, text):
    if limit := os.environ.get("TOY_FILE_LIMIT"):
        resource.setrlimit(resource.RLIMIT_FSIZE, (int(limit), resource.RLIM_INFINITY))
    study.STUDIES["toy"] = "toy_study"
    try:
        with Journal.open(path, json.loads(text)) as journal:
            study.run(journal, jobs=int(jobs), slice_s=0.1)
    except (HeavyTopError, KeyboardInterrupt) as error:
        print(error, file=sys.stderr)
        sys.exit(getattr(error, "exit", 130))


main(*sys.argv[1:])  # without a guard: workers do not run this again
