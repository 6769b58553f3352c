"""What fills the manual: one module for each subject, with a function `make(parts)`.

``python docs/generate.py`` calls them.
"""

GENERATORS = {
    "tables": "quantities, curving study, first picture (the default; seconds)",
    "keys": "schemas of the files and tables of their keys (seconds)",
    "examples": "gallery of examples; parts: names; part `pages`: texts only (minutes)",
    "vehicles": "pages of the library; parts: names; part `data`: from the files only (minutes)",
    "stability": "pictures of modes, critical speeds, curving; parts: names (ten minutes)",
    "tracks": "tables and picture of irregularities (a minute)",
    "irregularity": "errors of tracks from accelerations, by twins (minutes)",
    "contact": "tables of contact geometry; parts: names (minutes)",
    "creep": "tables and pictures of creep forces; parts: names (minutes)",
    "robustness": "differences of 20 curves; parts: `grid` of 280, `rigid` the table (minutes)",
    "campaign": "vehicles on tracks, test campaign; part: folder of the study (seconds)",
}
"""Every generator: what it makes, and how long it takes."""
