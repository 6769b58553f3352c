"""Wheel and rail profiles.

============= ==================================================================
module        job
============= ==================================================================
`profile`     `Profile`: the points, their frame and where they come from
`builtin`     the built-in profiles, generated from their definitions
`readers`     CSV, SIMPACK and MiniProf files as they are
`recognition` conventions of the points of a file: recognised, corrected or refused
============= ==================================================================

Read `profile` first: it states the frames.
"""

import json
from pathlib import Path

from railsim.errors import input_error, nearest
from railsim.files.access import is_file, write_text
from railsim.profiles.builtin import DEFINITIONS, builtin_profile
from railsim.profiles.profile import Kind, Profile
from railsim.text import LONGEST_FILE, shortened

__all__ = ["Profile", "load_profile", "profile_text", "save_profile"]


def load_profile(name_or_path: str | Path, kind: Kind | None = None) -> Profile:
    """Profile by its built-in name or from a file.

    Parameters
    ----------
    name_or_path : str or Path
        Path of a file (CSV, SIMPACK ``.prw``/``.prr``, MiniProf ``.whl``/``.ban``) or name of a
        built-in profile; a file wins over a name.
    kind : "wheel", "rail" or None
        What the profile must be; None accepts both.

    Returns
    -------
    Profile
        Its `notes` list what was recognised and corrected.

    Raises
    ------
    InputError
        If there is no such profile, it is of the other kind, or the file holds none.

    Examples
    --------
    >>> load_profile("S1002").kind
    'wheel'
    """
    name = str(name_or_path)
    path = Path(name)
    if name in DEFINITIONS and not is_file(path):
        profile = builtin_profile(name)
    elif path.suffix or is_file(path):
        # reading is rare and needs scipy: not imported for built-in profiles
        from railsim.profiles.readers import read_profile_file
        from railsim.profiles.recognition import recognised_profile

        points = read_profile_file(path)
        points.file = name
        return recognised_profile(points, kind)
    else:
        raise input_error(
            shortened(name, LONGEST_FILE),
            "no such profile",
            nearest(name, DEFINITIONS) + " or the path of a file",
        )
    if kind is not None and profile.kind != kind:
        raise input_error(name, f"this is a {profile.kind} profile", f"give a {kind} profile")
    return profile


def save_profile(profile: Profile, path: Path) -> Path:
    """Write the file of `profile_text`; return its path.

    Raises InputError: the file cannot be written.
    """
    write_text(path, profile_text(profile))
    return path


def profile_text(profile: Profile) -> str:
    """Return a profile as text of a CSV file that can stand in a vehicle or track file."""
    lines = [f"# {profile.name}", *(f"# {json.dumps(note)}" for note in profile.notes), "y_mm,z_mm"]
    lines += [f"{1e3 * y:.6f},{1e3 * z:.6f}" for y, z in zip(profile.y, profile.z, strict=True)]
    return "\n".join(lines) + "\n"
