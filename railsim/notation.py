"""The one table of quantities: name, symbol, unit, sign, how it is shown, and what it means.

Everything that names a quantity to a user (HDF5 attributes, plot axes, printed tables) reads it
from here; docs/notation.md is made from this table.
"""

from dataclasses import dataclass, replace
from math import pi

COMPONENTS = ("x", "y", "z", "roll", "pitch", "yaw")
SIDES = ("left", "right")
EXTREMES = ("max", "min")
DECIMALS = {"kN": 2, "mm": 2, "mrad": 2, "%": 2, "-": 3, "N": 1, "1e-3": 3, "s": 2, "m": 1}
"""Decimals in printed tables by shown unit; four digits for the others."""

SHOWN_UNITS = {
    "mm": ("m", 1e3),
    "km": ("m", 1e-3),
    "mm2": ("m2", 1e6),
    "1/km": ("1/m", 1e3),
    "km/h": ("m/s", 3.6),
    "t": ("kg", 1e-3),
    "kN": ("N", 1e-3),
    "kN m": ("N m", 1e-3),
    "kN/m": ("N/m", 1e-3),
    "N/mm": ("N/m", 1e-3),
    "MPa": ("Pa", 1e-6),
    "kW": ("W", 1e-3),
    "mrad": ("rad", 1e3),
    "deg": ("rad", 180.0 / pi),
    "%": ("1", 100.0),
    "1e-3": ("1", 1e3),
    "per mille": ("1", 1e3),
}
"""SI unit of values shown in another one, and shown value over SI value."""


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
        SI unit as stored; where the components differ, that of x, y, z and that of the angles,
        separated by a comma.
    dims : tuple of str
        Dimensions in the result file.
    shown_unit : str
        Unit in printed tables and plots, the habit of the field.
    scale : float
        Shown value = stored value times `scale`.
    sign : str
        What a positive value means; empty for magnitudes and where the name says it.
    """

    name: str
    long_name: str
    symbol: str
    unit: str
    dims: tuple[str, ...]
    shown_unit: str
    scale: float
    sign: str = ""

    def text(self, value: float) -> str:
        """Return a stored value as text in the shown unit, without the unit.

        Examples
        --------
        >>> QUANTITIES["Q"].text(89123.4), QUANTITIES["Y_over_Q"].text(0.39012)
        ('89.12', '0.390')
        """
        shown = value * self.scale
        decimals = DECIMALS.get(self.shown_unit)
        return f"{shown:.4g}" if decimals is None else f"{shown:.{decimals}f}"

    @property
    def words(self) -> str:
        """Long name with the shown unit, for printed tables."""
        return self.long_name if self.shown_unit == "-" else f"{self.long_name} ({self.shown_unit})"

    @property
    def label(self) -> str:
        """Axis label: words, symbol and shown unit."""
        words = self.long_name[:1].upper() + self.long_name[1:]
        unit = "" if self.shown_unit == "-" else f" ({self.shown_unit})"
        return f"{words} ${self.symbol}${unit}"

    def component(self, name: str) -> "Quantity":
        """Return this quantity for one of `COMPONENTS`, with that component's unit.

        Examples
        --------
        >>> QUANTITIES["body_position"].component("yaw").shown_unit
        'mrad'
        """
        rotation = COMPONENTS.index(name) >= 3

        def own(units: str) -> str:
            return units.split(", ")[-1 if rotation else 0]

        symbol = {
            "x": "x",
            "y": "y",
            "z": "z",
            "roll": r"\varphi",
            "pitch": r"\theta",
            "yaw": r"\psi",
        }[name]
        dots = {"body_velocity": r"\dot ", "body_acceleration": r"\ddot "}.get(self.name, "")
        return replace(
            self,
            long_name=f"{self.long_name}, {name}",
            symbol=f"{dots}{symbol}",
            unit=own(self.unit),
            shown_unit=own(self.shown_unit),
        )


_WHEEL = ("time", "wheelset", "side")
_AXLE = ("time", "wheelset")
_BODY = ("time", "body", "component")


def _table(*rows: Quantity) -> dict[str, Quantity]:
    return {row.name: row for row in rows}


QUANTITIES: dict[str, Quantity] = _table(
    Quantity("time", "time", "t", "s", ("time",), "s", 1.0),
    Quantity(
        "distance",
        "distance of the reference body",
        "s",
        "m",
        ("time",),
        "m",
        1.0,
        "along the track; 0 at the start of the track",
    ),
    Quantity(
        "mileage",
        "mileage of the reference body",
        "s_m",
        "m",
        ("time",),
        "m",
        1.0,
        "as the track's file gives it; the distance where it does not",
    ),
    Quantity(
        "curvature",
        "curvature at the reference body",
        r"\kappa",
        "1/m",
        ("time",),
        "1/km",
        1e3,
        "positive to the right",
    ),
    Quantity(
        "cant",
        "cant at the reference body",
        "h",
        "m",
        ("time",),
        "mm",
        1e3,
        "positive with the left rail higher",
    ),
    Quantity(
        "Q",
        "vertical wheel force",
        "Q",
        "N",
        _WHEEL,
        "kN",
        1e-3,
        "on the rail, perpendicular to the track plane, positive pressing on the rail",
    ),
    Quantity(
        "Y",
        "guiding force",
        "Y",
        "N",
        _WHEEL,
        "kN",
        1e-3,
        "on the rail, in the track plane, positive to the right",
    ),
    Quantity(
        "Y_over_Q",
        "derailment quotient",
        "Y/Q",
        "1",
        _WHEEL,
        "-",
        1.0,
        "positive when the wheel pushes its rail outwards",
    ),
    Quantity(
        "dQ_over_Q0",
        "wheel load change",
        r"\Delta Q/Q_0",
        "1",
        _WHEEL,
        "%",
        100.0,
        "positive when the wheel is loaded more than at rest on straight level track",
    ),
    Quantity(
        "sum_Y",
        "track shift force",
        r"\Sigma Y",
        "N",
        _AXLE,
        "kN",
        1e-3,
        "on the track, positive to the right",
    ),
    Quantity("sum_abs_Y", "sum of guiding-force magnitudes", r"\Sigma |Y|", "N", _AXLE, "kN", 1e-3),
    Quantity(
        "wheelset_lateral",
        "wheelset lateral displacement",
        "y",
        "m",
        _AXLE,
        "mm",
        1e3,
        "from the middle of the irregular, deflected rails under the wheelset, along the line over "
        "their tops, positive to the right",
    ),
    Quantity(
        "wheelset_roll",
        "wheelset roll angle",
        r"\varphi",
        "rad",
        _AXLE,
        "mrad",
        1e3,
        "relative to the line over the tops of the irregular, deflected rails, positive with the "
        "right wheel down",
    ),
    Quantity(
        "wheelset_yaw",
        "wheelset yaw angle",
        r"\psi",
        "rad",
        _AXLE,
        "mrad",
        1e3,
        "relative to the radial position, positive with the nose to the right",
    ),
    Quantity(
        "wheelset_distance",
        "distance of the wheelset",
        "s",
        "m",
        _AXLE,
        "m",
        1.0,
        "along the track; 0 at the start of the track",
    ),
    Quantity(
        "xi_x",
        "longitudinal creepage",
        r"\xi_x",
        "1",
        _WHEEL,
        "1e-3",
        1e3,
        "of the most loaded patch: wheel minus rail, over the speed, positive forward",
    ),
    Quantity(
        "xi_y",
        "lateral creepage",
        r"\xi_y",
        "1",
        _WHEEL,
        "1e-3",
        1e3,
        "of the most loaded patch: wheel minus rail, over the speed, positive to the right",
    ),
    Quantity(
        "phi",
        "spin creepage",
        r"\phi",
        "1/m",
        _WHEEL,
        "1/m",
        1.0,
        "of the most loaded patch: about the normal into the rail",
    ),
    Quantity(
        "T_gamma",
        "wear number",
        r"T\gamma",
        "N",
        _WHEEL,
        "N",
        1.0,
        "T_x xi_x + T_y xi_y, summed over the patches, without the spin's part",
    ),
    Quantity(
        "T_gamma_spin",
        "wear number of spin",
        r"T\gamma_\phi",
        "N",
        _WHEEL,
        "N",
        1.0,
        "M_z phi, summed over the patches",
    ),
    Quantity(
        "Q0",
        "static wheel load",
        "Q_0",
        "N",
        ("wheelset", "side"),
        "kN",
        1e-3,
        "at rest on straight level track",
    ),
    Quantity(
        "body_position",
        "position of the body",
        "q",
        "m, rad",
        _BODY,
        "mm, mrad",
        1e3,
        "relative to the track frame of the body; zero in the nominal position",
    ),
    Quantity(
        "body_velocity",
        "velocity of the body",
        r"\dot q",
        "m/s, rad/s",
        _BODY,
        "m/s, rad/s",
        1.0,
        "relative to the track frame of the body",
    ),
    Quantity(
        "body_acceleration",
        "acceleration of the body",
        "a",
        "m/s2, rad/s2",
        _BODY,
        "m/s2, rad/s2",
        1.0,
        "absolute, in body axes",
    ),
)


_ELEMENT = ("time", "element", "component")
_PATCH = ("time", "wheelset", "side", "patch")
PATCHES = ("tread", "flange root", "flange")

# Quantities that a run outputs only where its settings ask for them.
REQUESTED: dict[str, Quantity] = _table(
    Quantity(
        "element_deflection",
        "deflection of the element",
        "d",
        "m, rad",
        _ELEMENT,
        "mm, mrad",
        1e3,
        "body 2 against body 1, axes of body 1; a link's elongation stands under x",
    ),
    Quantity(
        "element_force",
        "force of the element",
        "F",
        "N, N m",
        _ELEMENT,
        "kN, kN m",
        1e-3,
        "on body 1, its axes; a link's tension stands under x",
    ),
    Quantity(
        "element_power",
        "power of the element",
        "P",
        "W",
        ("time", "element"),
        "kW",
        1e-3,
        "taken from the bodies",
    ),
    Quantity(
        "frictional_power",
        "frictional power of the wheel",
        "P_f",
        "W",
        _WHEEL,
        "kW",
        1e-3,
        "turned into heat in the contact, spin included, summed over the patches",
    ),
    Quantity(
        "axle_torque",
        "torque of drives and brakes on the wheelset",
        "M_d",
        "N m",
        ("time", "wheelset"),
        "kN m",
        1e-3,
        "forwards positive",
    ),
    Quantity("patch_N", "normal force of the patch", "N", "N", _PATCH, "kN", 1e-3),
    Quantity(
        "patch_pressure",
        "largest pressure of the patch",
        "p_{max}",
        "Pa",
        _PATCH,
        "MPa",
        1e-6,
        "Hertz: 3 N / (2 pi a b)",
    ),
    Quantity("patch_a", "semi-axis of the patch along the rail", "a", "m", _PATCH, "mm", 1e3),
    Quantity("patch_b", "semi-axis of the patch across the rail", "b", "m", _PATCH, "mm", 1e3),
    Quantity(
        "patch_angle",
        "contact angle",
        r"\gamma",
        "rad",
        _PATCH,
        "mrad",
        1e3,
        "positive where the normal into the rail leans to the right",
    ),
    Quantity(
        "patch_x",
        "position of the patch along the track",
        "x_c",
        "m",
        _PATCH,
        "mm",
        1e3,
        "from the wheelset's centre, forwards",
    ),
    Quantity(
        "patch_y",
        "position of the patch across the track",
        "y_c",
        "m",
        _PATCH,
        "mm",
        1e3,
        "from the wheelset's centre, to the right",
    ),
    Quantity(
        "patch_z",
        "depth of the patch",
        "z_c",
        "m",
        _PATCH,
        "mm",
        1e3,
        "from the wheelset's centre, down",
    ),
    Quantity(
        "patch_T_x",
        "longitudinal creep force",
        "T_x",
        "N",
        _PATCH,
        "kN",
        1e-3,
        "on the rail, forwards",
    ),
    Quantity(
        "patch_T_y",
        "lateral creep force",
        "T_y",
        "N",
        _PATCH,
        "kN",
        1e-3,
        "on the rail, in the contact plane to the right",
    ),
    Quantity(
        "patch_T_gamma",
        "wear number of the patch",
        r"T\gamma_c",
        "N",
        _PATCH,
        "N",
        1.0,
        "T_x xi_x + T_y xi_y, without the spin's part",
    ),
    Quantity(
        "patch_friction", "coefficient of friction of the patch", r"\mu", "1", _PATCH, "1", 1.0
    ),
    Quantity(
        "sensor_acceleration",
        "reading of the accelerometer",
        "a",
        "m/s2",
        ("time", "sensor", "axis"),
        "m/s2",
        1.0,
        "absolute acceleration minus gravity, in body axes; zero at rest on level track",
    ),
    Quantity(
        "sensor_roll_rate",
        "roll velocity of the body",
        r"\dot\varphi",
        "rad/s",
        ("time", "sensor"),
        "rad/s",
        1.0,
        "absolute, positive with the right side going down",
    ),
    Quantity(
        "sensor_absolute_acceleration",
        "acceleration of the point",
        "a_{abs}",
        "m/s2",
        ("time", "sensor", "axis"),
        "m/s2",
        1.0,
        "absolute, in body axes, gravity not taken off",
    ),
    Quantity(
        "sensor_velocity",
        "velocity of the point",
        "v",
        "m/s",
        ("time", "sensor", "axis"),
        "m/s",
        1.0,
        "relative to the moving track frame of its body, in its axes",
    ),
    Quantity(
        "sensor_displacement",
        "displacement of the point",
        "u",
        "m",
        ("time", "sensor", "axis"),
        "mm",
        1e3,
        "from its position in the nominal vehicle, in the track frame of its body",
    ),
    Quantity(
        "wheelset_lateral_on_track",
        "wheelset lateral displacement from the design track",
        "y_0",
        "m",
        _AXLE,
        "mm",
        1e3,
        "of the wheelset's centre in the track frame, positive to the right",
    ),
    Quantity(
        "wheelset_roll_on_track",
        "wheelset roll angle against the design track",
        r"\varphi_0",
        "rad",
        _AXLE,
        "mrad",
        1e3,
        "relative to the canted track plane, positive with the right wheel down",
    ),
    Quantity(
        "track_curvature",
        "curvature at the wheelset",
        r"\kappa",
        "1/m",
        _AXLE,
        "1/km",
        1e3,
        "positive to the right",
    ),
    Quantity(
        "track_cant",
        "cant at the wheelset",
        "h",
        "m",
        _AXLE,
        "mm",
        1e3,
        "positive with the left rail higher",
    ),
    Quantity(
        "track_gradient",
        "gradient at the wheelset",
        "i",
        "1",
        _AXLE,
        "per mille",
        1e3,
        "positive uphill",
    ),
    Quantity(
        "rail_lateral",
        "lateral displacement of the rail",
        "y_r",
        "m",
        _WHEEL,
        "mm",
        1e3,
        "irregularity at the wheelset's position, to the right",
    ),
    Quantity(
        "rail_vertical",
        "vertical displacement of the rail",
        "z_r",
        "m",
        _WHEEL,
        "mm",
        1e3,
        "irregularity at the wheelset's position, down",
    ),
    Quantity(
        "rail_deflection_lateral",
        "lateral deflection of the rail",
        "u_y",
        "m",
        _WHEEL,
        "mm",
        1e3,
        "of the elastic rail under the wheel, to the right",
    ),
    Quantity(
        "rail_deflection_vertical",
        "vertical deflection of the rail",
        "u_z",
        "m",
        _WHEEL,
        "mm",
        1e3,
        "of the elastic rail under the wheel, down",
    ),
)
