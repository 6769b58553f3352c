"""An assessed quantity of one's own: what `docs/extending.md` describes.

The smallest load of a wheel in a curve, as a share of 10 kN: the module below and a limit file are
all it needs.
"""

from railsim.assessment.criteria import ALL, FORCES, SAFETY, Criterion, Measured, low
from railsim.assessment.signals import wheel_load


def unloading(x, turn):
    """Load missing to 60 kN."""
    (smallest,) = low(x, turn)
    return [60e3 - smallest]


UNLOADING = Criterion(
    "unloading", "load missing to 60 kN", "kN", SAFETY, "largest",
    Measured(wheel_load, FORCES, unloading, wheels=ALL, curves=True),
    meaning="an example",
)  # fmt: skip

LIMITS = """\
format = "railsim-limits/1"
extends = "en14363"

[limits.unloading]
law = "by_zone"
values = [10e3, 10e3, 10e3, 5e3]
source = "an example"
checked = true
"""
