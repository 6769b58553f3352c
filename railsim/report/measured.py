"""Pages about a model against a test, and about an identification."""

from matplotlib.figure import Figure

from railsim.assessment.model_comparison import FAIL, INCOMPLETE, ModelValidation
from railsim.identification import Identified
from railsim.plot import validation as plots
from railsim.plot.style import styled
from railsim.report.document import Drawn, Section, as_png, document, pictures
from railsim.version import __version__

CAPTIONS = {
    "scatter": "Simulated over measured section values; dashed the limit of the mean, dotted twice "
    "that of the standard deviation.",
    "differences": "Differences over the limit of their standard deviation; line: their mean.",
    "overlays": "Channels over the arc length, low-passed at 20 Hz.",
    "spectra": "Power spectral densities.",
    "fits": "Measured, with the values of the file, and with the identified ones.",
    "residuals": "Cumulative periodograms of the residuals: a straight line where they are white.",
}
VALIDATION = (
    "In each section of the track the same values are formed of both: quasi-static values are "
    "medians, largest values 99.85 % percentiles (both ends on straight track) after a low pass of "
    "20 Hz, accelerations of the body between 0.4 and 10 Hz. A difference is simulated less "
    "measured, positive where the simulation overestimates the magnitude.",
)
IDENTIFICATION = (
    "Least squares over the Fourier coefficients of the differences in the band (or the values "
    "named), weighted by the noise of each channel; the covariance is the inverse of J'J with the "
    "derivatives J, times the mean square of the weighted residuals where that is above 1.",
)


def _page(
    title: str, verdict: tuple[str, bool], remarks: tuple[str, ...], sections: list[Section],
    method: tuple[str, ...],
) -> str:  # fmt: skip
    lead = f"Written by railsim {__version__}."
    words = {"text": verdict[0], "ok": verdict[1]}
    return document(title, None, (), sections, method, lead=lead, verdict=words, remarks=remarks)


def _drawn(figures: dict[str, Figure]) -> list[Drawn]:
    with styled():
        drawn = {name: as_png(figure) for name, figure in figures.items()}
    return pictures(drawn, CAPTIONS, drawn)


def validation_figures(found: ModelValidation) -> dict[str, Figure]:
    """Return the pictures of a comparison by their names."""
    with styled():
        return {
            "scatter": plots.scatter(found),
            "differences": plots.differences(found),
            "overlays": plots.overlays(found),
            "spectra": plots.spectra(found),
        }


def validation_page(found: ModelValidation) -> str:
    """Return the page about a model against a test."""
    words = {FAIL: "The model does not match the test.", INCOMPLETE: "Too few sections."}
    text = words.get(found.verdict, "The model matches the test within all limits.")
    sections = [
        Section("Differences and limits", tables=[found.table()]),
        Section("Pictures", figures=_drawn(validation_figures(found))),
        Section("Values of the sections (SI)", tables=[found.section_table()]),
    ]
    title = f"{found.vehicle} against {', '.join(found.runs)}"
    return _page(title, (text, found.verdict != FAIL), found.remarks, sections,
                 (*VALIDATION, found.limits.edition))  # fmt: skip


def identification_figures(found: Identified) -> dict[str, Figure]:
    """Return the pictures of an identification by their names."""
    with styled():
        return {"fits": plots.fits(found), "residuals": plots.residual_spectra(found)}


def identification_page(found: Identified) -> str:
    """Return the page about an identification."""
    coloured = [one.name for one in found.channels if not one.is_white]
    good = not coloured and not found.unidentified
    text = "All parameters are identified; the residuals are white."
    if found.unidentified:
        text = "Not all parameters can be told apart."
    elif coloured:
        text = f"The residuals of {', '.join(coloured)} are not white: the model lacks something."
    sections = [
        Section("Parameters", found.unidentified, [found.table(), found.correlation_table()]),
        Section("Residuals", tables=[found.residual_table()]),
        Section("Pictures", figures=_drawn(identification_figures(found))),
    ]
    title = f"{found.vehicle.name}: identified parameters"
    return _page(title, (text, good), found.remarks, sections, IDENTIFICATION)
