"""Laws of the components that a catalogue sells: gas spring, air spring, cylinder.

Pure functions of numbers and arrays, SI.  Forces are positive when the component pushes.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from railsim.arrays import Floats

EDGE = 1e-9  # share of an interval by which rounding may leave a table
T_REFERENCE = 20.0  # temperature to which the nominal forces of gas springs refer [C]


def gas_spring_force(
    compressed: Any,
    F1: Any,
    progression: Any,
    stroke: Any,
    law: str = "linear",
    temperature: Any = T_REFERENCE,
) -> Any:
    """Push of a gas spring without friction, compressed by a part s of its stroke S [N].

    Linear: `F = F1 (1 + (p - 1) s/S)`; isothermal: `F = F1/(1 - (1 - 1/p) s/S)`; both `F1` extended
    and `p F1` compressed, F1 at 20 C.  Temperature [C]: `gas_temperature_factor`.

    Source: makers' catalogues as collected by M. Merci (2017), ch. 3; the isothermal law is that of
    an ideal gas in a volume that the rod reduces linearly.

    >>> round(float(gas_spring_force(0.05, 1.0, 1.3, 0.1, "isothermal")), 4)
    1.1304
    """
    share = compressed / stroke
    if law == "isothermal":
        factor = 1.0 / (1.0 - (1.0 - 1.0 / progression) * share)
    else:
        factor = 1.0 + (progression - 1.0) * share
    return F1 * factor * gas_temperature_factor(temperature)


def gas_temperature_factor(temperature: Any) -> Any:
    """Force at a temperature over that at 20 C, `1 + 0.0036 (T - 20)`.

    0.36 % per degree as makers' catalogues print (Merci, 2017, ch. 3); an ideal gas in a fixed
    volume has (T + 273.15)/293.15, 0.34 % per degree.

    >>> round(400.0 * gas_temperature_factor(-30.0), 6)
    328.0
    """
    return 1.0 + 0.0036 * (temperature - T_REFERENCE)


def lid_force(weight: float, D: float, b: float, n: float, alpha: float) -> float:
    """Quick check of a lid's gas springs, `F1 = G D/(b n) 9.8 alpha` [N].

    Mass of the lid G [kg], levers of its centre of gravity D and of the springs b about the hinge,
    lid open [m], number of springs n, factor of safety alpha.

    Source: makers' catalogues (Merci, 2017); the springs should stand at about two thirds of the
    centre of gravity's distance.

    >>> round(lid_force(20.0, 0.4, 0.15, 2.0, 1.1), 3)
    287.467
    """
    return weight * D / (b * n) * 9.8 * alpha


def next_size(sizes: list[float], needed: float) -> float | None:
    """Smallest of the made sizes that is not below the wanted one; None where none is.

    >>> next_size([0.032, 0.04, 0.05], 0.033)
    0.04
    """
    return min((size for size in sizes if size >= needed * (1.0 - 1e-12)), default=None)


def table_value(rows: Floats, x: Any) -> Any:
    """Value of a table of rows (x, y), straight in between; NaN outside.

    >>> float(table_value(np.array([[0.0, 50.0], [2.0, 20.0]]), 1.0))
    35.0
    """
    k, share = _interval(rows[:, 0], x)
    return rows[k, 1] * (1.0 - share) + rows[k + 1, 1] * share


def _interval(grid: Any, x: Any) -> tuple[Any, Any]:
    """Interval of a rising grid (..., n) in which x (...) lies, share of it; NaN outside."""
    x = np.asarray(x)
    grid = np.broadcast_to(grid, (*x.shape, np.shape(grid)[-1]))
    below = np.sum(np.real(grid) <= np.real(x)[..., None], axis=-1) - 1
    k = np.clip(below, 0, grid.shape[-1] - 2)
    low, high = (np.take_along_axis(grid, i[..., None], -1)[..., 0] for i in (k, k + 1))
    share = (x - low) / (high - low)
    return k, np.where((np.real(share) >= -EDGE) & (np.real(share) <= 1.0 + EDGE), share, np.nan)


@dataclass(frozen=True)
class AirSpringTable:
    """Force of an air spring: linear in the height, then in the pressure."""

    heights: Floats  # rising [m]
    pressures: Floats  # rising [Pa]
    forces: Floats  # shape (height, pressure) [N]

    def rows(self, height: Any) -> Any:
        """Forces at the table's pressures, shape (..., pressure); NaN outside the heights."""
        k, share = _interval(self.heights, height)
        return self.forces[k] * (1.0 - share[..., None]) + self.forces[k + 1] * share[..., None]

    def force(self, height: Any, pressure: Any) -> Any:
        """Force [N]; NaN outside the table."""
        rows = self.rows(height)
        k, share = _interval(self.pressures, np.broadcast_to(pressure, rows.shape[:-1]))
        low, high = (np.take_along_axis(rows, i[..., None], -1)[..., 0] for i in (k, k + 1))
        return low * (1.0 - share) + high * share

    def pressure(self, height: Any, force: Any) -> Any:
        """Pressure that gives a force [Pa]; NaN outside the table.

        >>> table = AirSpringTable(np.array([0.1, 0.2]), np.array([2e5, 4e5]),
        ...                        np.array([[100.0, 300.0], [200.0, 400.0]]))
        >>> float(table.pressure(0.15, 250.0)), float(table.force(0.15, 3e5))
        (300000.0, 250.0)
        """
        rows = self.rows(height)
        k, share = _interval(rows, np.broadcast_to(force, rows.shape[:-1]))
        return self.pressures[k] * (1.0 - share) + self.pressures[k + 1] * share

    def reason(self, height: float, force: float) -> str:
        """Why there is no pressure for a height and a force."""
        at, (low, high) = f"{height * 1e3:.1f} mm", self.heights[[0, -1]]
        if not low <= height <= high:
            return f"height {at} is outside the table, {low * 1e3:g} to {high * 1e3:g} mm"
        least, most = self.rows(height)[[0, -1]]
        return f"{force:.0f} N at {at} is outside the table, {least:.0f} to {most:.0f} N"
