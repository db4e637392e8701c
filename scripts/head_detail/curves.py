"""Every kind of hair under one name."""

from __future__ import annotations

from head_detail.brows import brows
from head_detail.lashes import lashes
from head_detail.strands import Strands

KINDS = {"brows": brows, "lashes": lashes}


def curves(name: str, what: str) -> Strands:
    """Return the strands of one kind on one head.

    Args:
        what: ``brows``, ``lashes``, ``hair-short`` or ``hair-long``.
    """
    return KINDS[what](name)
