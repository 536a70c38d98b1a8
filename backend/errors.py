"""Errors that a person can mend: one clear sentence each."""

from __future__ import annotations


class InputError(Exception):
    """Bad input: says file, field, value and what is allowed. The program exits with 2."""
