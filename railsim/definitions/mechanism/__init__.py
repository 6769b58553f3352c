"""Mechanism files: `parts` and `values`, their `expressions`, and `faults` of the whole."""
