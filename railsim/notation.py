"""The one table of quantities: name, symbol, unit, how it is shown, and what it means.

Everything that names a quantity to a user (HDF5 attributes, plot axes, printed tables) reads it
from here; docs/notation.md is made from this table.
"""

from dataclasses import dataclass

COMPONENTS = ("x", "y", "z", "roll", "pitch", "yaw")
SIDES = ("left", "right")


@dataclass(frozen=True)
class Quantity:
    """A named quantity of a result.

    Attributes
    ----------
    name, long_name : str
        Name in files and in Python; words for axes and tables.
    symbol : str
        Symbol in mathtext, for plots.
    unit : str
        SI unit as stored.
    dims : tuple of str
        Dimensions in the result file.
    shown_unit : str
        Unit in printed tables and plots, the habit of the field.
    scale : float
        Shown value = stored value times `scale`.
    """

    name: str
    long_name: str
    symbol: str
    unit: str
    dims: tuple[str, ...]
    shown_unit: str
    scale: float


_WHEEL = ("time", "wheelset", "side")
_AXLE = ("time", "wheelset")
_BODY = ("time", "body", "component")


def _table(*rows: Quantity) -> dict[str, Quantity]:
    return {row.name: row for row in rows}


QUANTITIES: dict[str, Quantity] = _table(
    Quantity("time", "time", "t", "s", ("time",), "s", 1.0),
    Quantity("distance", "distance of the reference body", "s", "m", ("time",), "m", 1.0),
    Quantity("Q", "vertical wheel force", "Q", "N", _WHEEL, "kN", 1e-3),
    Quantity("Y", "lateral wheel force", "Y", "N", _WHEEL, "kN", 1e-3),
    Quantity("Y_over_Q", "derailment quotient", "Y/Q", "1", _WHEEL, "-", 1.0),
    Quantity("dQ_over_Q0", "wheel load change", r"\Delta Q/Q_0", "1", _WHEEL, "%", 100.0),
    Quantity("sum_Y", "track shifting force", r"\Sigma Y", "N", _AXLE, "kN", 1e-3),
    Quantity("sum_abs_Y", "lateral force of the wheelset", r"\Sigma |Y|", "N", _AXLE, "kN", 1e-3),
    Quantity("wheelset_lateral", "wheelset lateral displacement", "y", "m", _AXLE, "mm", 1e3),
    Quantity("wheelset_roll", "wheelset roll angle", r"\varphi", "rad", _AXLE, "mrad", 1e3),
    Quantity("wheelset_yaw", "wheelset yaw angle", r"\psi", "rad", _AXLE, "mrad", 1e3),
    Quantity("wheelset_distance", "distance of the wheelset", "s", "m", _AXLE, "m", 1.0),
    Quantity("xi_x", "longitudinal creepage", r"\xi_x", "1", _WHEEL, "1e-3", 1e3),
    Quantity("xi_y", "lateral creepage", r"\xi_y", "1", _WHEEL, "1e-3", 1e3),
    Quantity("phi", "spin creepage", r"\phi", "1/m", _WHEEL, "1/m", 1.0),
    Quantity("T_gamma", "wear number", r"T\gamma", "N", _WHEEL, "N", 1.0),
    Quantity("Q0", "static wheel load", "Q_0", "N", ("wheelset", "side"), "kN", 1e-3),
    Quantity("body_position", "position of the body", "q", "m, rad", _BODY, "m, rad", 1.0),
    Quantity("body_velocity", "velocity of the body", r"\dot q", "m/s, rad/s", _BODY,
             "m/s, rad/s", 1.0),
    Quantity("body_acceleration", "acceleration of the body", "a", "m/s2, rad/s2", _BODY,
             "m/s2, rad/s2", 1.0),
)
