"""Vehicle files: `definition` and its `tables` as written, `flatten` to plain lists."""
