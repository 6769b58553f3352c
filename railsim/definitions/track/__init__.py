"""Track files: `definition` as written, `layout` over arc length, `support` beneath the rails."""
