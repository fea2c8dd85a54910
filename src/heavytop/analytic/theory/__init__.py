"""What is known of the heavy top without integrating: constants, roots, kinds, the closed form.

Nothing here sees the integrator or the symbolic equations. The elliptic parameter is
m = k² everywhere, and the characteristic n has the Legendre sign, Π(n|m) = ∫ dα /
((1 − n sin²α) √(1 − m sin²α)). Moments are divided out: "units A = 1" means that energies and
momenta are those of the top divided by A.
"""
