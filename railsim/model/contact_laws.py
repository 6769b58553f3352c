"""Creep and friction laws of the settings, one's own too, as the arrays of a contact."""

import numpy as np

from railsim.contact.creep import creep_law
from railsim.definitions import Settings, Track
from railsim.errors import input_error
from railsim.kernels.creep import USER
from railsim.kernels.patches import CreepLaw
from railsim.kernels.system import Contact
from railsim.kernels.user_laws import CREEP_INPUTS, CREEP_RESULTS, FRICTION_INPUTS, FRICTION_RESULTS
from railsim.laws.binding import CREEP_LAW, FRICTION_LAW, bind_use


def settings_creep_law(settings: Settings, track: Track) -> CreepLaw:
    """Creep law of the settings with the third body of the track."""
    if settings.adhesion_curve is not None and track.third_body != (1.0, 1.0):
        found = f"found {list(track.third_body)} together with settings.adhesion_curve"
        allowed = "[1.0, 1.0]: a measured curve holds the third body"
        raise input_error("track", found, allowed, key="third_body")
    return creep_law(
        settings.creep_law,
        settings.fastsim_grid,
        settings.shear_modulus,
        settings.poisson,
        track.third_body,
        settings.adhesion_curve,
    )


def with_own_laws(contact: Contact, settings: Settings) -> Contact:
    """Return the contact with the laws of one's own that the settings name.

    Raises InputError: A name that means nothing; a law that is not permitted or cannot be compiled.
    """
    if (use := settings.own_creep_law) is not None:
        bound, values = bind_use("settings", "own_creep_law", use, settings.laws, CREEP_LAW)
        block = np.array([0.0] * (CREEP_RESULTS + CREEP_INPUTS) + values)
        law = contact.law._replace(number=USER, user_law=bound.address, block=block)
        contact = contact._replace(law=law)
    if (use := settings.own_friction) is not None:
        bound, values = bind_use("settings", "own_friction", use, settings.laws, FRICTION_LAW)
        block = np.array([0.0] * (FRICTION_RESULTS + FRICTION_INPUTS) + values)
        contact = contact._replace(friction_law=bound.address, friction_block=block)
    return contact
