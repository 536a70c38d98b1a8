"""Tables as files: CSV and Parquet to columns of numbers, with places that people can find."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv
import pyarrow.parquet

from backend.errors import InputError
from backend.shell.session.source import Problems
from backend.spatial.types import Array


def where(path: Path, row: int) -> str:
    """A row as people find it: CSV lines count from 1 and begin with the header."""
    return (
        f"{path.name}, line {row + 2}" if path.suffix == ".csv" else f"{path.name}, row {row + 1}"
    )


def column_names(path: Path) -> list[str]:
    """Raises InputError when the file is no table."""
    try:
        if path.suffix == ".parquet":
            return list(pyarrow.parquet.read_schema(path).names)
        with path.open(encoding="utf-8-sig") as file:
            return [name.strip().strip('"') for name in file.readline().rstrip("\r\n").split(",")]
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not UTF-8 text; allowed is a CSV table.") from error
    except (OSError, pa.ArrowException) as error:
        raise InputError(f"{path}: cannot be read as Parquet ({_line(error)}).") from error


def read_columns(path: Path, names: list[str]) -> Any:
    """The named columns; those of a CSV as texts. Raises InputError."""
    try:
        if path.suffix == ".parquet":
            return pyarrow.parquet.read_table(path, columns=names)
        return pyarrow.csv.read_csv(
            path,
            read_options=pyarrow.csv.ReadOptions(
                column_names=column_names(path), skip_rows=1, encoding="utf8"
            ),
            convert_options=pyarrow.csv.ConvertOptions(
                include_columns=names,
                column_types=dict.fromkeys(names, pa.string()),
                strings_can_be_null=True,
                null_values=[""],
            ),
        )
    except (OSError, pa.ArrowException) as error:
        raise InputError(f"{path}: cannot be read as a table ({_line(error)}).") from error


def _line(error: Exception) -> str:
    return " ".join(str(error).split()).rstrip(".")[:200]


def numbers(table: Any, name: str, path: Path, problems: Problems) -> Array:
    """(rows,) float64, NaN where empty; int64 for whole nanoseconds. Raises InputError for what is
    no number."""
    column = table.column(name)
    if pa.types.is_string(column.type) or pa.types.is_large_string(column.type):
        column = pc.utf8_trim_whitespace(column)
        try:
            column = _cast(column, name)
        except pa.ArrowInvalid:
            for row, value in enumerate(column.to_pylist()):
                if value is not None and not _is_number(value):
                    raise InputError(
                        f'{where(path, row)}: column {name} is "{value[:40]}"; allowed is a '
                        "number, or nothing."
                    ) from None
            raise
    elif not (pa.types.is_integer(column.type) or pa.types.is_floating(column.type)):
        raise InputError(f"{path}: column {name} is of type {column.type}; allowed are numbers.")
    if pa.types.is_integer(column.type) and name.endswith("_ns") and not column.null_count:
        return np.asarray(column.to_numpy())
    if pa.types.is_floating(column.type):
        bad = np.flatnonzero(pc.fill_null(pc.is_nan(column), False).to_numpy())
        if len(bad):
            problems.add(
                where(path, int(bad[0])),
                f"column {name} is NaN; it counts as not measured",
                kind=f"{name} NaN",
                count=len(bad),
            )
    return np.asarray(pc.cast(column, pa.float64()).to_numpy(), dtype=np.float64)


def _cast(column: Any, name: str) -> Any:
    if name.endswith("_ns"):
        try:
            return pc.cast(column, pa.int64())
        except pa.ArrowInvalid:
            pass
    return pc.cast(column, pa.float64())


def _is_number(text: str) -> bool:
    try:
        pc.cast(pa.scalar(text), pa.float64())
    except pa.ArrowInvalid:
        return False
    return True
