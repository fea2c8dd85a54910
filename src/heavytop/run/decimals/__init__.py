"""Trajectories in more than double precision, with as many decimal digits as a scene wants."""
