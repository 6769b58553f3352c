"""What force elements become in the arrays of the model: columns by name, laws by name.

A `Link` acts along the line between two points, a `Mount` along the axes of body 1 at one point and
about them, a `Load` is a given force or torque on one body, a `Drive` a torque on a wheelset, an
`Act` a force that follows a command or a law of one's own.  The names of columns are those of
`railsim.kernels.element_columns`, those of the laws of internal states those of
`railsim.kernels.internal`; the forces are in `railsim.kernels.elements` and `.actuators`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

Rows = tuple[tuple[float, float], ...]
Triple = tuple[float, float, float]
NOTHING: Triple = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class State:
    """Internal state of an element.

    Of a ``maxwell`` damper with a spring in series (``maxwell_curve``: by a table), a ``pad`` that
    sticks and slides, the ``air`` of a reservoir, the ``lag`` of a command, a law of one's ``own``.
    """

    law: Literal["maxwell", "maxwell_curve", "pad", "air", "lag", "own"]
    parameter: Triple  # as in `railsim.kernels.internal.Internal`
    table: Rows | None = None  # force over velocity of ``maxwell_curve``


@dataclass(frozen=True)
class FrictionLimit:
    """Limit of friction along an axis: `force` + `coefficient` N, falling with the sliding speed.

    At high speed it is `ratio` times that at rest, in between with exp(-|v|/speed).
    """

    force: float = 0.0
    coefficient: float = 0.0
    ratio: float = 1.0
    speed: float = 1.0

    @property
    def exists(self) -> bool:
        """Whether there is friction at all."""
        return self.force > 0.0 or self.coefficient > 0.0


Limits = tuple[FrictionLimit, FrictionLimit, FrictionLimit]


@dataclass(frozen=True, kw_only=True)
class Link:
    """Spring and damper along a line: U = k d^2/2, tension positive; tables instead of k and c."""

    stiffness: float = 0.0
    damping: float = 0.0
    preload: float = 0.0
    state: State | None = None
    spring_table: Rows | None = None
    damper_table: Rows | None = None


@dataclass(frozen=True, kw_only=True)
class Mount:
    """Springs, dampers, tables and friction along the axes of body 1, rotation about them."""

    stiffness: Triple = NOTHING  # along x, y, z [N/m]
    damping: Triple = NOTHING  # [N s/m]
    preload: Triple = NOTHING  # [N]
    rotation: Triple = NOTHING  # stiffness about x, y, z [N m/rad]
    rotation_damping: Triple = NOTHING  # [N m s/rad]
    # force [N] over displacement [m] beside the springs
    tables: tuple[Rows | None, Rows | None, Rows | None] = (None, None, None)
    friction: Limits | None = None  # limits along x, y, z; `states` are then pads
    # of the forces along x, y, z
    states: tuple[State | None, State | None, State | None] = (None, None, None)
    translates: bool = True  # whether forces act, not moments alone
    # the force acts in the middle between the points, in the axes of both bodies
    both_ends: bool = False
    one_sided: bool = False  # spring and damper along z press and never pull


@dataclass(frozen=True, kw_only=True)
class Load:
    """Force or torque on a body: rows of time [s] or distance [m] and three components."""

    table: tuple[tuple[float, ...], ...]
    is_torque: bool = False
    track_axes: bool = False
    over_distance: bool = False


@dataclass(frozen=True, kw_only=True)
class Drive:
    """Torque on a wheelset over speed, times a demand over time or distance; slip control."""

    torque_table: Rows
    demand_table: Rows | None = None
    slip_control: tuple[float, float] | None = None
    brakes: bool = False
    over_distance: bool = False


AXES = ("x", "y", "z", "roll", "pitch", "yaw")


@dataclass(frozen=True, kw_only=True)
class Act:
    """A force that follows a command or a law of one's own."""

    action: str  # ``line``, one of `AXES` of body 1, or ``axle`` of body 2
    # what the command is; ``law``: an argument of the law
    mode: Literal["force", "damper", "position", "law", "brake"]
    sense: float = 1.0  # -1 where the axis is reversed
    lag: float = 0.0  # [s]
    delay: float = 0.0  # [s]
    stiffness: float = 0.0  # [N/m or N m/rad]
    damping: float = 0.0  # [N s/m or N m s]
    rate_limit: float | None = None  # of the command per second
    force_limit: float | None = None  # [N or N m]
    power_limit: float | None = None  # [W]
    stroke: float | None = None  # [m or rad]
    law: str = ""  # its name
    parameters: Mapping[str, float] = field(default_factory=dict)  # its further arguments


Row = Link | Mount | Load | Drive | Act


def pads(
    stiffness: Triple, friction: Limits, *, together: bool = True, skew: float = 0.0
) -> tuple[State | None, State | None, State | None]:
    """Return the friction states along the axes that have a limit.

    `together`: they are one vector within the ellipse of the limits; `skew`: of a wedge, the
    eccentricity of the conic about it.
    """
    axes = [k for k in range(3) if friction[k].exists]
    together = together and len(axes) > 1

    def pad(k: int) -> State | None:
        if k not in axes:
            return None
        last = k == axes[-1]
        number = float(len(axes) if last else 1) if together else 0.0
        return State("pad", (stiffness[k], number, skew if last else 0.0))

    return pad(0), pad(1), pad(2)
