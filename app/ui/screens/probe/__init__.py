"""The probe's screen: the panorama of a place and everything that makes one."""

from __future__ import annotations

from app.ui.screens.probe.screen import ProbeScreen

__all__ = ["ProbeScreen"]
