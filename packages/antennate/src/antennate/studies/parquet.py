"""Tables as Parquet, by pyarrow of the extra `parquet`."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from importlib import import_module
from typing import Any

import numpy as np

from antennate.errors import MissingPackageError
from antennate.messages import extra


def require_parquet(what: str, instead: str = "") -> tuple[Any, Any]:
    """The modules pyarrow and pyarrow.parquet.

    Args:
        what: Needs them.
        instead: What can be done without them.
    """
    try:
        return import_module("pyarrow"), import_module("pyarrow.parquet")
    except ImportError:
        raise MissingPackageError(
            f"{what}: expected the package pyarrow, found none; install it with "
            f"{extra('parquet')}{instead}"
        ) from None


def to_parquet(
    columns: Mapping[str, Any],
    notes: Mapping[str, Mapping[str, str]],
    about: Mapping[str, Any],
) -> bytes:
    """A Parquet file; the same bytes for the same columns by the same pyarrow.

    Args:
        columns: Arrays of shape (n,), or (n, k) for a list of k numbers in each cell, by name.
        notes: Metadata of each column, as its unit.
        about: Metadata of the file; each value is kept as JSON.
    """
    arrow, parquet = require_parquet("Parquet")
    arrays = [_array(arrow, np.asarray(values)) for values in columns.values()]
    fields = [
        arrow.field(name, array.type, metadata=dict(notes[name]))
        for name, array in zip(columns, arrays, strict=True)
    ]
    metadata = {key: json.dumps(value, sort_keys=True) for key, value in about.items()}
    table = arrow.Table.from_arrays(arrays, schema=arrow.schema(fields, metadata=metadata))
    file = io.BytesIO()
    parquet.write_table(table, file, compression="zstd")
    return file.getvalue()


def _array(arrow: Any, values: np.ndarray) -> Any:
    if values.ndim == 1:
        return arrow.array(values.tolist() if values.dtype.kind == "U" else values)
    return arrow.FixedSizeListArray.from_arrays(arrow.array(values.ravel()), values.shape[1])
