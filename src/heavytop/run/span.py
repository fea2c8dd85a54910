"""What a scene says of its motion and its span, in numbers and in refusals."""

from __future__ import annotations

from heavytop.analytic.motion import Motion
from heavytop.errors import BadScene, Fault
from heavytop.exact.decimals import Context, Number
from heavytop.scene.scene import Scene, expect_scene


def closed_form_of(scene: Scene) -> Motion:
    """The motion of a scene, which is computed as far as it is asked for.

    Raises
    ------
    WrongType
        It is no `Scene`, but a name, say.
    """
    expect_scene(scene)
    return Motion(scene.top, scene.start)


def span(scene: Scene, motion: Motion) -> float:
    """The end time of a scene [s].

    Raises
    ------
    BadScene
        The span is in nutation periods, and nothing nutates.
    """
    if scene.time is not None:
        return float(scene.time)
    if scene.periods is None:
        rule = "missing: what is integrated has time = … in seconds, or periods = …"
        raise refusal(scene, "span", "", rule)
    if motion.period is None:
        rule = f"no nutation period to count: {motion.kind}; give span.time in seconds"
        raise refusal(scene, "span.periods", str(scene.periods), rule)
    return float(scene.periods) * float(motion.period)


def exact_span(scene: Scene, motion: Motion, ctx: Context) -> Number:
    """The end time of a scene to all digits [s], of one that has it as `span` does."""
    if scene.time is not None:
        return scene.time.mpf(ctx)
    assert scene.periods is not None
    return scene.periods.mpf(ctx) * ctx.mpf(motion.mpf("period", ctx.dps))


def refusal(scene: Scene, key: str, value: str, rule: str) -> BadScene:
    """What refuses a scene, by the rule that one of its keys breaks."""
    return BadScene((Fault(scene.name, None, key, value, rule),))


def span_fault(scene: Scene, rule: str) -> Fault:
    """What is wrong with the span of a scene, in the words in which it gives that."""
    key, value = ("time", scene.time) if scene.periods is None else ("periods", scene.periods)
    return Fault(scene.name, None, f"span.{key}", str(value), rule)
