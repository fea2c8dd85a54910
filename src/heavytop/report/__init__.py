"""What a run looks like: tables, figures, files. Nothing is computed here."""
