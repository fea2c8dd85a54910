"""The equations of the top, symbols only: no number and no integrator enters here."""
