"""Adaptive Taylor integration: the only place where heyoka is used (`system` imports it)."""
