"""What the package claims, on whose authority, and the scripts that measure it."""

from __future__ import annotations
