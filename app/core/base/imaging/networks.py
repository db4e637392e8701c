"""Read neural networks with OpenCV."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import cv2
import numpy as np


def read_network(path: Path) -> Any:
    """Load a network (.onnx or .tflite) from its bytes, since OpenCV rejects some file names.

    Raises:
        OSError: If the file cannot be read.
        cv2.error: If the file is damaged.
    """
    # OpenCV 5.0 finds no engine for a TFLite network in memory unless this variable names one.
    os.environ.setdefault("OPENCV_FORCE_DNN_ENGINE", str(cv2.dnn.ENGINE_CLASSIC))
    read = cv2.dnn.readNetFromONNX if path.suffix == ".onnx" else cv2.dnn.readNetFromTFLite
    return read(np.fromfile(path, np.uint8), cv2.dnn.ENGINE_CLASSIC)
