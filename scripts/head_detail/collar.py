"""stub."""
from __future__ import annotations
import numpy as np
def collar(name):
    return np.array([[0,0,0],[0,.01,0],[.01,0,0]],float), np.array([[0,0,1.]]*3), np.array([[0,1,2]])
