"""What a top is, how it starts, and the scene files that say so."""
