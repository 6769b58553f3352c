"""Vehicle files: `tables` as written, `flatten` to plain lists, `definition` what follows."""
