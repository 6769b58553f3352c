"""The one table of quantities: name, symbol, unit, sign, how it is shown, and what it means.

Everything that names a quantity to a user (HDF5 attributes, plot axes, printed tables) reads it
from here; docs/notation.md is made from this table.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from math import pi
from typing import Any

COMPONENTS = ("x", "y", "z", "roll", "pitch", "yaw")
Y, Z, ROLL, PITCH, YAW = 1, 2, 3, 4, 5  # where they stand among the components of a body
SIDES = ("left", "right")
EXTREMES = ("max", "min")
DECIMALS = {"kN": 2, "mm": 2, "mrad": 2, "%": 2, "-": 3, "N": 1, "1e-3": 3, "s": 2, "m": 1}
"""Decimals in printed tables by shown unit; four digits for the others."""

SHOWN_UNITS = {
    "mm": ("m", 1e3), "km": ("m", 1e-3), "mm2": ("m2", 1e6), "mm/rad": ("m/rad", 1e3),
    "1/km": ("1/m", 1e3), "km/h": ("m/s", 3.6), "t": ("kg", 1e-3), "Mt": ("kg", 1e-9),
    "kN": ("N", 1e-3), "kN m": ("N m", 1e-3), "kN/m": ("N/m", 1e-3), "N/mm": ("N/m", 1e-3),
    "kN m/rad": ("N m/rad", 1e-3), "MPa": ("Pa", 1e-6), "kW": ("W", 1e-3), "mrad": ("rad", 1e3),
    "deg": ("rad", 180.0 / pi), "%": ("1", 100.0), "1e-3": ("1", 1e3), "per mille": ("1", 1e3),
    "-": ("1", 1.0),
}  # fmt: skip
"""SI unit of values shown in another one, and shown value over SI value."""

Formula = Callable[[Mapping[str, Any]], Any]


@dataclass(frozen=True, repr=False)
class Quantity:
    """A named quantity of a result.

    `name`, `long_name`: Name in files and in Python; words for axes and tables. `unit`: SI unit as
    stored; where the components differ, that of x, y, z and that of the angles, separated by a
    comma. `formula`: Its values from those of other quantities by name, `speed` of the vehicle
    among them (SI).
    """

    name: str
    long_name: str
    symbol: str  # symbol in mathtext, for plots
    unit: str
    dims: tuple[str, ...]  # dimensions in the result file
    shown_unit: str  # unit in printed tables and plots, the habit of the field
    scale: float  # shown value = stored value times `scale`
    sign: str = ""  # what a positive value means; empty for magnitudes and where the name says it
    request: str = ""  # key of `settings.outputs` that asks for it; empty for the usual quantities
    formula: Formula | None = field(default=None, compare=False)

    def __repr__(self) -> str:
        return f"<Quantity {self.name} [{self.unit}]>"

    def text(self, value: float) -> str:
        """Return a stored value as text in the shown unit, without the unit.

        >>> QUANTITIES["Q"].text(89123.4), QUANTITIES["Y_over_Q"].text(0.39012)
        ('89.12', '0.390')
        >>> QUANTITIES["sum_Y"].text(-1e-9)
        '0.00'
        """
        shown = value * self.scale
        decimals = DECIMALS.get(self.shown_unit)
        return f"{shown:.4g}" if decimals is None else f"{shown:z.{decimals}f}"

    @property
    def least(self) -> float:
        """Last digit of `text` in the shown unit, below which an axis would show rounding errors.

        Zero where `text` has no fixed number of digits.
        """
        decimals = DECIMALS.get(self.shown_unit)
        return 0.0 if decimals is None else 10.0**-decimals

    @property
    def words(self) -> str:
        """Long name with the shown unit, for printed tables."""
        return self.long_name if self.shown_unit == "-" else f"{self.long_name} ({self.shown_unit})"

    @property
    def title(self) -> str:
        """Long name as a title."""
        return self.long_name[:1].upper() + self.long_name[1:]

    @property
    def label(self) -> str:
        """Axis label: words, symbol and shown unit."""
        unit = "" if self.shown_unit == "-" else f" ({self.shown_unit})"
        return f"{self.title} ${self.symbol}${unit}"

    def component(self, name: str) -> "Quantity":
        """Return this quantity for one of `COMPONENTS`, with that component's unit.

        >>> QUANTITIES["body_position"].component("yaw").shown_unit
        'mrad'
        >>> REQUESTED["element_force"].component("pitch").symbol
        'M_y'
        """
        rotation = COMPONENTS.index(name) >= 3

        def one_unit(units: str) -> str:
            return units.split(", ")[-1 if rotation else 0]

        symbol = {"roll": r"\varphi", "pitch": r"\theta", "yaw": r"\psi"}.get(name, name)
        if self.name == "element_force":
            symbol = f"{'M' if rotation else 'F'}_{'xyz'[COMPONENTS.index(name) % 3]}"
        dots = {"body_velocity": r"\dot ", "body_acceleration": r"\ddot "}.get(self.name, "")
        return replace(self, long_name=f"{self.long_name}, {name}", symbol=f"{dots}{symbol}",
                       unit=one_unit(self.unit), shown_unit=one_unit(self.shown_unit))  # fmt: skip


_RUN = ("time",)
_WHEEL = ("time", "wheelset", "side")
_AXLE = ("time", "wheelset")
_BODY = ("time", "body", "component")
_ELEMENT = ("time", "element", "component")
_PATCH = ("time", "wheelset", "side", "patch")
_SENSOR = ("time", "sensor", "axis")
PATCHES = ("tread", "flange root", "flange")


def _row(
    name: str, long_name: str, symbol: str, shown: str, dims: tuple[str, ...],
    formula: Formula | None = None,
) -> Quantity:  # fmt: skip
    pairs = [SHOWN_UNITS.get(unit, (unit, 1.0)) for unit in shown.split(", ")]
    unit = ", ".join(stored for stored, _ in pairs)
    return Quantity(
        name, long_name, symbol, unit, dims, shown, pairs[0][1], SIGNS.get(name, ""), "", formula
    )


GREEK = {"Delta": "Δ", "Sigma": "Σ", "varphi": "φ", "phi": "φ", "psi": "ψ", "theta": "θ",
         "gamma": "γ", "kappa": "κ", "mu": "μ", "xi": "ξ", "dot": "", "ddot": ""}  # fmt: skip


def plain_symbol(symbol: str) -> str:
    r"""A symbol in mathtext as plain characters, for pages.

    >>> plain_symbol(r"\Delta Q/Q_0"), plain_symbol(r"\Sigma Y"), plain_symbol(r"T\gamma")
    ('ΔQ/Q₀', 'ΣY', 'Tγ')
    """
    text = re.sub(r"\\([a-z]+) ?", lambda m: GREEK.get(m[1], m[1]), symbol, flags=re.IGNORECASE)
    return text.translate(str.maketrans("", "", "{}")).replace("_0", "₀").replace("_", "")


def frictional_power(values: Mapping[str, Any]) -> Any:
    """Power that the contact of each wheel turns into heat, P = V (T_gamma + T_gamma_spin) [W].

    The wear numbers are work per metre of the vehicle's way; V is its speed.  Beside a check rail
    that of the back of the flange is added.
    """
    work = values["T_gamma"] + values["T_gamma_spin"] + values.get("check_rail_T_gamma", 0.0)
    return values["speed"][:, None, None] * work


def _on_request(key: str, *rows: Quantity) -> tuple[Quantity, ...]:
    return tuple(replace(row, request=key) for row in rows)


SIGNS = {
    "distance": "along the track; 0 at the start of the track",
    "mileage": "as the track's file gives it; the distance where it does not",
    "curvature": "positive to the right",
    "cant": "positive with the left rail higher",
    "Q": "on the rail, perpendicular to the track plane, positive pressing on the rail",
    "Y": "on the rail, in the track plane, positive to the right",
    "Y_over_Q": "positive when the wheel pushes its rail outwards",
    "dQ_over_Q0": "positive when the wheel is loaded more than at rest on straight level track",
    "sum_Y": "on the track, positive to the right",
    "wheelset_lateral": "from the middle of the irregular, deflected rails under the "
    "wheelset, along the line over their tops, positive to the right",
    "wheelset_roll": "relative to the line over the tops of the irregular, deflected rails, "
    "positive with the right wheel down",
    "wheelset_yaw": "relative to the radial position, positive with the nose to the right",
    "wheelset_distance": "along the track; 0 at the start of the track",
    "xi_x": "of the most loaded patch: wheel minus rail, over the speed, positive forward",
    "xi_y": "of the most loaded patch: wheel minus rail, over the speed, positive to the right",
    "phi": "of the most loaded patch: about the normal into the rail",
    "contact_y": "of the most loaded patch: from the wheelset's centre in track axes, to the right",
    "contact_z": "of the most loaded patch: from the wheelset's centre in track axes, down",
    "T_gamma": "T_x xi_x + T_y xi_y, summed over the patches, without the spin's part",
    "T_gamma_spin": "M_z phi, summed over the patches",
    "Q0": "at rest on straight level track",
    "body_position": "relative to the track frame of the body; zero in the nominal position",
    "body_velocity": "relative to the track frame of the body",
    "body_acceleration": "absolute, in body axes",
    "element_deflection": "body 2 against body 1, axes of body 1; a link's elongation stands "
    "under x",
    "element_force": "on body 1, its axes; a link's tension stands under x",
    "element_power": "taken from the bodies",
    "element_command": "behind its delay, before its lag; 0 where nothing is commanded",
    "frictional_power": "turned into heat in the contact, with spin and the flange back on "
    "check rails",
    "axle_torque": "forwards positive",
    "running_speed": "along the track",
    "patch_pressure": "Hertz: 3 N / (2 pi a b)",
    "patch_angle": "positive where the normal into the rail leans to the right",
    "patch_x": "from the wheelset's centre, forwards",
    "patch_y": "from the wheelset's centre, to the right",
    "patch_z": "from the wheelset's centre, down",
    "patch_T_x": "on the rail, forwards",
    "patch_T_y": "on the rail, in the contact plane to the right",
    "patch_T_gamma": "T_x xi_x + T_y xi_y, without the spin's part",
    "check_rail_force": "on the back of the flange, lateral; not part of Y",
    "check_rail_T_gamma": "friction work at the back of the flange per metre of the vehicle's way",
    "sensor_acceleration": "absolute acceleration minus gravity, in body axes; zero at rest "
    "on level track",
    "sensor_roll_rate": "absolute, positive with the right side going down",
    "sensor_absolute_acceleration": "absolute, in body axes, gravity not taken off",
    "sensor_velocity": "relative to the moving track frame of its body, in its axes",
    "sensor_displacement": "from its position in the nominal vehicle, in the track frame of "
    "its body",
    "wheelset_lateral_on_track": "of the wheelset's centre in the track frame, positive to "
    "the right",
    "wheelset_roll_on_track": "relative to the canted track plane, positive with the right "
    "wheel down",
    "track_curvature": "positive to the right",
    "track_cant": "positive with the left rail higher",
    "track_gradient": "positive uphill",
    "rail_lateral": "irregularity at the wheelset's position, to the right",
    "rail_vertical": "irregularity at the wheelset's position, down",
    "rail_deflection_lateral": "of the elastic rail under the wheel, to the right",
    "rail_deflection_vertical": "of the elastic rail under the wheel, down",
}
"""What a positive value means, or against what it is measured, by the quantity's name."""

QUANTITIES = {
    row.name: row
    for row in (
        _row("time", "time", "t", "s", _RUN),
        _row("distance", "distance of the reference body", "s", "m", _RUN),
        _row("mileage", "mileage of the reference body", "s_m", "m", _RUN),
        _row("curvature", "curvature at the reference body", r"\kappa", "1/km", _RUN),
        _row("cant", "cant at the reference body", "h", "mm", _RUN),
        _row("Q", "vertical wheel force", "Q", "kN", _WHEEL),
        _row("Y", "guiding force", "Y", "kN", _WHEEL),
        _row("Y_over_Q", "derailment quotient", "Y/Q", "-", _WHEEL),
        _row("dQ_over_Q0", "wheel load change", r"\Delta Q/Q_0", "%", _WHEEL),
        _row("sum_Y", "track shift force", r"\Sigma Y", "kN", _AXLE),
        _row("sum_abs_Y", "sum of guiding-force magnitudes", r"\Sigma |Y|", "kN", _AXLE),
        _row("wheelset_lateral", "wheelset lateral displacement", "y", "mm", _AXLE),
        _row("wheelset_roll", "wheelset roll angle", r"\varphi", "mrad", _AXLE),
        _row("wheelset_yaw", "wheelset yaw angle", r"\psi", "mrad", _AXLE),
        _row("wheelset_distance", "distance of the wheelset", "s", "m", _AXLE),
        _row("xi_x", "longitudinal creepage", r"\xi_x", "1e-3", _WHEEL),
        _row("xi_y", "lateral creepage", r"\xi_y", "1e-3", _WHEEL),
        _row("phi", "spin creepage", r"\phi", "1/m", _WHEEL),
        _row("contact_y", "lateral position of contact", "y_c", "mm", _WHEEL),
        _row("contact_z", "depth of contact", "z_c", "mm", _WHEEL),
        _row("T_gamma", "wear number", r"T\gamma", "N", _WHEEL),
        _row("T_gamma_spin", "wear number of spin", r"T\gamma_\phi", "N", _WHEEL),
        _row("Q0", "static wheel load", "Q_0", "kN", ("wheelset", "side")),
        _row("body_position", "position of the body", "q", "mm, mrad", _BODY),
        _row("body_velocity", "velocity of the body", r"\dot q", "m/s, rad/s", _BODY),
        _row("body_acceleration", "acceleration of the body", "a", "m/s2, rad/s2", _BODY),
    )
}
"""The usual quantities of a run, by name."""

REQUESTED = {
    row.name: row
    for row in (
        *_on_request("elements",
            _row("element_deflection", "deflection of the element", "d", "mm, mrad", _ELEMENT),
            _row("element_force", "force of the element", "F", "kN, kN m", _ELEMENT),
            _row("element_power", "power of the element", "P", "kW", ("time", "element")),
            _row("element_command", "command of the element", "u", "SI", ("time", "element"))),
        *_on_request("frictional_power",
            _row("frictional_power", "frictional power of the wheel", "P_f", "kW", _WHEEL,
                 frictional_power)),
        *_on_request("drives",
            _row("axle_torque", "torque of drives, brakes and actuators on the wheelset", "M_d",
                 "kN m", _AXLE),
            _row("running_speed", "speed of the reference body", "V", "km/h", _RUN)),
        *_on_request("contact_patches",
            _row("patch_N", "normal force of the patch", "N", "kN", _PATCH),
            _row("patch_pressure", "largest pressure of the patch", "p_{max}", "MPa", _PATCH),
            _row("patch_a", "semi-axis of the patch along the rail", "a", "mm", _PATCH),
            _row("patch_b", "semi-axis of the patch across the rail", "b", "mm", _PATCH),
            _row("patch_angle", "contact angle", r"\gamma", "mrad", _PATCH),
            _row("patch_x", "position of the patch along the track", "x_c", "mm", _PATCH),
            _row("patch_y", "position of the patch across the track", "y_c", "mm", _PATCH),
            _row("patch_z", "depth of the patch", "z_c", "mm", _PATCH),
            _row("patch_T_x", "longitudinal creep force", "T_x", "kN", _PATCH),
            _row("patch_T_y", "lateral creep force", "T_y", "kN", _PATCH),
            _row("patch_T_gamma", "wear number of the patch", r"T\gamma_c", "N", _PATCH),
            _row("patch_friction", "coefficient of friction of the patch", r"\mu", "1", _PATCH)),
        *_on_request("check_rail",
            _row("check_rail_force", "force of the check rail", "F_c", "kN", _WHEEL),
            _row("check_rail_T_gamma", "wear number of the check rail", r"T\gamma_{cr}", "N",
                 _WHEEL)),
        *_on_request("sensors",
            _row("sensor_acceleration", "reading of the accelerometer", "a", "m/s2", _SENSOR),
            _row("sensor_roll_rate", "roll velocity of the body", r"\dot\varphi", "rad/s",
                 ("time", "sensor")),
            _row("sensor_absolute_acceleration", "acceleration of the point", "a_{abs}", "m/s2",
                 _SENSOR),
            _row("sensor_velocity", "velocity of the point", "v", "m/s", _SENSOR),
            _row("sensor_displacement", "displacement of the point", "u", "mm", _SENSOR)),
        *_on_request("track",
            _row("wheelset_lateral_on_track",
                 "wheelset lateral displacement from the design track", "y_0", "mm", _AXLE),
            _row("wheelset_roll_on_track", "wheelset roll angle against the design track",
                 r"\varphi_0", "mrad", _AXLE),
            _row("track_curvature", "curvature at the wheelset", r"\kappa", "1/km", _AXLE),
            _row("track_cant", "cant at the wheelset", "h", "mm", _AXLE),
            _row("track_gradient", "gradient at the wheelset", "i", "per mille", _AXLE),
            _row("rail_lateral", "lateral displacement of the rail", "y_r", "mm", _WHEEL),
            _row("rail_vertical", "vertical displacement of the rail", "z_r", "mm", _WHEEL),
            _row("rail_deflection_lateral", "lateral deflection of the rail", "u_y", "mm", _WHEEL),
            _row("rail_deflection_vertical", "vertical deflection of the rail", "u_z", "mm",
                 _WHEEL)),
    )
}  # fmt: skip
"""Quantities that a run outputs only where its settings ask for them."""
