"""A wheel or rail profile as points, frozen and comparable.

Frames, the same for the right wheel and the right rail (z always points down at the contact):

wheel
    y from the nominal rolling circle, positive to the field side, flange negative; z outwards from
    the axle, so that the rolling radius is ``radius + z``.
rail
    y positive to the field side, gauge side negative; z down, crown at z = 0.

The left side is the mirror image.
"""

from dataclasses import dataclass, field
from html import escape
from typing import Literal, get_args

import numpy as np

from railsim.arrays import Floats
from railsim.errors import input_error
from railsim.text import printable, shortened

Kind = Literal["wheel", "rail"]

FEWEST_POINTS = 3

FLANGE_BACK = -0.070
"""Lateral position of the flange back from the nominal rolling circle [m] (EN 13715: 70 mm)."""


@dataclass(frozen=True, eq=False)
class Profile:
    """A wheel or rail profile.

    Attributes
    ----------
    name : str
        Name for messages, plots and results.
    kind : "wheel" or "rail"
        What it is.
    y, z : ndarray, shape (n,)
        Points along the contour from the flange (gauge) side to the field side [m]; frames in the
        module's text.  The arrays are read-only.
    source : str
        Where the numbers come from.
    inclination : float
        Inclination that a rail's points already carry, as tangent (0.025 for 1:40) [1].
    notes : tuple of str
        What was recognised and corrected when the profile was read, one sentence each.
    measured : ndarray, shape (2, n), optional
        y and z before smoothing, where the profile was smoothed [m].
    """

    name: str
    kind: Kind
    y: Floats
    z: Floats
    source: str = ""
    inclination: float = 0.0
    notes: tuple[str, ...] = field(default=())
    measured: Floats | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        for name in ("y", "z"):
            values = np.array(getattr(self, name), dtype=np.float64)
            values.setflags(write=False)
            object.__setattr__(self, name, values)
        at = f"profile '{self.name}'"
        if self.y.ndim != 1 or self.y.shape != self.z.shape or self.y.size < FEWEST_POINTS:
            found = f"arrays of shape {self.y.shape} and {self.z.shape}"
            allowed = f"two rows of equal length, {FEWEST_POINTS} points at least"
            raise input_error(at, found, allowed, key="y, z")
        if not np.isfinite([self.y, self.z]).all():
            raise input_error(at, "values that are not finite", "numbers in m", key="y, z")
        if self.kind not in get_args(Kind):
            raise input_error(at, shortened(repr(self.kind)), "wheel or rail", key="kind")
        y, (top, bottom) = self.y[[0, -1]], (self.z.min(), self.z.max())
        level = self.z[np.argmin(np.abs(self.y))]  # heights may count from the axle
        upwards = top < level - 0.02 and bottom < level + 0.005  # no flange, no side of a head
        if y[0] >= y[1] or upwards:
            found = f"y from {y[0]:g} to {y[1]:g}, z {top:g} to {bottom:g}"
            allowed = "y rises from the flange or gauge side to the field side, z points down"
            raise input_error(at, found, allowed, key="y, z")

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Profile):
            return NotImplemented
        return self.name == other.name and self.key() == other.key()

    def __hash__(self) -> int:
        return hash((self.name, self.key()))

    def __repr__(self) -> str:
        return f"<Profile {printable(self.name)!r}: {self.kind}, {self.y.size} points>"

    def _repr_html_(self) -> str:
        """Return the outline that a notebook shows, y to the right and z down, in mm."""
        y, z = 1e3 * self.y, 1e3 * self.z
        points = " ".join(f"{a:.2f},{b:.2f}" for a, b in zip(y, z, strict=True))
        box = f"{y.min() - 2:.1f} {z.min() - 2:.1f} {np.ptp(y) + 4:.1f} {np.ptp(z) + 4:.1f}"
        lines = f'<polyline points="{points}" fill="none" stroke="#004a80" stroke-width="0.6"/>'
        caption = f"{self.name}: {self.kind} profile, y from {y.min():.1f} to {y.max():.1f} mm"
        picture = f'<svg viewBox="{box}" width="420">{lines}</svg>'
        return f"<p>{escape(printable(caption))}</p>{picture}"

    def key(self) -> bytes:
        """Everything that enters the geometry, for hashing: not the name, not the source."""
        head = f"{self.kind} {self.inclination!r} {self.y.size} ".encode()
        return head + self.y.tobytes() + self.z.tobytes()
