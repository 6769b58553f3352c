"""Irregularities of a track file: measured, single and random displacements of the rails.

Each rail is displaced laterally (y, positive to the right) and vertically (z, positive downwards)
from the position that plan, cant and vertical profile give it; several irregularities add up.  A
disturbance that does not end at zero by itself is faded in and out over `fade`.
"""

from abc import abstractmethod
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from railsim.definitions.base import Definition, Finite, Flag, NonNegative, Positive, Text, rising

# Names of the columns of a measured irregularity, beside the arc length.
COLUMNS = ("y_left", "z_left", "y_right", "z_right")
# The four irregularities of a track.
CHANNELS = ("lateral", "vertical", "cross_level", "gauge")
# Keys that say how the file of a measured irregularity is read; its rows are what came of it.
READING = ("columns", "units", "reverse", "falling_mileage", "chord", "band")
# Sign of each in the mirror image of the track.
MIRROR = {"lateral": -1.0, "vertical": 1.0, "cross_level": -1.0, "gauge": 1.0}
Amplitude = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-0.5, le=0.5)]
Rails = Literal["left", "right", "both"]
Row = tuple[Finite, Amplitude, Amplitude, Amplitude, Amplitude]


def _measured_rows(rows: tuple[Row, ...]) -> tuple[Row, ...]:
    if not rising(rows):
        raise ValueError("the arc length must increase from row to row")
    return rows


def _band(wavelengths: tuple[float, float]) -> tuple[float, float]:
    if wavelengths[1] <= wavelengths[0]:
        raise ValueError("[shortest, longest]: the second must be larger than the first")
    return wavelengths


Wavelengths = Annotated[
    tuple[
        Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0.2)],
        Annotated[float, Field(strict=True, allow_inf_nan=False, le=1000.0)],
    ],
    AfterValidator(_band),
]


Channel = Literal["lateral", "vertical", "cross_level", "gauge"]
Channels = Annotated[tuple[Channel, ...], Field(min_length=1)]
OTHER_RAIL: dict[str, Rails] = {"left": "right", "right": "left", "both": "both"}


Wavelength = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0.2, le=1000.0)]


class Irregular(Definition):
    """What every irregularity answers; none can be defined without."""

    if TYPE_CHECKING:
        type: str

    @abstractmethod
    def mirrored(self) -> Self:
        """Return the mirror image: left and right exchanged."""

    @abstractmethod
    def extent(self, length: float) -> tuple[float, float]:
        """Return where it begins and ends on a track whose plan has some length [m]."""

    @abstractmethod
    def resolution(self) -> float:
        """Return the length that tables must resolve, a sixteenth of its shortest wave [m]."""

    @abstractmethod
    def summary(self) -> str:
        """Return what it is in a few words."""


class Single(Irregular):
    """A single disturbance, `length` long about `s`."""

    if TYPE_CHECKING:
        s: float
        length: float
        shape: str

    def extent(self, length: float) -> tuple[float, float]:
        """Return where it begins and ends [m]."""
        return self.s - 0.5 * self.length, self.s + 0.5 * self.length

    def resolution(self) -> float:
        """Return a part of its length; a triangle has rounded kinks [m]."""
        return self.length / (40.0 if self.shape == "triangle" else 16.0)

    def summary(self) -> str:
        """Return its kind and arc length."""
        return f"{self.type} at {self.s:g} m"


class Measured(Irregular):
    """Displacements measured or computed elsewhere.

    Between the rows a cubic spline where they resolve the waves, shape-preserving elsewhere.
    """

    type: Literal["measured"]
    file: Text | None = None
    """CSV with a header: `s` and any of `y_left`, `z_left`, `y_right`, `z_right` in m (`s_m`) or
    mm (`y_left_mm`), or `y`, `z`, `cross_level`, `gauge`; read when the track is loaded"""
    columns: dict[Text, Text] | None = None
    """Names of the file's columns by ours, where they differ: `{ s = "Mileage", z_left = "LL" }`;
    columns that are not named are not read"""
    units: dict[Text, Literal["m", "mm", "km"]] | None = None
    """Units by our names of the columns, `{ s = "km", z_left = "mm" }`; by default as the names
    say"""
    reverse: tuple[Text, ...] = ()
    """Our names of the columns whose sign is the opposite of ours"""
    falling_mileage: Flag = False
    """The file's mileage falls in the direction of travel; s then counts from its first row"""
    chord: tuple[Positive, Positive] | None = None
    """Displacements are offsets at a chord of these parts behind and ahead [m]: the space curve is
    recovered from them"""
    band: Literal["D1", "D2", "D3"] | Wavelengths | None = None
    """Band of wavelengths that is kept: D1 (3 to 25 m), D2 (25 to 70 m), D3 (70 to 150 m), or
    shortest and longest [m]"""
    rows: Annotated[tuple[Row, ...], AfterValidator(_measured_rows)] | None = None
    """What was read: rows of s, y_left, z_left, y_right, z_right [m]"""
    shift: Finite = 0.0
    """Added to the arc lengths of the file [m]"""
    scale: Finite = 1.0
    """Factor on all displacements"""
    fade: NonNegative = 10.0
    """Length over which the data fade in and out at both ends [m]"""

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if (self.file is None) == (self.rows is None):
            raise ValueError("either 'file' or 'rows' is needed")
        if self.rows is not None and len(self.rows) < 4:
            raise ValueError("four rows at least are needed")
        if self.rows is not None:
            given = [key for key in READING if getattr(self, key) not in (None, (), False)]
            if given:
                raise ValueError(f"'{given[0]}' belongs to 'file' and does not go with 'rows'")
        return self

    def mirrored(self) -> Self:
        """Return the rows with the rails exchanged, displacements to the right turned round."""
        rows = tuple((s, -yr, zr, -yl, zl) for s, yl, zl, yr, zr in self.rows or ())
        return self.model_copy(update={"rows": rows})

    def extent(self, length: float) -> tuple[float, float]:
        """Return where the rows begin and end [m]."""
        rows = self.rows or ((0.0,), (length,))
        return rows[0][0] + self.shift, rows[-1][0] + self.shift

    def resolution(self) -> float:
        """Return half the least distance of the rows, 0.05 m at least [m]."""
        s = [row[0] for row in self.rows or ()]
        return max(0.05, 0.5 * min(b - a for a, b in pairwise(s)))

    def summary(self) -> str:
        """Return that it is measured, and its number of rows."""
        return f"measured, {len(self.rows or ())} rows"


class Dip(Single):
    """A single vertical disturbance: a dipped joint, a hump."""

    type: Literal["dip"]
    s: Finite
    """Arc length of its middle [m]"""
    length: Positive
    """Length from begin to end [m]"""
    depth: Amplitude
    """Displacement in the middle, positive downwards [m]"""
    rail: Rails = "both"
    """Which rail"""
    shape: Literal["cosine", "triangle"] = "cosine"
    """`cosine`: one wave of 1 - cos; `triangle`: two straights, kinks rounded over length / 10"""

    def mirrored(self) -> Self:
        """Return the same on the other rail."""
        return self.model_copy(update={"rail": OTHER_RAIL[self.rail]})


class Kink(Single):
    """A single lateral disturbance: a kink of the alignment."""

    type: Literal["kink"]
    s: Finite
    """Arc length of its middle [m]"""
    length: Positive
    """Length from begin to end [m]"""
    offset: Amplitude
    """Displacement in the middle, positive to the right [m]"""
    rail: Rails = "both"
    """Which rail"""
    shape: Literal["cosine", "triangle"] = "triangle"
    """As for a dip"""

    def mirrored(self) -> Self:
        """Return the opposite on the other rail."""
        return self.model_copy(update={"rail": OTHER_RAIL[self.rail], "offset": -self.offset})


class Twist(Single):
    """A single disturbance of the cross level: one rail rises, the other sinks by half of it."""

    type: Literal["twist"]
    s: Finite
    """Arc length of its middle [m]"""
    length: Positive
    """Length from begin to end [m]"""
    height: Amplitude
    """Change of cross level in the middle, positive = left rail higher [m]"""
    shape: Literal["cosine", "triangle"] = "triangle"
    """As for a dip"""

    def mirrored(self) -> Self:
        """Return the opposite change."""
        return self.model_copy(update={"height": -self.height})


class Coefficients(Definition):
    """Coefficients of the spectra; form and meaning in the manual."""

    lateral: NonNegative = 0.0
    """A_a of the alignment [m rad]"""
    vertical: NonNegative = 0.0
    """A_v of the longitudinal level [m rad]"""
    cross_level: NonNegative = 0.0
    """Coefficient of the cross level instead of A_v [m rad]"""
    gauge: NonNegative = 0.0
    """A_g of the gauge [m rad]"""
    omega_c: Positive = 0.8246
    """[rad/m]"""
    omega_r: Positive = 0.0206
    """[rad/m]"""
    omega_s: Positive = 0.4380
    """[rad/m]"""
    b: Positive = 0.75
    """Half the distance of the rails that the cross level refers to [m]"""


SpectrumName = Literal[
    "erri_b176_low",
    "erri_b176_high",
    "fra_1",
    "fra_2",
    "fra_3",
    "fra_4",
    "fra_5",
    "fra_6",
    "fra_1983_1",
    "fra_1983_2",
    "fra_1983_3",
    "fra_1983_4",
    "fra_1983_5",
    "fra_1983_6",
    "china_high_speed",
    "china_trunk",
    "own",
]


class Random(Irregular):
    """Stationary random irregularities from power spectral densities."""

    type: Literal["random"]
    spectrum: SpectrumName
    """Which spectra, by name; `own` needs `coefficients`"""
    coefficients: Coefficients | None = None
    """Own coefficients"""
    seed: Annotated[int, Field(strict=True, ge=0)] = 1
    """Seed of the random phases: the same seed gives the same track"""
    wavelengths: Wavelengths = (3.0, 70.0)
    """Shortest and longest wavelength [m]; the variance is the integral of the spectrum between"""
    channels: (
        Annotated[
            tuple[Literal["lateral", "vertical", "cross_level", "gauge"], ...], Field(min_length=1)
        ]
        | None
    ) = None
    """Which of the four irregularities are generated; by default all that the spectra describe"""
    begin: Finite = 0.0
    """Arc length where it begins [m]"""
    end: Finite | None = None
    """Arc length where it ends [m]; by default the end of the plan"""
    scale: NonNegative = 1.0
    """Factor on all displacements"""
    fade: NonNegative = 10.0
    """Length over which it fades in and out within its ends [m]"""
    mirror: Flag = False
    """The mirror image of the same realisation: left and right exchanged"""

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if (self.spectrum == "own") != (self.coefficients is not None):
            raise ValueError("'coefficients' belong to spectrum = \"own\" and only to it")
        if self.end is not None and self.end <= self.begin:
            raise ValueError("'end' must lie behind 'begin'")
        channels = self.channels or ()
        if len(set(channels)) < len(channels):
            raise ValueError("'channels' names one irregularity twice")
        if self.spectrum == "china_trunk" and "gauge" in channels:
            raise ValueError("the spectra 'china_trunk' do not describe the gauge")
        return self

    def mirrored(self) -> Self:
        """Return the mirror image of the same realisation."""
        return self.model_copy(update={"mirror": not self.mirror})

    def extent(self, length: float) -> tuple[float, float]:
        """Return where it begins and ends [m]."""
        return self.begin, length if self.end is None else self.end

    def resolution(self) -> float:
        """Return a sixteenth of the shortest wavelength [m]."""
        return self.wavelengths[0] / 16.0

    def summary(self) -> str:
        """Return spectrum, seed and band."""
        low, high = self.wavelengths
        return f"{self.spectrum}, seed {self.seed}, {low:g} to {high:g} m"


class Sweep(Irregular):
    """Waves of one amplitude whose wavelength goes from one value to another.

    Each octave of wavelengths takes the same length of track.
    """

    type: Literal["sweep"]
    channel: Channel = "vertical"
    """Which of the four irregularities: both rails to the right or down, the left rail higher, or
    the rails apart"""
    amplitude: Amplitude
    """Amplitude of the waves; of `cross_level` the difference of heights, of `gauge` that of the
    gauge [m]"""
    wavelengths: tuple[Wavelength, Wavelength]
    """Wavelength at the beginning and at the end, rising or falling [m]"""
    begin: Finite
    """Arc length where it begins, at a zero of the wave [m]"""
    end: Finite
    """Arc length where it ends [m]"""
    fade: NonNegative = 10.0
    """Length over which it fades in and out within its ends [m]"""

    @model_validator(mode="after")
    def _has_a_length(self) -> Self:
        if self.end <= self.begin:
            raise ValueError("'end' must lie behind 'begin'")
        return self

    def mirrored(self) -> Self:
        """Return the mirror image: what goes to the right or rises on the left is turned round."""
        sign = MIRROR[self.channel]
        return self.model_copy(update={"amplitude": sign * self.amplitude})

    def extent(self, length: float) -> tuple[float, float]:
        """Return where it begins and ends [m]."""
        return self.begin, self.end

    def resolution(self) -> float:
        """Return a sixteenth of the shorter wavelength [m]."""
        return min(self.wavelengths) / 16.0

    def summary(self) -> str:
        """Return channel, amplitude and wavelengths."""
        first, last = self.wavelengths
        return f"{self.channel} sweep, {1e3 * self.amplitude:g} mm, {first:g} to {last:g} m"


Irregularity = Annotated[
    Measured | Dip | Kink | Twist | Random | Sweep, Field(discriminator="type")
]
