"""Trajectories of others, held against the closed form; nothing is integrated."""
