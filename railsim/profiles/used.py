"""The profiles that a vehicle or a track names: whether they are there and of the right kind."""

from collections.abc import Iterator, Mapping
from hashlib import sha256

from railsim.definitions import Track, Vehicle
from railsim.definitions.file_definition import FileDefinition
from railsim.definitions.vehicle.tables import Assembly
from railsim.errors import Fault, InputError
from railsim.profiles import load_profile
from railsim.profiles.profile import Kind
from railsim.text import LONGEST_FILE, shortened


def used_profiles(definition: FileDefinition) -> Iterator[tuple[str, str, Kind]]:
    """Yield key, name and kind of every profile of a vehicle or track, each once."""
    if isinstance(definition, Track):
        for name in dict.fromkeys(definition.rail):
            yield "rail", name, "rail"
    elif isinstance(definition, Vehicle):
        for key, name in dict.fromkeys(_wheel_profiles(definition, ())):
            yield key, name, "wheel"


def exchanged_wheels(vehicle: Vehicle, names: Mapping[str, str]) -> dict[str, list[str]]:
    """Return the profiles of both wheels by key, where one of them is replaced by another name."""
    found: dict[str, list[str]] = {}
    for key, name, _ in used_profiles(vehicle):
        found.setdefault(key, []).append(name)
    return {
        key: [names.get(name, name) for name in (both[0], both[-1])]
        for key, both in found.items()
        if names.keys() & {*both}
    }


def profile_hashes(*definitions: FileDefinition) -> dict[str, str]:
    """Return a hash of the points of every profile of some definitions, by name."""
    names = sorted({name for one in definitions for _, name, _ in used_profiles(one)})
    return {name: sha256(load_profile(name).key()).hexdigest() for name in names}


def profile_faults(definition: FileDefinition, file: str) -> Iterator[Fault]:
    """Yield a fault with file and key for every profile that cannot be loaded."""
    for key, name, kind in used_profiles(definition):
        try:
            load_profile(name, kind)
        except InputError as error:
            shown = shortened(name, LONGEST_FILE)
            for fault in error.faults:
                location = f", {fault.key}" if fault.key else ""
                found = f"profile '{shown}'{location}: {fault.found}"
                yield Fault(file, key, found, fault.allowed)


def _wheel_profiles(group: Vehicle | Assembly, path: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    for name, wheelset in group.wheelsets.items():
        for profile in wheelset.profile:
            yield ".".join((*path, "wheelsets", name, "profile")), profile
    for name, assembly in group.assemblies.items():
        yield from _wheel_profiles(assembly, (*path, "assemblies", name))
