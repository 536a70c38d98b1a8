"""What a tree holds."""

from __future__ import annotations

BOXES, TRIANGLES, POINTS = 0, 1, 2
