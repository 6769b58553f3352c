"""Track files: `tables` as written, `layout` over arc length, `definition` what follows."""
