"""`static_loads`: wheel loads and preloads of a vehicle at rest on straight level track."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railsim.definitions.loading import load_track
from railsim.definitions.settings import Settings
from railsim.definitions.track import Track
from railsim.definitions.vehicle import Vehicle
from railsim.model.assembly import assemble
from railsim.model.equilibrium import equilibrium
from railsim.model.preloads import nominal_forces
from railsim.profiles import Profile
from railsim.text import html_table

Floats = NDArray[np.float64]

# The equilibrium is followed by that of steady rolling, which needs a speed [m/s].
SLOW = 10.0


@dataclass(frozen=True, eq=False)
class StaticLoads:
    """Static loads of a vehicle.

    Attributes
    ----------
    wheelsets : tuple of str
        Names from the leading end.
    Q0 : ndarray, shape (wheelset, side)
        Static wheel loads, left and right [N].
    preload : mapping of str to ndarray
        Preloads by element: tension of an element between two points, shape (1,), or force on
        the first body, shape (3,); elements without preload are left out [N].
    """

    wheelsets: tuple[str, ...]
    Q0: Floats
    preload: Mapping[str, Floats]

    @property
    def axle_load(self) -> Floats:
        """Static axle loads, shape (wheelset,) [N]."""
        return np.asarray(self.Q0.sum(axis=1))

    def record(self) -> dict[str, Any]:
        """Return the loads as plain numbers, SI."""
        return {
            "Q0": dict(zip(self.wheelsets, self.Q0.tolist(), strict=True)),
            "preload": {name: value.tolist() for name, value in self.preload.items()},
        }

    def __repr__(self) -> str:
        total = self.Q0.sum() / 1e3
        return f"<StaticLoads: {len(self.wheelsets)} wheelsets, together {total:.2f} kN>"

    def _repr_html_(self) -> str:
        rows = [
            [name, f"{left / 1e3:.3f}", f"{right / 1e3:.3f}", f"{(left + right) / 1e3:.3f}"]
            for name, (left, right) in zip(self.wheelsets, self.Q0, strict=True)
        ]
        header = ["wheelset", "Q0 left (kN)", "Q0 right (kN)", "axle load (kN)"]
        return html_table("Static loads", header, rows)


def static_loads(
    vehicle: Vehicle,
    track: Track | None = None,
    *,
    settings: Settings | None = None,
    profiles: Mapping[str, Profile] | None = None,
) -> StaticLoads:
    """Find the static wheel loads and preloads of a vehicle on straight level track.

    Parameters
    ----------
    vehicle : Vehicle
        Definition, see `load_vehicle`.
    track : Track, optional
        Its rails and gauge count; by default those of the shipped track `straight`.
    settings : Settings, optional
        Elasticity of wheels and rails.
    profiles : mapping of str to Profile, optional
        Profiles that take precedence over built-in ones and files.

    Raises
    ------
    ModelError
        There is no equilibrium.

    Examples
    --------
    >>> import railsim
    >>> loads = railsim.static_loads(railsim.load_vehicle("coach_manchester"))
    >>> (loads.Q0[0] / 1e3).round(1)
    array([68.8, 68.8])
    """
    track = load_track("straight") if track is None else track
    model = assemble(vehicle, track, settings or Settings(), profiles)
    balance = equilibrium(model, SLOW)
    model = balance.model
    tensions = np.array(model.system.links.spring[:, 2:])
    preload = dict(zip(model.index.links, tensions, strict=True))
    mounts = nominal_forces(model.system.mounts)
    preload |= dict(zip(model.index.mounts, mounts, strict=True))
    kept = {name: value for name, value in preload.items() if value.any()}
    return StaticLoads(tuple(model.index.wheelsets), balance.Q0.copy(), kept)
