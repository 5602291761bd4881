"""HDF5 of tracking software: SLEAP analysis, SLEAP labels (.slp) and DeepLabCut.

All three are read by h5py alone: sleap-io and pandas with PyTables would read them too, but bring
dozens of packages for a few arrays.
"""

from __future__ import annotations

import io
import json
import math
import pickle
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from antennate.errors import BadInputError, MissingPackageError
from antennate.experiments.tracks.track import (
    LARGEST,
    Track,
    from_columns,
    refuse_labels,
    require_points,
    require_room_for,
)
from antennate.files import read_limited
from antennate.messages import extra
from antennate.types import Floats

_SLEAP_CUTOFF = 0.2
"""Height of a peak below which SLEAP's inference leaves a point out by default."""
_SLEAP_AXES = ("track", "xy", "node", "frame")


def read(path: Path, names: Sequence[str]) -> list[Track]:
    """The animals of a file, with the named points.

    Raises:
        BadInputError: It cannot be read, or lacks a point.
        MissingPackageError: h5py is not installed.
    """
    try:
        import h5py
    except ImportError:
        raise MissingPackageError(
            f"{path}: expected h5py to read HDF5, found none; install it with {extra('tracks')}"
        ) from None
    data = read_limited(path, LARGEST)
    try:
        with h5py.File(io.BytesIO(data), "r") as file:
            if "tracks" in file and "node_names" in file:
                return _analysis(path, file, names)
            if "instances" in file and "metadata" in file:
                return _labels(path, file, names)
            for group in file.values():
                if "pandas_type" in group.attrs:
                    return _deeplabcut(path, group, names)
            found = ", ".join(file) or "nothing"
    except (OSError, RuntimeError, KeyError, IndexError, TypeError, UnicodeError) as error:
        raise BadInputError(
            f"{path}: expected a whole HDF5 file of SLEAP or DeepLabCut, found: {error}"
        ) from None
    raise BadInputError(
        f"{path}: expected HDF5 of SLEAP (tracks, node_names) or DeepLabCut (df_with_missing), "
        f"found {found}"
    )


def _texts(values: Any) -> list[str]:
    return [v.decode() if isinstance(v, bytes) else str(v) for v in np.asarray(values).tolist()]


def _analysis(path: Path, file: Any, names: Sequence[str]) -> list[Track]:
    """SLEAP writes (track, xy, node, frame); some write it reversed, or name the axes."""
    nodes, tracks = _texts(file["node_names"]), file["tracks"]
    require_points(path, names, nodes)
    where, shape = _axes(path, file, len(nodes)), tracks.shape
    wanted = [nodes.index(name) for name in names]
    _judge(path, tracks, len(wanted) / max(1, len(nodes)))
    points = np.moveaxis(_taken(tracks, wanted, where[2]), where, (0, 3, 2, 1))
    scores = None
    if "point_scores" in file:
        held = file["point_scores"]
        kept = [axis for axis in np.argsort(where) if axis != 1]  # those of tracks without xy
        order = [kept.index(axis) for axis in (0, 2, 3)]
        if held.shape == tuple(np.delete(shape, where[1])):
            _judge(path, held, len(wanted) / max(1, len(nodes)))
            scores = np.moveaxis(_taken(held, wanted, order[1]), order, (0, 2, 1))
    titles = _texts(file["track_names"]) if "track_names" in file else []
    titles = titles if len(titles) == len(points) else [str(i) for i in range(len(points))]
    titles = titles if len(points) > 1 else [""]
    return [
        Track(
            str(path),
            title,
            np.arange(points.shape[1]),
            None,
            {n: points[i, :, k] for k, n in enumerate(names)},
            {} if scores is None else {n: scores[i, :, k] for k, n in enumerate(names)},
            _SLEAP_CUTOFF,
        )
        for i, title in enumerate(titles)
    ]


def _judge(path: Path, held: Any, share: float = 1.0) -> None:
    """Refuse an array, before it is unpacked, of which a share, or a single chunk, is too large."""
    size = max(8, held.dtype.itemsize)
    require_room_for(path, round(share * held.size * size))
    require_room_for(path, math.prod(held.chunks or (1,)) * size)


def _taken(held: Any, places: Sequence[int], axis: int) -> Floats:
    """Some places along an axis of an array of a file, in this order."""
    before = (slice(None),) * axis
    return np.stack([np.asarray(held[(*before, i)], np.float64) for i in places], axis)


def _axes(path: Path, file: Any, nodes: int) -> tuple[int, ...]:
    """Where track, xy, node and frame stand among the axes of `tracks`."""
    tracks = file["tracks"]
    dims = tracks.attrs.get("dims")
    if dims is not None:
        listed = json.loads(dims) if isinstance(dims, str | bytes) else _texts(dims)
        if sorted(listed) == sorted(_SLEAP_AXES):
            return tuple(listed.index(name) for name in _SLEAP_AXES)
    for order in ((0, 1, 2, 3), (3, 2, 1, 0)):
        if tracks.ndim == 4 and (tracks.shape[order[1]], tracks.shape[order[2]]) == (2, nodes):
            return order
    raise BadInputError(
        f"{path}: expected tracks of shape (tracks, 2, {nodes}, frames), found {tracks.shape}"
    )


def _labels(path: Path, file: Any, names: Sequence[str]) -> list[Track]:
    """SLEAP's own file: frames, their instances, and the points of each in the skeleton's order."""
    try:
        about = json.loads(file["metadata"].attrs["json"])
        order = [node["id"] for node in about["skeletons"][0]["nodes"]]
        nodes = [about["nodes"][i]["name"] for i in order]
    except (ValueError, KeyError, TypeError) as error:
        raise BadInputError(f"{path}: expected a skeleton of SLEAP, found: {error}") from None
    require_points(path, names, nodes)
    for key in ("frames", "instances", "points", "pred_points"):
        _judge(path, file[key])
    frames, instances = file["frames"][()], file["instances"][()]
    if len(set(frames["video"].tolist())) > 1:
        raise BadInputError(f"{path}: expected one video, found several; save each on its own")
    held = (file["points"][()], file["pred_points"][()])
    shift = 0.5 if float(file["metadata"].attrs.get("format_id", 1.2)) < 1.1 else 0.0
    last = int(frames["frame_idx"].max()) + 1 if len(frames) else 0
    tracks: dict[int, tuple[Floats, Floats]] = {}
    for frame in frames:
        for one in instances[int(frame["instance_id_start"]) : int(frame["instance_id_end"])]:
            source = held[int(one["instance_type"])]
            part = source[int(one["point_id_start"]) : int(one["point_id_end"])]
            number, at, seen = int(one["track"]), int(frame["frame_idx"]), part["visible"]
            if number not in tracks:
                require_room_for(path, (len(tracks) + 1) * last * len(nodes) * 3 * 8)
                tracks[number] = (
                    np.full((last, len(nodes), 2), np.nan),
                    np.zeros((last, len(nodes))),
                )
            points, scores = tracks[number]
            if number < 0 and scores[at].any():
                raise BadInputError(
                    f"{path}: expected tracked animals, found several without a track in frame "
                    f"{at}; track them in SLEAP"
                )
            points[at, seen, 0], points[at, seen, 1] = (
                part["x"][seen] - shift,
                part["y"][seen] - shift,
            )
            scores[at, seen] = part["score"][seen] if "score" in part.dtype.names else 1.0
    return [
        Track(
            str(path),
            str(number) if len(tracks) > 1 else "",
            np.arange(last),
            None,
            {n: points[:, nodes.index(n)] for n in names},
            {n: scores[:, nodes.index(n)] for n in names},
            _SLEAP_CUTOFF,
        )
        for number, (points, scores) in sorted(tracks.items())
    ]


class _Plain(pickle.Unpickler):
    """Reads lists, tuples, texts and numbers; whatever would run code is refused."""

    def find_class(self, module: str, name: str) -> Any:
        raise pickle.UnpicklingError(f"{module}.{name} where names of columns should be")


def _deeplabcut(path: Path, group: Any, names: Sequence[str]) -> list[Track]:
    """A pandas table: in format `table` with pickled names of columns, or in format `fixed`."""
    try:
        if "table" in group:
            table = group["table"]
            _judge(path, table)
            blocks = [name for name in table.dtype.names if name.startswith("values_block_")]
            index, values = table["index"], np.hstack([table[name] for name in blocks])
            held = [table.attrs[f"{name}_kind"] for name in blocks]
            columns = [key for each in held for key in _Plain(io.BytesIO(_bytes(each))).load()]
        else:
            _judge(path, group["block0_values"])
            count, index = int(group.attrs["axis0_nlevels"]), group["axis1"][()]
            values = np.asarray(group["block0_values"][()], np.float64)
            levels = [_texts(group[f"block0_items_level{i}"]) for i in range(count)]
            codes = [group[f"block0_items_label{i}"][()] for i in range(count)]
            columns = list(
                zip(
                    *([k[c] for c in code] for k, code in zip(levels, codes, strict=True)),
                    strict=True,
                )
            )
    except BadInputError:
        raise
    except (pickle.UnpicklingError, KeyError, ValueError, EOFError, AttributeError) as error:
        raise BadInputError(
            f"{path}: expected a table of DeepLabCut, found: {error}; save it as CSV"
        ) from None
    if index.dtype.kind not in "iuf":
        refuse_labels(path, _texts(index)[0] if len(index) and index.dtype.kind in "SO" else "")
    by_name = {
        (key[1] if len(key) == 4 else "", str(key[-2]), str(key[-1])): values[:, i].astype(float)
        for i, key in enumerate(columns)
    }
    return from_columns(path, np.asarray(index, np.float64), by_name, names)


def _bytes(value: Any) -> bytes:
    return value.encode("latin-1") if isinstance(value, str) else bytes(value)
