"""A process that does a toy study: drive.py FOLDER JOBS IDENTITY."""

import json
import os
import resource
import signal
import sys

import toy_study

from heavytop.cli.exits import exit_code
from heavytop.errors import HeavyTopError
from heavytop.studies.ledger import Folder, Study, run


def main(path, jobs, text):
    signal.signal(signal.SIGINT, signal.default_int_handler)  # whatever the tests run under
    if limit := os.environ.get("TOY_FILE_LIMIT"):
        resource.setrlimit(resource.RLIMIT_FSIZE, (int(limit), resource.RLIM_INFINITY))
    identity = json.loads(text)
    study = Study(identity, toy_study.tasks(identity), "toy_study")
    try:
        with Folder.create_or_open(path, identity) as folder:
            run(study, folder, jobs=int(jobs))
    except (HeavyTopError, KeyboardInterrupt) as error:
        print(error, file=sys.stderr)
        sys.exit(exit_code(error))


if __name__ == "__main__":
    main(*sys.argv[1:])
