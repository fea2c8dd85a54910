"""Adaptive Taylor integration: the only place where heyoka is imported."""
