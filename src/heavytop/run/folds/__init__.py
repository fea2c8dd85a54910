"""What a motion is folded onto: half a nutation, or a uniform rotation."""
