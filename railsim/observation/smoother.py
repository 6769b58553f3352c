"""Smoother of stationary Gaussian fields seen through filters: gaps, noise, bias, ends.

Fields r_q (here a track's irregularities) are observed by channels y_c = sum_q h_cq * r_q + e_c,
both fields and errors e stationary and Gaussian.  On a grid of M points with period M the discrete
Fourier transform makes all covariances block-diagonal: per wave number, with P = diag of the
fields' power, N = diag of the errors' and H the frequency responses,

    E[r | y] = P H* G^-1 y,   G = H P H* + N,   Cov[r | y] = (1 + P H* N^-1 H)^-1 P        (1)

(Wiener 1949).  Both are the mean and covariance that the smoother of Rauch, Tung and Striebel
(1965) has in the inside of a long record, whose gains do not change there: both condition one
Gaussian model on all data.  A record has ends, and it may have gaps.  With E that takes the samples
that exist, the mean is still exact,

    E[r | y] = P H* E' w,   (E G E') w = y,                                                 (2)

and (2) is solved by conjugate gradients (Hestenes and Stiefel 1952) with E G^-1 E' before it.  The
period is longer than the record by samples that do not exist.
"""

from dataclasses import dataclass

import numpy as np

from railsim.arrays import Complexes, Flags, Floats
from railsim.errors import ModelError

RESIDUAL = 1e-2  # of the linear equations, over the rms of the errors
MOST_ITERATIONS = 2000


def filtered(matrix: Complexes, values: Floats) -> Floats:
    """Apply complex128[bin, row, column] to float64[column, points]."""
    spectra = np.einsum("kcd,dk->ck", matrix, np.fft.rfft(values, axis=1), optimize=True)
    return np.asarray(np.fft.irfft(spectra, values.shape[1], axis=1))


@dataclass(frozen=True)
class Fields:
    """Gaussian fields on a periodic grid, and how channels see them."""

    points: int  # M, points of the grid
    # two-sided: M times the share of each of the bins of `numpy.fft.rfft` in the variance of a
    # field, float64[bin, field]
    power: Floats
    response: Complexes  # H, complex128[bin, channel, field]
    errors: Floats  # their power, float64[bin, channel]; of white noise its variance in every bin

    def covariance(self) -> Complexes:
        """Cov[r | y] of (1) per bin, complex128[bin, field, field]."""
        N = 1.0 / self.errors
        seen = np.einsum("kcp,kc,kcq->kpq", self.response.conj(), N, self.response, optimize=True)
        eye, P = np.eye(self.power.shape[1]), self.power[:, :, None]
        return np.asarray(np.linalg.solve(eye + P * seen, P * eye))

    def gain(self, fields: int) -> Complexes:
        """P H* G^-1 of (1) for the first fields, complex128[bin, field, channel]."""
        P, H = self.power[:, :fields], self.response[:, :, :fields]
        return np.asarray(np.einsum("kp,kcp,kcd->kpd", P, H.conj(), self._inverse(), optimize=True))

    def mean(self, data: Floats, valid: Flags | None = None, residual: float = RESIDUAL) -> Floats:
        """E[r | y] of (2), float64[field, points].

        `data` (float64[channel, points]): Samples; those that do not exist do not count. `valid`
        (bool[channel, points]): Which samples exist; all by default. `residual`: Of the equations,
        over the rms of the errors. Raises ModelError: The equations are not solved after
        `MOST_ITERATIONS`.
        """
        valid = np.ones_like(data, dtype=bool) if valid is None else valid
        weights = np.fft.rfft(self._weights(data, valid, residual), axis=1)
        back = np.einsum("kcq,ck->qk", self.response.conj(), weights, optimize=True)
        return np.asarray(np.fft.irfft(self.power.T * back, self.points, axis=1))

    def _weights(self, data: Floats, valid: Flags, residual: float) -> Floats:
        """Weights of the samples, w of (2), zero where no sample exists."""
        forth, back = self.data_covariance(), self._inverse()

        def apply(matrix: Complexes, values: Floats) -> Floats:
            return np.where(valid, filtered(matrix, values), 0.0)

        data = np.where(valid, data, 0.0)
        if valid.all():
            return apply(back, data)
        scale = 1.0 / np.sqrt(np.median(self.errors, axis=0))[:, None]
        w = apply(back, data)
        rest = data - apply(forth, w)
        goal = residual * np.sqrt(np.count_nonzero(valid))
        z = apply(back, rest)
        along, size = z, np.vdot(rest, z)
        for _ in range(MOST_ITERATIONS):
            if np.linalg.norm(scale * rest) <= goal:
                return w
            image = apply(forth, along)
            step = size / np.vdot(along, image)
            w, rest = w + step * along, rest - step * image
            z = apply(back, rest)
            before, size = size, np.vdot(rest, z)
            along = z + (size / before) * along
        raise ModelError(
            f"the smoother's equations are not solved after {MOST_ITERATIONS} iterations"
        )

    def data_covariance(self) -> Complexes:
        """G of (1), complex128[bin, channel, channel]."""
        H, channels = self.response, np.arange(self.errors.shape[1])
        covariance = np.einsum("kcq,kq,kdq->kcd", H, self.power, H.conj(), optimize=True)
        covariance[:, channels, channels] += self.errors
        return np.asarray(covariance)

    def _inverse(self) -> Complexes:
        """G^-1, complex128[bin, channel, channel]."""
        H, N = self.response, self.errors
        channels = np.arange(N.shape[1])
        # Woodbury: G^-1 = N^-1 - N^-1 H Cov H* N^-1
        gain = H / N[:, :, None]
        back = -np.einsum("kcp,kpq,kdq->kcd", gain, self.covariance(), gain.conj(), optimize=True)
        back[:, channels, channels] += 1.0 / N
        return np.asarray(back)
