"""``railsim rail-wear``: rail profiles over the tonnage, see `railsim.cli.wear`."""

from railsim.cli.wear import rails as command

__all__ = ["command"]
