"""The assumptions of a run, as an engineer reads them before it begins."""

from collections.abc import Iterable

from railsim.definitions.creep_law import CREEP_LAWS
from railsim.definitions.settings import Settings
from railsim.definitions.track.definition import Track
from railsim.definitions.vehicle.definition import Vehicle
from railsim.definitions.vehicle.flatten import flatten
from railsim.model.control import periods
from railsim.simulation.sampling import output_words, with_loop_rate


def assumptions(vehicle: Vehicle, track: Track, settings: Settings, speed: float) -> list[str]:
    """Return the assumptions of a run in customary units, one a line after the title.

    `speed`: at its start [m/s].
    """
    wheelsets = (body.wheelset for body in flatten(vehicle).bodies)
    wheels = _listed(name for wheelset in wheelsets if wheelset for name in wheelset.profile)
    inclination = f"1:{1.0 / track.inclination:.4g}" if track.inclination else "upright"
    most = [(with_loop_rate(settings).output_interval(speed), "output")]  # which no step exceeds
    most += [(period, "controllers and sampled signals") for period in periods(vehicle)]
    chosen = f"chosen, {1e3 * min(most)[0]:.4g} ms at most ({min(most)[1]})"
    step = chosen if settings.step is None else f"{settings.step * 1e3:.4g} ms"
    return [
        f"{vehicle.name_with_load} on {track.name} at {speed:g} m/s ({3.6 * speed:.4g} km/h)"
        f"{'' if settings.drive.mode == 'constant' else ' at the start'}",
        f"  contact   {wheels} on {_listed(track.rail)} inclined {inclination}, gauge "
        f"{track.gauge * 1e3:g} mm, friction {_friction(track, settings)}",
        f"  forces    {_creep_law(settings)}, G {settings.shear_modulus / 1e9:g} GPa, "
        f"contact damping {settings.contact_damping / 1e3:g} kNs/m",
        f"  track     transitions rounded over {track.rounding:g} m, cant about the "
        f"{'centre line' if track.cant_rotation == 'centre' else 'inner rail'}",
        f"  support   rails {track.support.words}",
        *_irregularity_lines(track),
        f"  time      scheme {settings.scheme}, step {step}, output {output_words(settings)}",
    ]


def _irregularity_lines(track: Track) -> list[str]:
    """Say what displaces the rails, in one line; nothing where they are smooth."""
    words = [part.summary() for part in track.irregularities]
    if len(words) > 3:
        words[2:] = [f"{len(words) - 2} more"]
    return [f"  rails     {'; '.join(words)}"] if words else []


def _friction(track: Track, settings: Settings) -> str:
    """Coefficients of friction, how they fall with slip, and the third body, where it is given."""
    text = _listed(f"{mu:g}" for mu in track.friction)
    if track.friction_table is not None:
        text = "by table"
    falling = track.friction_falling
    if settings.own_friction is not None:
        text += f" (times law {settings.own_friction.law} of the slip)"
    elif falling is not None:
        text += f" (with slip down to {falling.rest:g} of it, {falling.decay:g} s/m)"
    if track.third_body != (1.0, 1.0):
        factors = [f"{factor:g}" for factor in track.third_body]
        alone = settings.creep_law == "polach" and settings.own_creep_law is None
        text += f", third body {_listed(factors if alone else factors[:1])}"
        if not alone and factors[1] != factors[0]:
            text += f" (not {factors[1]} in the slip area: of Polach's law alone)"
    return text


def _creep_law(settings: Settings) -> str:
    law = CREEP_LAWS[settings.creep_law]
    nx, ny = settings.fastsim_grid
    text = f"{law.label} {nx} x {ny}" if law.grid else f"creep law {law.label}"
    if settings.own_creep_law is not None:
        text = f"creep law {settings.own_creep_law.law}"
    return text + ", transient" * settings.transient_creep


def _listed(names: Iterable[str]) -> str:
    return " / ".join(dict.fromkeys(str(name) for name in names))
