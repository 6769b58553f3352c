"""Sampling without aliasing: output rate of the loop if a low-pass filter is requested."""

import math

from railsim.definitions.settings import Settings
from railsim.result import Sink
from railsim.result.low_pass import LowPassSink

FINE = 1000.0
"""Least rate of the loop's own output where it is filtered [1/s]: contact forces of vehicles on
rails have little above 500 Hz."""


def instants_for_each(settings: Settings) -> int:
    """Instants of the loop for each stored one; 1 without a low pass."""
    if settings.outputs.low_pass is None:
        return 1
    return max(2, math.ceil(FINE / settings.output_rate * (1.0 - 1e-9)))


def with_loop_rate(settings: Settings) -> Settings:
    """Settings with the rate of the loop's own output."""
    every = instants_for_each(settings)
    if every == 1:
        return settings
    return settings.model_copy(update={"output_rate": every * settings.output_rate})


def filtering(sink: Sink, settings: Settings) -> Sink:
    """Sink that filters before the given one, where the settings ask for it."""
    asked = settings.outputs.low_pass
    if asked is None:
        return sink
    return LowPassSink(
        sink,
        instants_for_each(settings),
        settings.output_rate,
        asked.frequency,
        causal=asked.phase == "causal",
    )


def low_pass_remark(settings: Settings) -> str:
    """Sentence on the low pass of a run's values; empty without one."""
    asked = settings.outputs.low_pass
    if asked is None:
        return ""
    if asked.phase == "causal":
        return f"Values are low-passed by a causal Butterworth filter, {asked.frequency:g} Hz."
    words = f"zero-phase low-pass filtered, flat to {asked.frequency:g} Hz"
    return f"Values are {words}; the first and the last instant are as computed."


def output_words(settings: Settings) -> str:
    """How often a run stores its values, in words."""
    if settings.output_spacing:
        return f"every {settings.output_spacing:g} m"
    return f"{settings.output_rate:g} per s"
