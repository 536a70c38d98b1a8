"""What was compiled from an older text of a kernel is not kept."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import pytest

from backend.warm import forget_stale

INNER = "from numba import njit\n\n\n@njit(cache=True)\ndef inner(x):\n    return x + {0}\n"
OUTER = (
    "from numba import njit\n\nfrom {0}_inner import inner\n\n\n"
    "@njit(cache=True)\ndef outer(x):\n    return inner(x)\n"
)


def called(name: str) -> float:
    for module in (f"{name}_outer", f"{name}_inner"):
        sys.modules.pop(module, None)
    importlib.invalidate_caches()
    return float(importlib.import_module(f"{name}_outer").outer(1.0))


def test_a_kernel_in_another_file_is_compiled_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    inner, outer = tmp_path / "warm_inner.py", tmp_path / "warm_outer.py"
    inner.write_text(INNER.format(1.0))
    outer.write_text(OUTER.format("warm"))
    assert forget_stale(tmp_path)
    assert called("warm") == 2.0
    assert list(tmp_path.rglob("*.nbc"))
    assert not forget_stale(tmp_path)
    inner.write_text(INNER.format(10.0))
    assert called("warm") == 2.0, "numba sees it by itself: forget_stale is needed no more"
    assert forget_stale(tmp_path)
    assert not list(tmp_path.rglob("*.nbc"))
    assert called("warm") == 11.0
