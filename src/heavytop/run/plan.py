"""The plan of a run, the span of its scene, and what the run cost."""

from __future__ import annotations

from dataclasses import dataclass

from heavytop.analytic.motion import Motion
from heavytop.equations.formulation import FORMULATIONS, Formulation
from heavytop.errors import BadScene, Fault
from heavytop.exact.decimals import Context, Number
from heavytop.exact.pairs import EPSILON
from heavytop.scene.scene import Scene, expect_scene
from heavytop.text import Shown

Texts = tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Plan(Shown):
    """What will be integrated, and how.

    Attributes
    ----------
    formulation : str
        Name of the equations; ``none`` where nothing is integrated, and the closed form answers.
    variant : str or None
        How phi and psi are obtained. Axis form: ``phi`` (phi alone), ``sigma`` or ``delta`` (psi
        too, by a quadrature); subsystem, Routh's and attitude form: ``angles`` (both). Cubic form:
        the pole from which heights are measured.
    frame : tuple of (str, float)
        Mean rates subtracted from quadratures, by parameter, to keep these bounded [rad/s].
    watched : tuple of str
        Event functions whose zeros the integrator finds on its way.
    states : int
        Number of states that are integrated.
    precision : str
        ``double``, or the bits of a significand, as in ``256 bits``.
    tolerance : float
        Relative error tolerance of a step [1]; 0 where it is smaller than any double.
    projected : bool
        Whether the state is put back onto its invariants every few steps.
    reasons, warnings : tuple of str
        Why the plan is as it is, and what may go wrong, in words.
    seconds : float
        The time that the steps are expected to take [s].
    tried : tuple of str
        Plans that were run before, and which digits they missed, in words.
    auto : bool
        Whether a run that misses its digits is repeated by a better plan.
    """

    formulation: str
    variant: str | None = None
    frame: tuple[tuple[str, float], ...] = ()
    watched: Texts = ()
    states: int = 0
    precision: str = "double"
    tolerance: float = EPSILON
    projected: bool = False
    reasons: Texts = ()
    warnings: Texts = ()
    seconds: float = 0.0
    tried: Texts = ()
    auto: bool = False

    @property
    def equations(self) -> Formulation:
        """The formulation that the plan names."""
        return FORMULATIONS[self.formulation].build(self.variant)


@dataclass(frozen=True, slots=True)
class Statistics:
    """What a run cost.

    Attributes
    ----------
    steps : int
        Natural steps of the integrator.
    order : int
        Order of its Taylor polynomials.
    derive_s, compile_s, integrate_s : float
        Wall-clock time of the parts [s].
    whole : bool
        Whether the times are those of the whole run: a file does not store them.
    """

    steps: int
    order: int
    derive_s: float
    compile_s: float
    integrate_s: float
    whole: bool = True


# --- the span of a scene, and its motion --------------------------------------------------------


def closed_form_of(scene: Scene) -> Motion:
    """Return the exact motion of a scene; its parts are computed when they are read.

    Raises
    ------
    WrongType
        `scene` is no `Scene` (but a name, for example).
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
    """The end time to all digits of `ctx` [s], of a scene for which `span` raises nothing."""
    if scene.time is not None:
        return scene.time.mpf(ctx)
    assert scene.periods is not None
    return scene.periods.mpf(ctx) * ctx.mpf(motion.mpf("period", ctx.dps))


def refusal(scene: Scene, key: str, value: str, rule: str) -> BadScene:
    """Return the exception for a scene of which one key breaks a rule."""
    return BadScene((Fault(scene.name, None, key, value, rule),))


def span_fault(scene: Scene, rule: str) -> Fault:
    """Return the fault of a span, named by the key that gives it: ``time`` or ``periods``."""
    key, value = ("time", scene.time) if scene.periods is None else ("periods", scene.periods)
    return Fault(scene.name, None, f"span.{key}", str(value), rule)
