"""What is known of a track after a measured run: `Irregularity`, its table, files and recording."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from railsim.arrays import Complexes, Floats, stretches
from railsim.definitions.excitations.recording import band_gain
from railsim.definitions.track.definition import Track
from railsim.definitions.track.layout import even_line, is_uniform
from railsim.files.access import make_folder, whole_file, write_text
from railsim.linear.track_response import QUANTITIES
from railsim.observation.pieces import STEP, Piece
from railsim.table import Column, Table

BANDS = {"D1": (3.0, 25.0), "D2": (25.0, 70.0)}  # wavelengths of EN 13848-1 [m]
LETTERS = ("y", "z", "cross_level", "gauge")  # columns of a recording
MILLI, KILO = 1e3, 1e-3
LISTED, NEAR = 8, 10.0  # ranges in a sentence; flanges touch no farther apart at one place [m]
SEEN = 0.5  # share of the variance that the channels explain, below which nothing is filled in
ENDS = 60.0  # of a record, where deviations are larger than those of all of it [m]
FILES = ("recording.csv", "track.toml", "estimates.csv", "forces.csv")


@dataclass(frozen=True, eq=False)
class Estimated:
    """Irregularities of a track and wheel forces over the arc length.

    `values`, `deviations` (float64[quantity, n]): Alignment, level, cross level and gauge under the
    reference body, without what is not seen, and the standard deviations of their errors [m].
    `bands`, `band_deviations` (float64[quantity, n]): The same in D1 and D2. `outputs`: Names of
    the forces: ``Q.1.left``, ``Y.1.left``, ``sum_Y.1``, ``lateral.1``. `forces`,
    `force_deviations` (float64[output, n]): [N], lateral displacements [m].
    """

    s: Floats  # arc length of the reference body, equal steps [m], float64[n]
    values: Floats
    deviations: Floats
    bands: Mapping[str, Floats]
    band_deviations: Mapping[str, Floats]
    outputs: tuple[str, ...]
    forces: Floats
    force_deviations: Floats


@dataclass(frozen=True, eq=False)
class Estimate(Estimated):
    """What is known of one piece of a run, whose deviations are the same all along it.

    `wave_numbers`, `seen`, `power` (float64[quantity, k]): Share of the variance that the channels
    explain; power assumed before.
    """

    speed: float  # [m/s]
    wave_numbers: Floats
    seen: Floats
    power: Floats


@dataclass(frozen=True, eq=False)
class Irregularity(Estimated):
    """Irregularities of a track and wheel forces from a measured run.

    `name`, `vehicle`: Of the run; of the vehicle. `flanges`: Wheelset, begin and end of the places
    where its flange touches [m].
    """

    name: str
    vehicle: str
    pieces: tuple[Estimate, ...]  # what was put together
    flanges: tuple[tuple[int, float, float], ...]
    remarks: tuple[str, ...]
    track: Track  # that was run over, without irregularities

    def force(self, name: str) -> Floats:
        """Return a force over the arc length, such as ``Q.1.left`` or ``sum_Y.2`` [N]."""
        return np.asarray(self.forces[self.outputs.index(name)])

    def unseen(self) -> dict[str, list[tuple[float, float]]]:
        """Return wavelengths that are not filled in, by quantity: shortest and longest [m].

        Those of the piece that explains least.
        """
        unseen: dict[str, list[tuple[float, float]]] = {}
        for number, name in enumerate(QUANTITIES):
            ranges: set[tuple[float, float]] = set()
            for piece in self.pieces:
                k = piece.wave_numbers[1:]
                assumed = piece.power[number, 1:] > 0.0
                dark = assumed & (piece.seen[number, 1:] < SEEN)
                for first, last in stretches(dark):
                    waves = 2.0 * np.pi / k[last - 1], 2.0 * np.pi / k[first]
                    ranges.add((round(waves[0], 1), round(waves[1], 1)))
            unseen[name] = _merge_ranges(sorted(ranges))
        return unseen

    def _forces(self) -> Iterator[tuple[str, Floats, Floats]]:
        return zip(self.outputs, self.forces, self.force_deviations, strict=True)

    def table(self) -> Table:
        """Return rms values and the standard deviations of their errors by band."""
        columns = [Column("quantity"), Column("band"), Column("rms", "rms", "mm", ".3f"),
                   Column("deviation", "standard deviation of the error", "mm", ".3f"),
                   Column("seen", "share of the variance explained", "", ".3f")]  # fmt: skip
        rows = []
        for number, name in enumerate(QUANTITIES):
            for band, values in self.bands.items():
                seen = [_share(piece, number, BANDS[band]) for piece in self.pieces]
                if np.isfinite(seen).any():
                    rows.append([name.replace("_", " "), band, float(values[number].std()),
                                 float(np.sqrt(np.mean(self.band_deviations[band][number] ** 2))),
                                 float(np.nanmin(seen))])  # fmt: skip
        return Table(columns, rows)

    def forces_table(self) -> Table:
        """Return largest wheel forces away from the ends, and the deviations of their errors."""
        columns = [Column("force"), Column("largest", "largest magnitude", "kN", ".2f"),
                   Column("place", "at s", "m", ".0f"),
                   Column("rms", "rms about the mean", "kN", ".2f"),
                   Column("deviation", "standard deviation of the error", "kN", ".2f")]  # fmt: skip
        rows = []
        inside = np.flatnonzero((self.s >= self.s[0] + ENDS) & (self.s <= self.s[-1] - ENDS))
        for name, values, rest in self._forces():
            if not name.startswith("lateral"):
                k = inside[int(np.argmax(np.abs(values[inside])))]
                rows.append([name, abs(float(values[k])), float(self.s[k]),
                             float(values[inside].std()),
                             float(rest.mean())])  # fmt: skip
        return Table(columns, rows)

    @property
    def notes(self) -> tuple[str, ...]:
        """What is not seen and where flanges touch, in sentences."""
        sentences = []
        for name, ranges in self.unseen().items():
            label = name.replace("_", " ")
            if ranges:
                spans = _list_text([f"{a:g} to {b:g}" for a, b in ranges], "ranges")
                sentences.append(f"Wavelengths not seen and not filled in, {label}: {spans}.")
        for wheelset in dict.fromkeys(w for w, _, _ in self.flanges):
            ends = [(f"{a:.0f}", f"{b:.0f}") for w, a, b in self.flanges if w == wheelset]
            places = [a if a == b else f"{a} to {b}" for a, b in ends]
            sentences.append(f"A flange of wheelset {wheelset} touches at s = "
                        f"{_list_text(places, 'places')}: the alignment there is less certain than "
                        "its interval says.")  # fmt: skip
        return tuple(sentences)

    def record(self) -> dict[str, Any]:
        """Return the summary as plain data, SI."""
        return {
            "name": self.name, "vehicle": self.vehicle, "begin": float(self.s[0]),
            "end": float(self.s[-1]), "bands": self.table().records(),
            "forces": self.forces_table().records(),
            "not_seen": {name: [list(a) for a in pairs] for name, pairs in self.unseen().items()},
            "flanges": [list(place) for place in self.flanges], "remarks": list(self.remarks),
        }  # fmt: skip

    def recording(self) -> dict[str, Floats]:
        """Return the columns of a recording that a track of railsim reads [m]."""
        rows = [q for q in range(len(LETTERS)) if np.any(self.values[q])]
        return {"s": self.s, **{LETTERS[q]: self.values[q] for q in rows}}

    def write(self, folder: str | Path) -> list[Path]:
        """Write the recording, a track with it, estimates and forces; return their paths."""
        path = Path(folder)
        make_folder(path)
        recording = self.recording()
        _csv(path / FILES[0], {"s_m": recording.pop("s"),
                               **{f"{n}_mm": MILLI * v for n, v in recording.items()}})  # fmt: skip
        changes: dict[str, Any] = {"name": f"Track under {self.vehicle}", "irregularities": []}
        if is_uniform(self.track):
            changes |= even_line(float(np.ceil(self.s[-1])))
        text, none = self.track.replace(**changes).to_toml(), "irregularities = []\n"
        measured = f'irregularities = [{{ type = "measured", file = "{FILES[0]}" }}]\n'
        write_text(path / FILES[1], text.replace(none, measured))
        columns: dict[str, Floats] = {"s_m": self.s}
        for q, name in enumerate(QUANTITIES):
            columns[f"{name}_mm"] = MILLI * self.values[q]
            columns[f"{name}_deviation_mm"] = MILLI * self.deviations[q]
            for band in BANDS:
                columns[f"{name}_{band}_mm"] = MILLI * self.bands[band][q]
                columns[f"{name}_{band}_deviation_mm"] = MILLI * self.band_deviations[band][q]
        _csv(path / FILES[2], columns)
        columns = {"s_m": self.s}
        for name, values, rest in self._forces():
            unit, factor = ("mm", MILLI) if name.startswith("lateral") else ("kN", KILO)
            columns[f"{name}_{unit}"] = factor * values
            columns[f"{name}_deviation_{unit}"] = factor * rest
        _csv(path / FILES[3], columns)
        return [path / name for name in FILES]


Forces = tuple[tuple[str, ...], Complexes, Floats]


def estimate_of(
    piece: Piece, spectra: Complexes, covariance: Complexes, power: Floats, forces: Forces
) -> Estimate:
    """Return the estimate of a piece from spectra of fields and their covariance.

    `spectra`, `covariance` (complex128[field, k]): Irregularities, then accelerations. `power`
    (float64[k, quantity]): Assumed before. `forces` ([output]): Names, response, and what they
    have beyond it [N, m].
    """
    number, points = power.shape[1], 2 * (len(covariance) - 1)
    k: Floats = 2.0 * np.pi * np.fft.rfftfreq(points, STEP).astype(float)
    names, response, base = forces
    outputs = np.einsum("kcq,qk->ck", response, spectra, optimize=True)
    rest = np.einsum("kcp,kpq,kcq->ck", response, covariance, response.conj(), optimize=True).real
    variance = covariance[:, range(number), range(number)].real.T
    power = power.T
    with np.errstate(invalid="ignore"):
        seen = np.where(power > 0.0, 1.0 - variance / np.where(power > 0.0, power, 1.0), 0.0)
    visible = seen >= SEEN
    error = np.where(visible, variance, power)
    found = np.where(visible, spectra[:number], 0.0)

    def irfft(spectra: Complexes | Floats) -> Floats:
        return np.fft.irfft(spectra, points, axis=1)[:, : len(piece.grid)]

    gains = {name: band_gain(band)(k / (2.0 * np.pi)) for name, band in BANDS.items()}
    bands = {name: irfft(gain * found) for name, gain in gains.items()}
    deviations = {name: rms(gain**2 * error, points) for name, gain in gains.items()}
    return Estimate(
        s=piece.grid, speed=piece.speed,
        values=irfft(found), deviations=rms(error, points), bands=bands, band_deviations=deviations,
        wave_numbers=k, seen=seen, power=power,
        outputs=names, forces=irfft(outputs) + base, force_deviations=rms(rest, points),
    )  # fmt: skip


def rms(power: Floats, points: int) -> Floats:
    """Root of the variance of two-sided powers of the bins of `rfft`."""
    return np.asarray(np.sqrt((2.0 * power.sum(axis=1) - power[:, 0] - power[:, -1]) / points))


def join_pieces(
    name: str, vehicle: str, pieces: Sequence[Estimate], clearances: Floats, remarks: Sequence[str],
    track: Track,
) -> Irregularity:  # fmt: skip
    """Return pieces put together, from one to the next over the length on which both exist."""
    step = pieces[0].s[1] - pieces[0].s[0]
    begin, end = pieces[0].s[0], pieces[-1].s[-1]
    s = begin + step * np.arange(round((end - begin) / step) + 1)

    def blend(values: Sequence[Floats]) -> Floats:
        """Join float64[rows, n] of each piece, or float64[rows]."""
        total = np.zeros((len(values[0]), len(s)))
        for number, (piece, rows) in enumerate(zip(pieces, values, strict=True)):
            inside = (s >= piece.s[0] - 1e-6) & (s <= piece.s[-1] + 1e-6)
            s_inside = s[inside]
            whole = np.repeat(rows[:, None], len(s_inside), axis=1) if rows.ndim == 1 else np.array(
                [np.interp(s_inside, piece.s, row) for row in rows]
            )  # fmt: skip
            share = np.ones(len(s_inside))
            if number:
                before = pieces[number - 1].s[-1]
                share = np.clip((s_inside - piece.s[0]) / (before - piece.s[0]), 0.0, 1.0)
            total[:, inside] = (1.0 - share) * total[:, inside] + share * whole
        return total

    whole = Estimated(
        s,
        blend([p.values for p in pieces]), blend([p.deviations for p in pieces]),
        {band: blend([p.bands[band] for p in pieces]) for band in BANDS},
        {band: blend([p.band_deviations[band] for p in pieces]) for band in BANDS},
        pieces[0].outputs,
        blend([p.forces for p in pieces]), blend([p.force_deviations for p in pieces]),
    )  # fmt: skip
    touching = []
    for w, clearance in enumerate(clearances):
        lateral = whole.forces[whole.outputs.index(f"lateral.{w + 1}")]
        places = [(s[a], s[b - 1]) for a, b in stretches(np.abs(lateral) > clearance)]
        touching += [(w + 1, float(a), float(b)) for a, b in _merge_ranges(places, 1.0, NEAR)]
    ends = (
        f"Within {ENDS:g} m of the ends, before s = {begin + ENDS:.0f} m and beyond "
        f"{end - ENDS:.0f} m, errors are larger than their standard deviations say; the table of "
        "forces leaves these lengths out."
    )
    return Irregularity(
        **vars(whole), name=name, vehicle=vehicle, pieces=tuple(pieces), flanges=tuple(touching),
        remarks=tuple(dict.fromkeys([*remarks, ends])), track=track,
    )  # fmt: skip


def lengths_without_values(pieces: Sequence[Piece]) -> Iterator[str]:
    """Remark on lengths of which no channel says anything."""
    ends = [
        (float(piece.grid[a]), float(piece.grid[b - 1]))
        for piece in pieces
        for a, b in stretches(np.asarray(~piece.valid.any(axis=0)))
    ]
    if ends:
        places = [f"{a:.0f} to {b:.0f}" for a, b in _merge_ranges(sorted(ends), 1.0)]
        yield (
            f"No channel has values at s = {_list_text(places, 'places')}: errors there, and of "
            "wheelsets that run there, are larger than their standard deviations say."
        )


def _share(piece: Estimate, number: int, band: tuple[float, float]) -> float:
    """Share of the assumed variance in a band that the channels explain; nan without any."""
    k = piece.wave_numbers
    inside = (k >= 2.0 * np.pi / band[1]) & (k <= 2.0 * np.pi / band[0])
    power = piece.power[number, inside]
    total = float(power.sum())
    return float(np.sum(power * piece.seen[number, inside]) / total) if total else float("nan")


def _merge_ranges(
    ranges: Sequence[tuple[float, float]], factor: float = 1.05, gap: float = 0.0
) -> list[tuple[float, float]]:
    """Return ranges that overlap or nearly touch as one: by a factor, or so far apart."""
    merged: list[tuple[float, float]] = []
    for low, high in ranges:
        if merged and low <= factor * merged[-1][1] + gap:
            merged[-1] = (merged[-1][0], max(merged[-1][1], high))
        else:
            merged.append((low, high))
    return merged


def _list_text(places: Sequence[str], kind: str) -> str:
    """Return the first places or ranges [m] in words, and how many more there are."""
    more = f" ({len(places)} {kind} in all)" if len(places) > LISTED else ""
    return f"{', '.join(places[:LISTED])} m{more}"


def _csv(path: Path, columns: Mapping[str, Floats]) -> None:
    with whole_file(path) as partial, partial.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(columns) + "\n")
        # the arc length to 0.1 mm at 100 km, where six digits are a metre
        formats = ["%.9g", *["%.6g"] * (len(columns) - 1)]
        np.savetxt(file, np.transpose(list(columns.values())), formats, delimiter=",")
