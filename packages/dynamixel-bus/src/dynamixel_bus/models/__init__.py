"""Servo models as TOML files: those in this folder, and any other by its path.

A file may be `like` another model and then holds only what is different.
"""

from __future__ import annotations

import functools
import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Any

from dynamixel_bus.errors import ConfigError
from dynamixel_bus.files import read_toml
from dynamixel_bus.messages import nearest, shown
from dynamixel_bus.model import ServoModel
from dynamixel_bus.model_file import checked, model_of

_FOLDER = Path(__file__).parent
_SHIPPED = sorted(file.name[:-5] for file in files(__name__).iterdir() if ".toml" in file.name)
_LARGEST_FILE = 200_000
"""Most bytes of a model file."""
_NOT_SERVED = {
    "xl320": "the XL-320 has another control table than the X series (goal position at 30, not 116;"
    " 1024 steps over 300 deg, no turn without end, no bus watchdog)"
}
"""Servos that one could take for ones of the X series, and why they are none.

Source: https://emanual.robotis.com/docs/en/dxl/x/xl320/.
"""


def servo_model(name: str | Path) -> ServoModel:
    """A servo model, by the name of a shipped one or by the path of a file.

    Args:
        name: A name such as `xc430-w240`, or a path that ends in `.toml`.

    Raises:
        ConfigError: There is no such model, or the file does not describe a servo of the X series.
    """
    if str(name).endswith(".toml"):
        return _read(Path(name))
    if str(name) not in MODELS:
        if why := not_served(str(name)):
            raise ConfigError(f"expected a servo of the X series, found {name}: {why}")
        raise ConfigError(
            f"expected as servo model one of {', '.join(MODELS)}, or a file that ends in .toml, "
            f"found {name}{nearest(str(name), MODELS)}"
        )
    return MODELS[str(name)]


def not_served(name: str) -> str:
    """Why a servo is not served although it speaks Protocol 2.0; nothing of any other name."""
    return _NOT_SERVED.get("".join(c for c in name.lower() if c.isalnum())[:5], "")


def model_name(number: int | None) -> str:
    """Name of a shipped model, or its number if it is not known."""
    found = MODELS_BY_NUMBER.get(number) if number is not None else None
    return found.name if found else f"model {number}"


def _read(path: Path) -> ServoModel:
    """The model in a file; the XC430-W240 says where the common registers lie."""
    layout = _shipped_table(_FOLDER / "xc430-w240.toml")["registers"]
    return model_of(_table_of(path, ()), str(path), layout)


def _table_of(path: Path, above: tuple[Path, ...]) -> dict[str, Any]:
    """What stands in a file, over what stands in the model that it is `like`."""
    place = path.absolute()
    if place in above:
        raise ConfigError(f"{path}: expected a model that is like another, found one like itself")
    table = dict(_shipped_table(path) if path.parent == _FOLDER else read_toml(path, _LARGEST_FILE))
    like, removed = table.pop("like", None), table.pop("without", [])
    if like is None:
        return table
    names = removed if isinstance(removed, list) else [None]
    if not all(isinstance(name, str) for name in (like, *names)):
        raise ConfigError(f"{path}: expected a name as `like`, and a list of names as `without`")
    base = path.parent / like if like.endswith(".toml") else _FOLDER / f"{like}.toml"
    if not like.endswith(".toml") and like not in _SHIPPED:
        known = ", ".join(_SHIPPED)
        raise ConfigError(f"{path}: like: expected one of {known}, found {shown(like)}")
    found = _over(_table_of(base, (*above, place)), table)
    registers = dict(checked(found.get("registers"), f"{path}: registers", {}, others=True))
    for name in removed:
        if registers.pop(name, None) is None:
            raise ConfigError(
                f"{path}: without: expected a register of {like}, found {shown(name)}"
            )
    return found | {"registers": registers}


@functools.cache
def _shipped_table(path: Path) -> dict[str, Any]:
    """What stands in one of our files, read once, from a zip too; nobody changes it."""
    return tomllib.loads((files(__name__) / path.name).read_text(encoding="utf-8"))


def _over(base: dict[str, Any], table: dict[str, Any]) -> dict[str, Any]:
    """Nested tables: the values of `table` over those of `base`."""
    both = {key: (base.get(key), value) for key, value in table.items()}
    return base | {
        key: _over(old, new) if isinstance(old, dict) and isinstance(new, dict) else new
        for key, (old, new) in both.items()
    }


MODELS: dict[str, ServoModel] = {name: _read(_FOLDER / f"{name}.toml") for name in _SHIPPED}
"""The models that we ship, by the name of their file."""
MODELS_BY_NUMBER = {model.number: model for model in MODELS.values()}
XC430_W240, XL330_M288 = MODELS["xc430-w240"], MODELS["xl330-m288"]
XL430_W250 = MODELS["xl430-w250"]
