"""What the channels of a run say of each other: which one is wrong, and how large all errors are.

**Channels.** What the others say of channel c is y_c - (G^-1 y)_c/(G^-1)_cc, with the covariance G
of the data.  A channel that has another sign, unit or place than this is left out.

**Sizes of errors.** G = H P H* + sum_j t_j V_j has powers V_j of errors whose sizes t_j are not
known before: what each channel has beyond the response of the model, and what the contact has
beyond its linear law.  The most likely sizes are found by

    t_j <- t_j sqrt(sum_k y* G^-1 V_j G^-1 y / sum_k tr(G^-1 V_j)),

of which each step makes the data more likely (Zhou, Hu, Qiao and Lange 2019).
"""

from dataclasses import dataclass

import numpy as np

from railsim.arrays import Complexes, Flags, Floats, Integers
from railsim.linear.track_response import QUANTITIES
from railsim.observation.pieces import STEP, Piece
from railsim.observation.smoother import Fields

TAPER = 60.0  # at both ends of a piece [m]
ALIKE, UNLIKE = 0.3, 3.0  # correlation, ratio of rms values: read, and said by other channels
BEYOND = 30.0  # power of what does not agree, over that which noise and model explain
RESTS = 1e-9  # size over that of the channel that moves most
FEWEST = 3  # channels of which one can be wrong
CLEAR = 1.1  # wave numbers over the largest that is assumed, from which on waves count as shorter
SHORT, SHARE = 10.0, 0.0025  # power in them, over that of the noise; over that of the channel
MODEL = 0.03  # error of the response over its rms, before the data are asked
KINDS = ((0, 3), (1, 2))  # components of a wheelset whose unknown accelerations have one size
STEPS = 30
ALL = slice(None)
FINEST, MOST_BINS = 1e-6, 1500  # least size; number of wave numbers that are looked at


@dataclass(frozen=True)
class Sizes:
    """Sizes of errors.

    `contact` (float64[2]): Power of the unknown accelerations of wheelsets over that of
    `railsim.observation.contact`: in y and yaw, in z and roll.
    """

    contact: Floats
    model: Floats  # error of the response of a channel over its rms, float64[channel]

    @classmethod
    def assumed(cls, channels: int) -> "Sizes":
        """Return what is assumed before the data are asked."""
        return cls(np.ones(len(KINDS)), np.full(channels, MODEL))

    def contact_powers(self, unknown: Floats) -> Floats:
        """Powers float64[k, component of all wheelsets] of these sizes."""
        factors = np.empty(sum(map(len, KINDS)))
        for kind, size in zip(KINDS, self.contact, strict=True):
            factors[list(kind)] = size
        return unknown * np.tile(factors, unknown.shape[1] // len(factors))


@dataclass(frozen=True)
class Powers:
    """What the covariance of the data of a piece is made of.

    `unknown` (float64[k, component of all wheelsets]): Of the accelerations that the linear
    contact leaves out.
    """

    points: int
    track: Floats  # of the irregularities, float64[k, quantity]
    unknown: Floats
    response: Complexes  # complex128[k, channel, quantity and component]
    white: Floats  # noise and bias, float64[k, channel]

    @property
    def signal(self) -> Floats:
        """Power of what channels read of the irregularities, float64[k, channel]."""
        H = self.response[:, :, : len(QUANTITIES)]
        return np.asarray(np.einsum("kcq,kq,kcq->kc", H, self.track, H.conj(), optimize=True).real)

    def part(self, bins: slice | Integers, channels: slice | list[int] = ALL) -> "Powers":
        """Return the powers of some wave numbers and channels."""
        return Powers(self.points, self.track[bins], self.unknown[bins],
                      self.response[bins][:, channels], self.white[bins][:, channels])  # fmt: skip

    def fields(self, sizes: Sizes) -> Fields:
        """Fields of the smoother."""
        power = np.hstack([self.track, sizes.contact_powers(self.unknown)])
        return Fields(self.points, power, self.response, self.white + sizes.model**2 * self.signal)


def spectra_of(signals: Floats, valid: Flags, points: int) -> Complexes:
    """Spectra of signals with cosines at both ends, complex128[channel, k], as powers are."""
    n = signals.shape[1]
    ramp = np.minimum(1.0, np.minimum(np.arange(n), np.arange(n)[::-1]) * STEP / TAPER)
    window = np.sin(0.5 * np.pi * ramp) ** 2 * valid
    count = np.maximum(valid.sum(axis=1, keepdims=True), 1)
    means = np.where(valid, signals, 0.0).sum(axis=1, keepdims=True) / count
    size = np.sqrt(np.sum(window**2, axis=1, keepdims=True) / points)
    spectra = np.fft.rfft((signals - means) * window, points, axis=1)
    return np.asarray(spectra / np.where(size > 0.0, size, 1.0))


def shorter_waves(
    powers: Powers, piece: Piece, signals: Floats, names: list[str], chosen: Flags
) -> list[str]:
    """Remark where chosen channels without gaps read waves shorter than those that are assumed.

    What they read there is held against their noise, and against all that they read.
    """
    power = np.abs(spectra_of(signals, piece.valid, powers.points)) ** 2 / powers.points
    last = np.flatnonzero(powers.track.any(axis=1))[-1]
    short = slice(int(CLEAR * last), int(2 / 3 * len(powers.track)))
    read, noise = power[:, short].sum(axis=1), powers.white[short].sum(axis=0)
    far = piece.valid.all(axis=1) & chosen & (read > SHORT * noise)
    far &= read > SHARE * power.sum(axis=1)
    if not far.any():
        return []
    c = int(np.argmax(np.where(far, read / noise, 0.0)))
    shortest = 2.0 * STEP * (len(powers.track) - 1) / last
    return [
        f"Channels read waves shorter than the {shortest:.3g} m that are assumed: {names[c]} "
        f"{np.sqrt(read[c] / noise[c]):.2g} times its noise. They are in no interval, and no force "
        "has them; 'wavelengths' takes those down to 1 m."
    ]


def level_of(powers: Powers, spectra: Complexes) -> float:
    """Median over the channels of the rms that they read over the one that is expected."""
    bins = powers.track.any(axis=1)
    read = np.sum(np.abs(spectra[:, bins]) ** 2, axis=1) / powers.points
    expected = np.sum(powers.signal[bins] + powers.white[bins], axis=0)
    return float(np.median(np.sqrt(read / expected)))


def likely_sizes(powers: Powers, spectra: Complexes) -> Sizes:
    """Return the most likely sizes of errors; channels that read nothing keep those assumed."""
    used = np.flatnonzero(spectra.any(axis=1)).tolist()
    bins = np.flatnonzero(powers.track.any(axis=1))
    bins = bins[:: -(-len(bins) // MOST_BINS)]
    part = powers.part(bins, used)
    y, signal = spectra[used][:, bins].T / np.sqrt(powers.points), part.signal
    d = part.response[:, :, len(QUANTITIES) :]
    sizes = Sizes.assumed(len(used))
    for _ in range(STEPS):
        inverse = np.linalg.inv(part.fields(sizes).data_covariance())
        z = np.einsum("kcd,kd->kc", inverse, y)
        observed = np.sum(signal * np.abs(z) ** 2, axis=0)
        expected = np.sum(signal * np.einsum("kcc->kc", inverse).real, axis=0)
        model = sizes.model * (observed / expected) ** 0.25
        seen = np.sum(part.unknown * np.abs(np.einsum("kcj,kc->kj", d.conj(), z)) ** 2, axis=0)
        likely = np.einsum("kj,kcj,kcd,kdj->j", part.unknown, d.conj(), inverse, d, optimize=True)
        contact = sizes.contact.copy()
        for j, kind in enumerate(KINDS):
            rows = np.isin(np.arange(len(seen)) % sum(map(len, KINDS)), kind)
            contact[j] *= np.sqrt(seen[rows].sum() / likely.real[rows].sum())
        sizes = Sizes(np.maximum(contact, FINEST), np.maximum(model, FINEST))
    model_sizes = np.full(len(spectra), MODEL)
    model_sizes[used] = sizes.model
    return Sizes(sizes.contact, model_sizes)


def disagreeing_channels(
    powers: Powers, piece: Piece, signals: Floats, names: list[str]
) -> tuple[set[int], list[str]]:
    """Channels that read another thing than the others say, and a remark on each.

    The worst one is left out before the others are looked at again, a third of those that move at
    most.
    """
    points = powers.points
    spectra = spectra_of(signals, piece.valid, points)
    read = np.fft.irfft(spectra, points, axis=1)
    size = np.linalg.norm(read, axis=1)
    wrong = set(np.flatnonzero(piece.valid.any(axis=1) & (size < RESTS * size.max())).tolist())
    remaining = [c for c in range(len(read)) if piece.valid[c].any() and c not in wrong]
    remarks = [f"{names[c]} rests: a dead sensor? It is left out." for c in sorted(wrong)]
    most = len(wrong) + len(remaining) // 3
    G = powers.fields(Sizes.assumed(len(names))).data_covariance()
    while len(remaining) > FEWEST and len(wrong) < most:
        inverse = np.linalg.inv(G[:, remaining][:, :, remaining])
        precision = np.einsum("kcc->ck", inverse).real
        residual = np.einsum("kcd,dk->ck", inverse, spectra[remaining], optimize=True) / precision
        others = np.fft.irfft(spectra[remaining] - residual, points, axis=1)
        beyond = np.mean(np.abs(residual) ** 2 * precision, axis=1) / points
        product = np.sum(read[remaining] * others, axis=1)
        sizes = np.linalg.norm(read[remaining], axis=1), np.linalg.norm(others, axis=1)
        worst = int(np.argmax(beyond))
        name, c = names[remaining[worst]], product[worst] / (sizes[0] * sizes[1])[worst]
        reason = _disagreement(float(c), float((sizes[0] / sizes[1])[worst]), float(beyond[worst]))
        if not reason:
            break
        remarks.append(f"{name} {reason} It is left out.")
        wrong.add(remaining.pop(worst))
    return wrong, remarks


def _disagreement(c: float, ratio: float, beyond: float) -> str:
    """What is wrong with a channel, by its correlation with the others and its size over theirs."""
    if c < -ALIKE:
        return f"has the opposite sign of what the other channels say ({c:.2f}): 'reverse'?"
    if c > ALIKE and not 1.0 / UNLIKE < ratio < UNLIKE:
        return f"is {ratio:.2g} times what the other channels say: another 'unit'?"
    if c < ALIKE and beyond > BEYOND:
        return (
            f"does not agree with what the other channels say (correlation {c:.2f}): another "
            "point or axis, or a drifting clock?"
        )
    return ""
