"""What a study does at each point of its grid: a run, its assessment, modes, hunting, curving."""

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field

from railsim.definitions.base import Definition, Finite, NonNegative, Positive, Text

_ACCELERATIONS = ("y", "z", "y_rms", "z_rms", "y_qst", "y_safety", "z_safety", "instability")
# units of the numbers, by what stands behind the analysis' name
UNITS = {
    **dict.fromkeys(("linear", "ramp", "bifurcation", "continuation"), "m/s"),
    **dict.fromkeys(("T_gamma", "T_gamma_largest", "Q", "Y", "sum_Y", "sum_abs_Y"), "N"),
    **{"frequency": "Hz", "attack": "rad", "lateral": "m", "car_roll": "rad"},
    # of sections
    **dict.fromkeys((f"{q}_largest" for q in ("sum_Y", "instability", "Q", "Q_qst", "Y_qst")), "N"),
    **{f"{b}_{q}_largest": "m/s2" for b in ("body", "frame") for q in _ACCELERATIONS},
}


class RunAnalysis(Definition):
    """A run in the time domain: the default analysis of a study."""

    kind: Literal["run"]
    """`run`: peaks and mid-curve values"""


class AssessAnalysis(Definition):
    """A run and its assessment, as `railsim assess`."""

    kind: Literal["assess"]
    """`assess`: a run against a standard"""
    standard: Literal["en14363", "uic518", "comfort", "wear", "safety"] = "en14363"
    """Standard, as `railsim assess --standard`"""
    limits: Text | None = None
    """Limits file; by default that of the standard"""


class _Linear(Definition):
    """How the contact is linearised."""

    linearisation: Literal["tangent", "harmonic"] = "tangent"
    """Contact: its derivative, or its first harmonic"""
    amplitude: Positive = 3e-3
    """Lateral amplitude of the wheelsets for `harmonic` [m]"""
    conicity: Positive | None = None
    """Cones of this conicity instead of the profiles"""


class ModesAnalysis(_Linear):
    """Modes at the speed of the point, on straight track."""

    kind: Literal["modes"]
    """`modes`: damping of the least damped oscillation"""


class CriticalSpeedAnalysis(_Linear):
    """Critical speed on straight track."""

    kind: Literal["critical_speed"]
    """`critical_speed`: from which speed the vehicle hunts"""
    methods: tuple[Literal["linear", "ramp", "bifurcation", "continuation"], ...] = ("linear",)
    """How it is sought"""
    low: Positive = 5.0
    """Lowest speed of the search [m/s]"""
    high: Positive = 120.0
    """Highest speed of the search [m/s]"""


class CurvingAnalysis(Definition):
    """Steady curving on a circle, by Newton's method."""

    kind: Literal["curving"]
    """`curving`: steady state in a curve, with the rails and the friction of the point's track"""
    radius: Finite
    """Radius, negative to the left [m]"""
    cant: NonNegative = 0.0
    """Cant over 1.5 m [m]"""
    cant_deficiency: Finite | None = None
    """Cant deficiency [m]; by default that of the point's speed"""


Analysis = Annotated[
    RunAnalysis | AssessAnalysis | ModesAnalysis | CriticalSpeedAnalysis | CurvingAnalysis,
    Field(discriminator="kind"),
]


def unit_of_number(name: str) -> str:
    """Return the unit of an analysis' number, ``NAME.NUMBER``; empty where it has none.

    >>> unit_of_number("hunting.linear"), unit_of_number("wear.percentiles_50")
    ('m/s', '')
    """
    return UNITS.get(name.partition(".")[2], "")


def needs_run(analyses: Mapping[str, Analysis]) -> bool:
    """Whether any of the analyses, or their absence, asks for a run in the time domain."""
    kinds = (RunAnalysis, AssessAnalysis)
    return not analyses or any(isinstance(analysis, kinds) for analysis in analyses.values())


def needs_speed(analyses: Mapping[str, Analysis]) -> bool:
    """Whether anything depends on the speed of the points."""
    return not analyses or any(
        not isinstance(analysis, CriticalSpeedAnalysis)
        and not (isinstance(analysis, CurvingAnalysis) and analysis.cant_deficiency is not None)
        for analysis in analyses.values()
    )
