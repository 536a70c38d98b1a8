"""Measured durations as rows of the bench document."""

from __future__ import annotations

import numpy as np

from backend.documents.bench import BenchRow


def percentile_rows(
    name: str, seconds: list[float], target_ms: float | None = None
) -> list[BenchRow]:
    """Rows for p50, p95 and p99 of durations; the target applies to p95."""
    ms = 1e3 * np.asarray(seconds)
    low, high = (float(v) for v in np.percentile(ms, [5, 95]))
    return [
        BenchRow(
            name=f"{name} p{p}",
            value=float(np.percentile(ms, p)),
            unit="ms",
            spread=(low, high),
            target=target_ms if p == 95 else None,
        )
        for p in (50, 95, 99)
    ]
