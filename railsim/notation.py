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
SIDES = ("left", "right")
EXTREMES = ("max", "min")
DECIMALS = {"kN": 2, "mm": 2, "mrad": 2, "%": 2, "-": 3, "N": 1, "1e-3": 3, "s": 2, "m": 1}
"""Decimals in printed tables by shown unit; four digits for the others."""

SHOWN_UNITS = {
    "mm": ("m", 1e3),
    "km": ("m", 1e-3),
    "mm2": ("m2", 1e6),
    "mm/rad": ("m/rad", 1e3),
    "1/km": ("1/m", 1e3),
    "km/h": ("m/s", 3.6),
    "t": ("kg", 1e-3),
    "Mt": ("kg", 1e-9),
    "kN": ("N", 1e-3),
    "kN m": ("N m", 1e-3),
    "kN/m": ("N/m", 1e-3),
    "N/mm": ("N/m", 1e-3),
    "kN m/rad": ("N m/rad", 1e-3),
    "MPa": ("Pa", 1e-6),
    "kW": ("W", 1e-3),
    "mrad": ("rad", 1e3),
    "deg": ("rad", 180.0 / pi),
    "%": ("1", 100.0),
    "1e-3": ("1", 1e3),
    "per mille": ("1", 1e3),
    "-": ("1", 1.0),
}
"""SI unit of values shown in another one, and shown value over SI value."""


Formula = Callable[[Mapping[str, Any]], Any]


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
    request : str
        Key of `settings.outputs` that asks for it; empty for the usual quantities.
    formula : callable, optional
        Its values from those of other quantities by name, `speed` of the vehicle among them (SI).
    """

    name: str
    long_name: str
    symbol: str
    unit: str
    dims: tuple[str, ...]
    shown_unit: str
    scale: float
    sign: str = ""
    request: str = ""
    formula: Formula | None = field(default=None, compare=False, repr=False)

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
        >>> REQUESTED["element_force"].component("pitch").symbol
        'M_y'
        """
        rotation = COMPONENTS.index(name) >= 3

        def own(units: str) -> str:
            return units.split(", ")[-1 if rotation else 0]

        symbol = {"roll": r"\varphi", "pitch": r"\theta", "yaw": r"\psi"}.get(name, name)
        if self.name == "element_force":
            symbol = f"{'M' if rotation else 'F'}_{'xyz'[COMPONENTS.index(name) % 3]}"
        dots = {"body_velocity": r"\dot ", "body_acceleration": r"\ddot "}.get(self.name, "")
        return replace(
            self,
            long_name=f"{self.long_name}, {name}",
            symbol=f"{dots}{symbol}",
            unit=own(self.unit),
            shown_unit=own(self.shown_unit),
        )


_RUN = ("time",)
_WHEEL = ("time", "wheelset", "side")
_AXLE = ("time", "wheelset")
_BODY = ("time", "body", "component")
_ELEMENT = ("time", "element", "component")
_PATCH = ("time", "wheelset", "side", "patch")
_SENSOR = ("time", "sensor", "axis")
PATCHES = ("tread", "flange root", "flange")


def _row(
    name: str,
    words: str,
    symbol: str,
    shown: str,
    dims: tuple[str, ...],
    sign: str = "",
    formula: Formula | None = None,
) -> Quantity:
    known = [SHOWN_UNITS.get(unit, (unit, 1.0)) for unit in shown.split(", ")]
    unit = ", ".join(stored for stored, _ in known)
    return Quantity(name, words, symbol, unit, dims, shown, known[0][1], sign, "", formula)


GREEK = {"Delta": "Δ", "Sigma": "Σ", "varphi": "φ", "phi": "φ", "psi": "ψ", "theta": "θ",
         "gamma": "γ", "kappa": "κ", "mu": "μ", "xi": "ξ", "dot": "", "ddot": ""}  # fmt: skip


def plain_symbol(symbol: str) -> str:
    r"""A symbol in mathtext as plain characters, for pages.

    Examples
    --------
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


def _requested(key: str, *rows: Quantity) -> tuple[Quantity, ...]:
    return tuple(replace(row, request=key) for row in rows)


QUANTITIES = {
    row.name: row
    for row in (
        _row("time", "time", "t", "s", _RUN),
        _row(
            "distance",
            "distance of the reference body",
            "s",
            "m",
            _RUN,
            "along the track; 0 at the start of the track",
        ),
        _row(
            "mileage",
            "mileage of the reference body",
            "s_m",
            "m",
            _RUN,
            "as the track's file gives it; the distance where it does not",
        ),
        _row(
            "curvature",
            "curvature at the reference body",
            r"\kappa",
            "1/km",
            _RUN,
            "positive to the right",
        ),
        _row(
            "cant",
            "cant at the reference body",
            "h",
            "mm",
            _RUN,
            "positive with the left rail higher",
        ),
        _row(
            "Q",
            "vertical wheel force",
            "Q",
            "kN",
            _WHEEL,
            "on the rail, perpendicular to the track plane, positive pressing on the rail",
        ),
        _row(
            "Y",
            "guiding force",
            "Y",
            "kN",
            _WHEEL,
            "on the rail, in the track plane, positive to the right",
        ),
        _row(
            "Y_over_Q",
            "derailment quotient",
            "Y/Q",
            "-",
            _WHEEL,
            "positive when the wheel pushes its rail outwards",
        ),
        _row(
            "dQ_over_Q0",
            "wheel load change",
            r"\Delta Q/Q_0",
            "%",
            _WHEEL,
            "positive when the wheel is loaded more than at rest on straight level track",
        ),
        _row(
            "sum_Y",
            "track shift force",
            r"\Sigma Y",
            "kN",
            _AXLE,
            "on the track, positive to the right",
        ),
        _row("sum_abs_Y", "sum of guiding-force magnitudes", r"\Sigma |Y|", "kN", _AXLE),
        _row(
            "wheelset_lateral",
            "wheelset lateral displacement",
            "y",
            "mm",
            _AXLE,
            (
                "from the middle of the irregular, deflected rails under the wheelset, along the "
                "line over their tops, positive to the right"
            ),
        ),
        _row(
            "wheelset_roll",
            "wheelset roll angle",
            r"\varphi",
            "mrad",
            _AXLE,
            (
                "relative to the line over the tops of the irregular, deflected rails, positive "
                "with the right wheel down"
            ),
        ),
        _row(
            "wheelset_yaw",
            "wheelset yaw angle",
            r"\psi",
            "mrad",
            _AXLE,
            "relative to the radial position, positive with the nose to the right",
        ),
        _row(
            "wheelset_distance",
            "distance of the wheelset",
            "s",
            "m",
            _AXLE,
            "along the track; 0 at the start of the track",
        ),
        _row(
            "xi_x",
            "longitudinal creepage",
            r"\xi_x",
            "1e-3",
            _WHEEL,
            "of the most loaded patch: wheel minus rail, over the speed, positive forward",
        ),
        _row(
            "xi_y",
            "lateral creepage",
            r"\xi_y",
            "1e-3",
            _WHEEL,
            "of the most loaded patch: wheel minus rail, over the speed, positive to the right",
        ),
        _row(
            "phi",
            "spin creepage",
            r"\phi",
            "1/m",
            _WHEEL,
            "of the most loaded patch: about the normal into the rail",
        ),
        _row(
            "contact_y",
            "lateral position of contact",
            "y_c",
            "mm",
            _WHEEL,
            "of the most loaded patch: from the wheelset's centre in track axes, to the right",
        ),
        _row(
            "contact_z",
            "depth of contact",
            "z_c",
            "mm",
            _WHEEL,
            "of the most loaded patch: from the wheelset's centre in track axes, down",
        ),
        _row(
            "T_gamma",
            "wear number",
            r"T\gamma",
            "N",
            _WHEEL,
            "T_x xi_x + T_y xi_y, summed over the patches, without the spin's part",
        ),
        _row(
            "T_gamma_spin",
            "wear number of spin",
            r"T\gamma_\phi",
            "N",
            _WHEEL,
            "M_z phi, summed over the patches",
        ),
        _row(
            "Q0",
            "static wheel load",
            "Q_0",
            "kN",
            ("wheelset", "side"),
            "at rest on straight level track",
        ),
        _row(
            "body_position",
            "position of the body",
            "q",
            "mm, mrad",
            _BODY,
            "relative to the track frame of the body; zero in the nominal position",
        ),
        _row(
            "body_velocity",
            "velocity of the body",
            r"\dot q",
            "m/s, rad/s",
            _BODY,
            "relative to the track frame of the body",
        ),
        _row(
            "body_acceleration",
            "acceleration of the body",
            "a",
            "m/s2, rad/s2",
            _BODY,
            "absolute, in body axes",
        ),
    )
}
"""The usual quantities of a run, by name."""

REQUESTED = {
    row.name: row
    for row in (
        *_requested(
            "elements",
            _row(
                "element_deflection",
                "deflection of the element",
                "d",
                "mm, mrad",
                _ELEMENT,
                "body 2 against body 1, axes of body 1; a link's elongation stands under x",
            ),
            _row(
                "element_force",
                "force of the element",
                "F",
                "kN, kN m",
                _ELEMENT,
                "on body 1, its axes; a link's tension stands under x",
            ),
            _row(
                "element_power",
                "power of the element",
                "P",
                "kW",
                ("time", "element"),
                "taken from the bodies",
            ),
            _row(
                "element_command",
                "command of the element",
                "u",
                "SI",
                ("time", "element"),
                "behind its delay, before its lag; 0 where nothing is commanded",
            ),
        ),
        *_requested(
            "frictional_power",
            _row(
                "frictional_power",
                "frictional power of the wheel",
                "P_f",
                "kW",
                _WHEEL,
                "turned into heat in the contact, with spin and the flange back on check rails",
                frictional_power,
            ),
        ),
        *_requested(
            "drives",
            _row(
                "axle_torque",
                "torque of drives, brakes and actuators on the wheelset",
                "M_d",
                "kN m",
                _AXLE,
                "forwards positive",
            ),
        ),
        *_requested(
            "contact_patches",
            _row("patch_N", "normal force of the patch", "N", "kN", _PATCH),
            _row(
                "patch_pressure",
                "largest pressure of the patch",
                "p_{max}",
                "MPa",
                _PATCH,
                "Hertz: 3 N / (2 pi a b)",
            ),
            _row("patch_a", "semi-axis of the patch along the rail", "a", "mm", _PATCH),
            _row("patch_b", "semi-axis of the patch across the rail", "b", "mm", _PATCH),
            _row(
                "patch_angle",
                "contact angle",
                r"\gamma",
                "mrad",
                _PATCH,
                "positive where the normal into the rail leans to the right",
            ),
            _row(
                "patch_x",
                "position of the patch along the track",
                "x_c",
                "mm",
                _PATCH,
                "from the wheelset's centre, forwards",
            ),
            _row(
                "patch_y",
                "position of the patch across the track",
                "y_c",
                "mm",
                _PATCH,
                "from the wheelset's centre, to the right",
            ),
            _row(
                "patch_z",
                "depth of the patch",
                "z_c",
                "mm",
                _PATCH,
                "from the wheelset's centre, down",
            ),
            _row(
                "patch_T_x",
                "longitudinal creep force",
                "T_x",
                "kN",
                _PATCH,
                "on the rail, forwards",
            ),
            _row(
                "patch_T_y",
                "lateral creep force",
                "T_y",
                "kN",
                _PATCH,
                "on the rail, in the contact plane to the right",
            ),
            _row(
                "patch_T_gamma",
                "wear number of the patch",
                r"T\gamma_c",
                "N",
                _PATCH,
                "T_x xi_x + T_y xi_y, without the spin's part",
            ),
            _row("patch_friction", "coefficient of friction of the patch", r"\mu", "1", _PATCH),
        ),
        *_requested(
            "check_rail",
            _row(
                "check_rail_force",
                "force of the check rail",
                "F_c",
                "kN",
                _WHEEL,
                "on the back of the flange, lateral; not part of Y",
            ),
            _row(
                "check_rail_T_gamma",
                "wear number of the check rail",
                r"T\gamma_{cr}",
                "N",
                _WHEEL,
                "friction work at the back of the flange per metre of the vehicle's way",
            ),
        ),
        *_requested(
            "sensors",
            _row(
                "sensor_acceleration",
                "reading of the accelerometer",
                "a",
                "m/s2",
                _SENSOR,
                "absolute acceleration minus gravity, in body axes; zero at rest on level track",
            ),
            _row(
                "sensor_roll_rate",
                "roll velocity of the body",
                r"\dot\varphi",
                "rad/s",
                ("time", "sensor"),
                "absolute, positive with the right side going down",
            ),
            _row(
                "sensor_absolute_acceleration",
                "acceleration of the point",
                "a_{abs}",
                "m/s2",
                _SENSOR,
                "absolute, in body axes, gravity not taken off",
            ),
            _row(
                "sensor_velocity",
                "velocity of the point",
                "v",
                "m/s",
                _SENSOR,
                "relative to the moving track frame of its body, in its axes",
            ),
            _row(
                "sensor_displacement",
                "displacement of the point",
                "u",
                "mm",
                _SENSOR,
                "from its position in the nominal vehicle, in the track frame of its body",
            ),
        ),
        *_requested(
            "track",
            _row(
                "wheelset_lateral_on_track",
                "wheelset lateral displacement from the design track",
                "y_0",
                "mm",
                _AXLE,
                "of the wheelset's centre in the track frame, positive to the right",
            ),
            _row(
                "wheelset_roll_on_track",
                "wheelset roll angle against the design track",
                r"\varphi_0",
                "mrad",
                _AXLE,
                "relative to the canted track plane, positive with the right wheel down",
            ),
            _row(
                "track_curvature",
                "curvature at the wheelset",
                r"\kappa",
                "1/km",
                _AXLE,
                "positive to the right",
            ),
            _row(
                "track_cant",
                "cant at the wheelset",
                "h",
                "mm",
                _AXLE,
                "positive with the left rail higher",
            ),
            _row(
                "track_gradient",
                "gradient at the wheelset",
                "i",
                "per mille",
                _AXLE,
                "positive uphill",
            ),
            _row(
                "rail_lateral",
                "lateral displacement of the rail",
                "y_r",
                "mm",
                _WHEEL,
                "irregularity at the wheelset's position, to the right",
            ),
            _row(
                "rail_vertical",
                "vertical displacement of the rail",
                "z_r",
                "mm",
                _WHEEL,
                "irregularity at the wheelset's position, down",
            ),
            _row(
                "rail_deflection_lateral",
                "lateral deflection of the rail",
                "u_y",
                "mm",
                _WHEEL,
                "of the elastic rail under the wheel, to the right",
            ),
            _row(
                "rail_deflection_vertical",
                "vertical deflection of the rail",
                "u_z",
                "mm",
                _WHEEL,
                "of the elastic rail under the wheel, down",
            ),
        ),
    )
}
"""Quantities that a run outputs only where its settings ask for them."""
