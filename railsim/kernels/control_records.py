"""Records of actuators, signals, controllers and laws of one's own: parts of a `System`."""

from typing import NamedTuple

import numpy as np

from railsim.kernels.record import record


@record
class Actuators(NamedTuple):
    """Forces that follow a command or a law of one's own, see `actuators`.

    Attributes
    ----------
    body : int64[a, 2]
    codes : int64[a, CODES_SIZE];  row : float64[a, ROW_SIZE]
    """

    body: np.ndarray
    codes: np.ndarray
    row: np.ndarray


@record
class Signals(NamedTuple):
    """What is measured in a run, see `controllers`.

    Attributes
    ----------
    codes : int64[s, SIGNAL_CODES];  row : float64[s, SIGNAL_ROW]
    """

    codes: np.ndarray
    row: np.ndarray


@record
class Controllers(NamedTuple):
    """What follows from signals, see `controllers`.

    Attributes
    ----------
    codes : int64[c, CONTROLLER_CODES];  period : float64[c] [s]
    ports : int64[...]      of each controller actuators that it commands, signals that it reads
    """

    codes: np.ndarray
    period: np.ndarray
    ports: np.ndarray


@record
class UserLaws(NamedTuple):
    """Laws of one's own.

    Attributes
    ----------
    addresses : int64[l]    address of each
    memory : float64[...]   `Work.memory` at the begin of a run: time of the begin, commands,
                            samples, blocks of the laws with their parameters
    """

    addresses: np.ndarray
    memory: np.ndarray
