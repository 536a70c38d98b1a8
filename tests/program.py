"""Run the program as a person would, in this process so that a hundred runs stay quick."""

from __future__ import annotations

import contextlib
import io
from dataclasses import dataclass

from cockpit.cli import main


@dataclass(frozen=True)
class Done:
    returncode: int
    stdout: str
    stderr: str


def cockpit(*arguments: str) -> Done:
    """Exit code and output of `cockpit ARGUMENTS`."""
    out, err = io.StringIO(), io.StringIO()
    code = 0
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main(arguments)
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else int(end.code is not None)
    return Done(code, out.getvalue(), err.getvalue())
