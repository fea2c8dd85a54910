"""Adaptive Taylor integration: the only place where heyoka is used (`library` imports it)."""
