"""Live video from webcams, network cameras, video files and the demo webcam."""

from __future__ import annotations

from app.devices.webcam.opencv import OpenCvWebcam, list_webcams
from app.devices.webcam.protocol import GUESS_FOV_DEG, Webcam, WebcamError, WebcamFrame, WebcamState
from app.devices.webcam.simulated import SimulatedWebcam
from app.devices.webcam.sources import LiveSource, SourceView, SourceViews, make_source

__all__ = [
    "GUESS_FOV_DEG",
    "LiveSource",
    "OpenCvWebcam",
    "SimulatedWebcam",
    "SourceView",
    "SourceViews",
    "Webcam",
    "WebcamError",
    "WebcamFrame",
    "WebcamState",
    "list_webcams",
    "make_source",
]
