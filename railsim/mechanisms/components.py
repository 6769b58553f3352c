"""Laws of the components that a catalogue sells: gas spring, air spring, cylinder.

Pure functions of numbers and arrays, SI.  Forces are positive when the component pushes.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

T_REFERENCE = 20.0
"""Temperature to which the nominal forces of gas springs refer [C]."""


def gas_spring_force(
    compressed: Any,
    F1: Any,
    progression: Any,
    stroke: Any,
    law: str = "linear",
    temperature: Any = T_REFERENCE,
) -> Any:
    """Push of a gas spring without friction [N].

    Linear: `F = F1 (1 + (p - 1) s/S)`; isothermal: `F = F1/(1 - (1 - 1/p) s/S)`; both `F1` extended
    and `p F1` compressed.  Temperature: `gas_temperature_factor`.

    Parameters
    ----------
    compressed : float or ndarray
        Part of the stroke that is compressed s [m].
    F1 : float
        Force fully extended at 20 C [N].
    progression : float
        p = F2/F1.
    stroke : float
        Stroke S [m].
    law : {'linear', 'isothermal'}
    temperature : float
        Temperature of the gas [C].

    Notes
    -----
    Source: makers' catalogues as collected by M. Merci (2017), ch. 3; the isothermal law is that of
    an ideal gas in a volume that the rod reduces linearly.

    Examples
    --------
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

    Examples
    --------
    >>> round(400.0 * gas_temperature_factor(-30.0), 6)
    328.0
    """
    return 1.0 + 0.0036 * (temperature - T_REFERENCE)


def lid_force(weight: float, D: float, b: float, n: float, alpha: float) -> float:
    """Quick check of a lid's gas springs, `F1 = G D/(b n) 9.8 alpha` [N].

    Parameters
    ----------
    weight : float
        Mass of the lid G [kg].
    D, b : float
        Levers of the centre of gravity and of the springs about the hinge, lid open [m].
    n : float
        Number of springs.
    alpha : float
        Factor of safety.

    Notes
    -----
    Source: makers' catalogues (Merci, 2017); the springs should stand at about two thirds of the
    centre of gravity's distance.

    Examples
    --------
    >>> round(lid_force(20.0, 0.4, 0.15, 2.0, 1.1), 3)
    287.467
    """
    return weight * D / (b * n) * 9.8 * alpha


def cylinder_area(bore: Any, rod: Any, count: Any, acts: str) -> Any:
    """Effective area of cylinders side by side, less the rods where they pull [m2]."""
    free = bore * bore - (rod * rod if acts == "pull" else 0.0)
    return count * 0.25 * np.pi * free


def next_size(sizes: list[float], wanted: float) -> float | None:
    """Smallest of the made sizes that is not below the wanted one; None where none is.

    Examples
    --------
    >>> next_size([0.032, 0.04, 0.05], 0.033)
    0.04
    """
    return min((size for size in sizes if size >= wanted * (1.0 - 1e-12)), default=None)


def table_value(rows: NDArray[np.float64], x: Any) -> Any:
    """Value of a table of rows (x, y), straight in between; NaN outside.

    Examples
    --------
    >>> float(table_value(np.array([[0.0, 50.0], [2.0, 20.0]]), 1.0))
    35.0
    """
    k = np.clip(np.searchsorted(rows[:, 0], np.real(x), side="right") - 1, 0, len(rows) - 2)
    share = (x - rows[k, 0]) / (rows[k + 1, 0] - rows[k, 0])
    inside = (np.real(share) >= -1e-9) & (np.real(share) <= 1.0 + 1e-9)
    return np.where(inside, rows[k, 1] * (1.0 - share) + rows[k + 1, 1] * share, np.nan)


class AirSpringTable:
    """Force of an air spring over height and pressure: linear in the height, then in the pressure.

    Parameters
    ----------
    heights, pressures : ndarray
        Rising [m], [Pa].
    forces : ndarray, shape (height, pressure)
        [N]
    """

    def __init__(
        self,
        heights: NDArray[np.float64],
        pressures: NDArray[np.float64],
        forces: NDArray[np.float64],
    ) -> None:
        self.heights, self.pressures, self.forces = heights, pressures, forces

    def rows(self, height: Any) -> Any:
        """Forces at the table's pressures, shape (..., pressure); NaN outside the heights."""
        x = np.real(height)
        k = np.clip(np.searchsorted(self.heights, x, side="right") - 1, 0, len(self.heights) - 2)
        share = (height - self.heights[k]) / (self.heights[k + 1] - self.heights[k])
        edge = 1e-9
        inside = (np.real(share) >= -edge) & (np.real(share) <= 1.0 + edge)
        share = np.where(inside, share, np.nan)[..., None]
        return self.forces[k] * (1.0 - share) + self.forces[k + 1] * share

    def force(self, height: Any, pressure: Any) -> Any:
        """Force [N]; NaN outside the table."""
        rows = self.rows(height)
        column, share = self._column(np.broadcast_to(self.pressures, rows.shape), pressure)
        return _between(rows, column, share)

    def pressure(self, height: Any, force: Any) -> Any:
        """Pressure that gives a force [Pa]; NaN outside the table.

        Examples
        --------
        >>> table = AirSpringTable(np.array([0.1, 0.2]), np.array([2e5, 4e5]),
        ...                        np.array([[100.0, 300.0], [200.0, 400.0]]))
        >>> float(table.pressure(0.15, 250.0)), float(table.force(0.15, 3e5))
        (300000.0, 250.0)
        """
        rows = self.rows(height)
        column, share = self._column(rows, force)
        return _between(np.broadcast_to(self.pressures, rows.shape), column, share)

    def _column(self, grid: Any, value: Any) -> tuple[Any, Any]:
        """Column below a value in each rising row of a grid, and the share towards the next."""
        value = np.broadcast_to(value, grid.shape[:-1])
        below = np.sum(np.real(grid) <= np.real(value)[..., None], axis=-1) - 1
        column = np.clip(below, 0, grid.shape[-1] - 2)[..., None]
        low = np.take_along_axis(grid, column, -1)
        high = np.take_along_axis(grid, column + 1, -1)
        share = (value[..., None] - low) / (high - low)
        edge = 1e-9
        inside = (np.real(share) >= -edge) & (np.real(share) <= 1.0 + edge)
        return column, np.where(inside, share, np.nan)

    def reason(self, height: float, force: float) -> str:
        """Why there is no pressure for a height and a force."""
        low, high = self.heights[0], self.heights[-1]
        if not low <= height <= high:
            return f"height {height * 1e3:.1f} mm is outside the table, {low * 1e3:g} to " + (
                f"{high * 1e3:g} mm"
            )
        row = self.rows(height)
        return (
            f"{force:.0f} N at {height * 1e3:.1f} mm is outside the table, {row[0]:.0f} to "
            f"{row[-1]:.0f} N"
        )


def _between(grid: Any, column: Any, share: Any) -> Any:
    low = np.take_along_axis(grid, column, -1)
    high = np.take_along_axis(grid, column + 1, -1)
    return (low * (1.0 - share) + high * share)[..., 0]
