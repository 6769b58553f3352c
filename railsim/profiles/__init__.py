"""Wheel and rail profiles.

========== =====================================================================
module     job
========== =====================================================================
`profile`  `Profile`: the points, their frame and where they come from
`builtin`  the built-in profiles, generated from their definitions
========== =====================================================================

Read `profile` first: it states the frames.
"""

from railsim.errors import Fault, InputError, nearest
from railsim.profiles.builtin import DEFINITIONS, builtin_profile
from railsim.profiles.profile import Kind, Profile

__all__ = ["Profile", "load_profile"]


def load_profile(name_or_path: str, kind: Kind | None = None) -> Profile:
    """Built-in profile by name.

    Parameters
    ----------
    name_or_path : str
        Name of a built-in profile.
    kind : "wheel", "rail" or None
        What the profile must be; None accepts both.

    Returns
    -------
    Profile

    Raises
    ------
    InputError
        If there is no such profile or it is of the other kind.
    """
    if name_or_path not in DEFINITIONS:
        raise InputError(
            [Fault(name_or_path, "", "no such profile", nearest(name_or_path, DEFINITIONS))]
        )
    profile = builtin_profile(name_or_path)
    if kind is not None and profile.kind != kind:
        raise InputError(
            [Fault(name_or_path, "", f"this is a {profile.kind} profile", f"give a {kind} profile")]
        )
    return profile
