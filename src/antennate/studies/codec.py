"""Results as JSON and back: the same types, every bit of every number.

Dataclasses, models, enumerations, tuples and arrays are objects with the key `@`. Nothing is ever
unpickled: a file names only classes of packages that are trusted already.
"""

from __future__ import annotations

import base64
import json
import sys
from collections.abc import Collection, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any

import numpy as np
from pydantic import BaseModel

_KIND = "@"


def encoded(value: Any) -> Any:
    """A value as what JSON can hold.

    Raises:
        TypeError: It holds an object of another kind.
    """
    match value:
        case Enum():
            return {_KIND: _name(value), "value": value.value}
        case np.ndarray() | np.generic():
            data = base64.b64encode(np.ascontiguousarray(value).tobytes()).decode()
            kind = "array" if isinstance(value, np.ndarray) else "scalar"
            return {_KIND: kind, "dtype": value.dtype.str, "shape": value.shape, "data": data}
        case None | bool() | int() | float() | str():
            return value
        case BaseModel():
            return {_KIND: _name(value), "fields": value.model_dump_json()}
        case tuple():
            return {_KIND: "tuple", "of": [encoded(item) for item in value]}
        case list():
            return [encoded(item) for item in value]
        case Mapping():
            pairs = [(encoded(key), encoded(item)) for key, item in value.items()]
            if all(isinstance(key, str) and key != _KIND for key, _ in pairs):
                return dict(pairs)
            return {_KIND: "dict", "of": pairs}
    if is_dataclass(value) and not isinstance(value, type):
        return {_KIND: _name(value)} | {
            field.name: encoded(getattr(value, field.name)) for field in fields(value)
        }
    raise TypeError(f"expected a result that can be kept, found {type(value).__name__}")


def decoded(data: Any, packages: Collection[str]) -> Any:
    """Back from `encoded`.

    Args:
        data: What JSON held.
        packages: Top-level packages whose classes may be named.

    Raises:
        ValueError: It is nothing that `encoded` makes.
    """
    if isinstance(data, list):
        return [decoded(item, packages) for item in data]
    if not isinstance(data, dict):
        return data
    kind = data.get(_KIND)
    if kind is None:
        return {key: decoded(item, packages) for key, item in data.items()}
    try:
        if kind == "tuple":
            return tuple(decoded(item, packages) for item in data["of"])
        if kind == "dict":
            return {decoded(k, packages): decoded(item, packages) for k, item in data["of"]}
        if kind in ("array", "scalar"):
            flat = np.frombuffer(base64.b64decode(data["data"]), np.dtype(data["dtype"]))
            array = flat.reshape(data["shape"]).copy()
            return array if kind == "array" else array[()]
        return _object(_class(kind, packages), data, packages)
    except (KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"expected a result, found {error}") from None


def _object(found: type, data: Mapping[str, Any], packages: Collection[str]) -> Any:
    if issubclass(found, Enum):
        return found(data["value"])
    if issubclass(found, BaseModel):
        return found.model_validate_json(data["fields"])
    if not is_dataclass(found):
        raise TypeError(f"the class {found.__name__}")
    return found(**{k: decoded(item, packages) for k, item in data.items() if k != _KIND})


def _name(value: Any) -> str:
    return f"{type(value).__module__}:{type(value).__qualname__}"


def _class(name: str, packages: Collection[str]) -> type:
    """A class that is imported already, of a trusted package."""
    module, _, path = name.partition(":")
    if module.partition(".")[0] not in packages or module not in sys.modules:
        raise TypeError(f"a class of {module}")
    found: Any = sys.modules[module]
    for part in path.split("."):
        found = getattr(found, part)
    if not isinstance(found, type):
        raise TypeError(f"no class {name}")
    return found


def dumped(value: Any) -> str:
    """JSON on one line; NaN and infinities are kept."""
    return json.dumps(value, separators=(",", ":"))
