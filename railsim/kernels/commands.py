"""What commands, signals, controllers and laws of one's own are made of; parts of a `System`."""

from typing import NamedTuple

import numpy as np

from railsim.kernels.record import record


@record
class Actuators(NamedTuple):
    """Forces that follow a command or a law of one's own, see `actuators`.

    Attributes
    ----------
    body : int64[a, 2]
    which : int64[a, WHICH_SIZE];  row : float64[a, ROW_SIZE]
    """

    body: np.ndarray
    which: np.ndarray
    row: np.ndarray


@record
class Signals(NamedTuple):
    """What is measured in a run, see `controllers`.

    Attributes
    ----------
    which : int64[s, SIGNAL_WHICH];  row : float64[s, SIGNAL_ROW]
    """

    which: np.ndarray
    row: np.ndarray


@record
class Controllers(NamedTuple):
    """What follows from signals, see `controllers`.

    Attributes
    ----------
    which : int64[c, CONTROLLER_WHICH];  period : float64[c] [s]
    wires : int64[...]      of each controller actuators that it commands, signals that it reads
    """

    which: np.ndarray
    period: np.ndarray
    wires: np.ndarray


@record
class Own(NamedTuple):
    """Laws of one's own.

    Attributes
    ----------
    places : int64[l]       address of each
    memory : float64[...]   `Work.memory` at the begin of a run: time of the begin, commands,
                            samples, blocks of the laws with their parameters
    """

    places: np.ndarray
    memory: np.ndarray
