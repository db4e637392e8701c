"""Webcams: what they are to the program, real ones, and one that stands at the demo location."""

from __future__ import annotations

from app.devices.webcam.opencv import OpenCvWebcam, list_webcams
from app.devices.webcam.protocol import Webcam, WebcamError, WebcamFrame, WebcamState
from app.devices.webcam.simulated import SimulatedWebcam

__all__ = [
    "OpenCvWebcam",
    "SimulatedWebcam",
    "Webcam",
    "WebcamError",
    "WebcamFrame",
    "WebcamState",
    "list_webcams",
]
