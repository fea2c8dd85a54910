"""Runs under a limit of time: each in a worker process, which is killed when it does not return.

Nothing less helps: a solver that hangs inside its own compiled code hears no signal.
"""

from __future__ import annotations

import time
from queue import Empty, SimpleQueue
from typing import Any, Final

from heavytop.studies.ledger import Study
from heavytop.studies.ledger.hand import Hand, Inbox

FOLLOWER: Final = "heavytop.studies.stresses.follow"
TICK_S: Final = 0.2  # how long Ctrl-C may go unheard
PATIENCE_S: Final = 60.0  # to start, and for the truth of a case


class Killed(Exception):
    """A run that did not return in time."""


class Lost(Exception):
    """A worker that died, or a bug in it; the message says how."""


class Keeper:
    """A worker process, and another one after each that had to be killed.

    Parameters
    ----------
    identity : dict
        What all runs have in common, as JSON.
    follower : str
        The module whose `follow` does a run in two pieces: what it needs, and the run.
    """

    def __init__(self, identity: dict[str, Any], follower: str = FOLLOWER) -> None:
        self._study = Study(identity, (), follower)
        self._inbox: Inbox = SimpleQueue()
        self._hand: Hand | None = None

    def prepare(self, task: str, patience_s: float = PATIENCE_S) -> None:
        """Let a worker get ready for a run, which is no part of it.

        Raises
        ------
        Killed, Lost
            As for `run`; being killed here is not the fault of the method.
        """
        if self._hand is None:
            self._inbox = SimpleQueue()
            self._hand = Hand(self._study, self._inbox)
        self._hand.take(task, None)
        self._piece(patience_s)

    def run(self, limit_s: float) -> tuple[dict[str, Any], float]:
        """Do the run that is prepared, and return what it found and the time it took [s].

        Raises
        ------
        Killed
            It did not return in time.
        Lost
            The worker died of it, or it has a bug.
        """
        assert self._hand is not None
        self._hand.go_on()
        piece = self._piece(limit_s)
        return piece["rows"][0], piece["spent_s"]

    def close(self) -> None:
        """End the worker."""
        if self._hand is not None:
            self._hand.end()
            self._hand = None

    def _piece(self, limit_s: float) -> dict[str, Any]:
        match self._heard(time.monotonic() + limit_s):
            case {"piece": dict(piece)}:
                return piece
            case None:
                fate = "" if self._hand is None else self._hand.fate()
                self.close()
                raise Lost(fate)
            case message:
                self.close()
                raise Lost(str(message.get("failed") or message.get("bug")))

    def _heard(self, until: float) -> dict[str, Any] | None:
        while True:
            left = until - time.monotonic()
            try:
                return self._inbox.get(timeout=max(0.0, min(TICK_S, left)))[1]
            except Empty:
                if left <= TICK_S:
                    self.close()
                    raise Killed from None
