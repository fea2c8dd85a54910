"""One run: planned, integrated, checked against the closed form, kept."""
