"""What the figures are given: a trajectory, or an error says so."""

from __future__ import annotations

from heavytop.scene.arguments import expect


def expect_run(trajectory: object) -> None:
    """Refuse what is no trajectory, such as a motion.

    Raises
    ------
    WrongType
    """
    from heavytop.run.trajectory import Trajectory  # which takes its time to import

    expect("trajectory", trajectory, Trajectory, "propagate gives one")
