"""Files of tracking software as tracks: CSV, HDF5 of SLEAP and DeepLabCut, npz of TRex."""

from __future__ import annotations

import io
import json
import math
import pickle
import zipfile
import zlib
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from antennate.errors import BadInputError, MissingPackageError
from antennate.files import read_limited
from antennate.messages import extra, shortened
from antennate.types import Floats
from antennate_lab.tracks.config import ColumnsParams
from antennate_lab.tracks.track import (
    LARGEST,
    SLEAP_CUTOFF,
    Track,
    from_columns,
    numbered,
    read_csv,
    refuse_labels,
    require_points,
    require_room_for,
)

SUFFIXES = (".csv", ".h5", ".hdf5", ".slp", ".npz")
_DAMAGES = (
    zipfile.BadZipFile,
    zlib.error,
    EOFError,
    KeyError,
    OSError,
    RuntimeError,  # a byte that says encrypted, or another compression
    ValueError,
)
"""What NumPy raises for a damaged npz file."""
_TREX = "an npz file of TRex with poseX0, poseY0 and so on"
_LONGEST_HEADER = 1 << 14
"""More than NumPy takes of an array's header [byte]; one may say of itself that it has 4 GB."""
_SLEAP_AXES = ("track", "xy", "node", "frame")


def read(path: Path, names: Sequence[str], columns: ColumnsParams) -> list[Track]:
    """The animals of a file, with the named points.

    Args:
        path: The file; its suffix gives the format.
        names: Points that are wanted.
        columns: Columns of plain CSV.
    """
    suffix = path.suffix.lower()
    if suffix == ".csv":
        return read_csv(path, names, columns)
    if suffix == ".npz":
        return _trex(path, names)
    if suffix in SUFFIXES:
        return _hdf5(path, names)
    raise BadInputError(
        f"{path}: expected a file in {', '.join(SUFFIXES)}, found {suffix or 'none'}"
    )


def _hdf5(path: Path, names: Sequence[str]) -> list[Track]:
    """The animals of a file of SLEAP or DeepLabCut.

    It is read by h5py alone: sleap-io and pandas with PyTables would read it too, but bring dozens
    of packages for a few arrays.
    """
    try:
        import h5py
    except ImportError:
        raise MissingPackageError(
            f"{path}: expected h5py to read HDF5, found none; install it with "
            f"{extra('tracks', 'antennate-lab')}"
        ) from None
    data = read_limited(path, LARGEST)
    try:
        with h5py.File(io.BytesIO(data), "r") as file:
            if "tracks" in file and "node_names" in file:
                return _sleap_analysis(path, file, names)
            if "instances" in file and "metadata" in file:
                return _sleap_labels(path, file, names)
            for group in file.values():
                if "pandas_type" in group.attrs:
                    return _pandas_table(path, group, names)
            groups = ", ".join(file) or "nothing"
    except (OSError, RuntimeError, KeyError, IndexError, TypeError, UnicodeError) as error:
        raise BadInputError(
            f"{path}: expected a whole HDF5 file of SLEAP or DeepLabCut, found: {error}"
        ) from None
    raise BadInputError(
        f"{path}: expected HDF5 of SLEAP (tracks, node_names) or DeepLabCut (df_with_missing), "
        f"found {groups}"
    )


def _texts(values: Any) -> list[str]:
    return [v.decode() if isinstance(v, bytes) else str(v) for v in np.asarray(values).tolist()]


def _sleap_analysis(path: Path, file: Any, names: Sequence[str]) -> list[Track]:
    """SLEAP writes (track, xy, node, frame); some write it reversed, or name the axes."""
    nodes, tracks = _texts(file["node_names"]), file["tracks"]
    require_points(path, names, nodes)
    where, shape = _axes(path, file, len(nodes)), tracks.shape
    wanted = [nodes.index(name) for name in names]
    _require_room(path, tracks, len(wanted) / max(1, len(nodes)))
    points = np.moveaxis(_picked(tracks, wanted, where[2]), where, (0, 3, 2, 1))
    scores = None
    if "point_scores" in file:
        heights = file["point_scores"]
        axes = [axis for axis in np.argsort(where) if axis != 1]  # those of tracks without xy
        order = [axes.index(axis) for axis in (0, 2, 3)]
        if heights.shape != (each := tuple(np.delete(shape, where[1]).tolist())):
            raise BadInputError(
                f"{path}: expected point_scores of shape {each}, found {heights.shape}"
            )
        _require_room(path, heights, len(wanted) / max(1, len(nodes)))
        scores = np.moveaxis(_picked(heights, wanted, order[1]), order, (0, 2, 1))
    titles = _texts(file["track_names"]) if "track_names" in file else []
    titles = titles if len(titles) == len(points) else [str(i) for i in range(len(points))]
    animals = [
        (title, points[i], None if scores is None else scores[i]) for i, title in enumerate(titles)
    ]
    return _sleap_tracks(path, names, animals)


def _sleap_tracks(
    path: Path, names: Sequence[str], animals: Sequence[tuple[str, Floats, Floats | None]]
) -> list[Track]:
    """Tracks from points (n, k, 2) and scores (n, k) of the named points of each animal."""
    return [
        Track(
            str(path),
            title if len(animals) > 1 else "",
            np.arange(len(points)),
            None,
            {n: points[:, k] for k, n in enumerate(names)},
            {} if scores is None else {n: scores[:, k] for k, n in enumerate(names)},
            SLEAP_CUTOFF,
        )
        for title, points, scores in animals
    ]


def _require_room(path: Path, array: Any, share: float = 1.0) -> None:
    """Refuse an array, before it is unpacked, of which a share, or a single chunk, is too large."""
    size = max(8, array.dtype.itemsize)
    require_room_for(path, round(share * array.size * size))
    require_room_for(path, math.prod(array.chunks or (1,)) * size)


def _picked(array: Any, places: Sequence[int], axis: int) -> Floats:
    """Values at places along an axis of an array of a file, in this order."""
    before = (slice(None),) * axis
    return np.stack([np.asarray(array[(*before, i)], np.float64) for i in places], axis)


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


def _sleap_labels(path: Path, file: Any, names: Sequence[str]) -> list[Track]:
    """SLEAP's own file: frames, their instances, and the points of each in the skeleton's order."""
    try:
        about = json.loads(file["metadata"].attrs["json"])
        order = [node["id"] for node in about["skeletons"][0]["nodes"]]
        nodes = [about["nodes"][i]["name"] for i in order]
    except (ValueError, KeyError, TypeError) as error:
        raise BadInputError(f"{path}: expected a skeleton of SLEAP, found: {error}") from None
    require_points(path, names, nodes)
    for key in ("frames", "instances", "points", "pred_points"):
        _require_room(path, file[key])
    frames, instances = file["frames"][()], file["instances"][()]
    if len(set(frames["video"].tolist())) > 1:
        raise BadInputError(f"{path}: expected one video, found several; save each on its own")
    sources = (file["points"][()], file["pred_points"][()])
    shift = 0.5 if float(file["metadata"].attrs.get("format_id", 1.2)) < 1.1 else 0.0
    last = int(frames["frame_idx"].max()) + 1 if len(frames) else 0
    tracks: dict[int, tuple[Floats, Floats]] = {}
    corrected, replaced = _corrected(instances), Counter[int]()
    for frame in frames:
        taken = set[int]()
        for place in range(int(frame["instance_id_start"]), int(frame["instance_id_end"])):
            instance = instances[place]
            source = sources[int(instance["instance_type"])]
            part = source[int(instance["point_id_start"]) : int(instance["point_id_end"])]
            number, at, seen = int(instance["track"]), int(frame["frame_idx"]), part["visible"]
            if number not in tracks:
                require_room_for(path, (len(tracks) + 1) * last * len(nodes) * 3 * 8)
                tracks[number] = (
                    np.full((last, len(nodes), 2), np.nan),
                    np.zeros((last, len(nodes))),
                )
            points, scores = tracks[number]
            if place in corrected or not seen.any():
                replaced[number] += place in corrected
                continue
            if number in taken:
                which = f"of track {number}" if number >= 0 else "without a track"
                raise BadInputError(
                    f"{path}: expected tracked animals, found several {which} in frame {at}; track "
                    "them in SLEAP"
                )
            taken.add(number)
            points[at, seen, 0], points[at, seen, 1] = (
                part["x"][seen] - shift,
                part["y"][seen] - shift,
            )
            scores[at, seen] = part["score"][seen] if "score" in part.dtype.names else 1.0
    wanted = [nodes.index(name) for name in names]
    animals = [
        (str(number), points[:, wanted], scores[:, wanted])
        for number, (points, scores) in sorted(tracks.items())
    ]
    found = _sleap_tracks(path, names, animals)
    return [replace(t, replaced=replaced[n]) for t, n in zip(found, sorted(tracks), strict=True)]


def _corrected(instances: Any) -> set[int]:
    """Predictions that a person corrected: SLEAP keeps each beside the instance made from it."""
    if "from_predicted" not in instances.dtype.names:
        return set()
    return set(instances["from_predicted"].tolist())


class _Plain(pickle.Unpickler):
    """Reads lists, tuples, texts and numbers; whatever would run code is refused."""

    def find_class(self, module: str, name: str) -> Any:
        raise pickle.UnpicklingError(f"{module}.{name} where names of columns should be")


def _plain(pickled: Any) -> Any:
    data = pickled.encode("latin-1") if isinstance(pickled, str) else bytes(pickled)
    return _Plain(io.BytesIO(data)).load()


def _pandas_table(path: Path, group: Any, names: Sequence[str]) -> list[Track]:
    """A pandas table: in format `table` with pickled names of columns, or in format `fixed`."""
    try:
        if "table" in group:
            table = group["table"]
            _require_room(path, table)
            blocks = [name for name in table.dtype.names if name.startswith("values_block_")]
            index, values = table["index"], np.hstack([table[name] for name in blocks])
            kinds = [table.attrs[f"{name}_kind"] for name in blocks]
            columns = [key for kind in kinds for key in _plain(kind)]
        else:
            _require_room(path, group["block0_values"])
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
    animals = [animal for animal, _, _ in by_name]
    return from_columns(path, np.asarray(index, np.float64), by_name, names, animals)


def _trex(path: Path, names: Sequence[str]) -> list[Track]:
    """Points poseX0, poseY0 and so on, of one individual; what is missing is infinite."""
    data = read_limited(path, LARGEST)
    if not data.startswith(b"PK"):
        raise BadInputError(f"{path}: expected {_TREX}, found {'none' if data else 'nothing'}")
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as file:
            arrays = _arrays(path, file, names)
    except BadInputError:
        raise
    except _DAMAGES as error:
        what = "objects of Python" if "pickle" in str(error) else f"a damaged one: {error}"
        raise BadInputError(f"{path}: expected {_TREX}, found {what}") from None
    frames = numbered(path, arrays["frame"])
    lost = arrays["missing"] > 0 if "missing" in arrays else np.zeros(len(frames), bool)
    points = {}
    for name in names:
        values = np.stack([arrays[f"pose{axis}{name}"] for axis in "XY"], axis=1)
        values[~np.isfinite(values).all(axis=1) | lost] = np.nan
        points[name] = values
    rate = float(arrays["frame_rate"][0]) if len(arrays.get("frame_rate", ())) else None
    return [Track(str(path), "", frames, rate, points, {})]


def _arrays(path: Path, file: Any, names: Sequence[str]) -> dict[str, Floats]:
    """Arrays of an npz file of TRex. Names, then lengths, are judged before one is unpacked."""
    known = sorted(key.removeprefix("poseX") for key in file.files if key.startswith("poseX"))
    if not known:
        others = shortened(", ".join(file.files) or "no array")
        raise BadInputError(f"{path}: expected {_TREX}, found {others}")
    require_points(path, names, known)
    needed = ["frame", *(f"pose{axis}{name}" for name in names for axis in "XY")]
    for key in needed:
        if key not in file.files:
            raise BadInputError(f"{path}: expected an array {key}, found none")
    wanted = [*needed, *(key for key in ("missing", "frame_rate") if key in file.files)]
    lengths, total = _lengths(file.zip, wanted)
    require_room_for(path, total)
    for key in wanted:
        least, most = (0, 1) if key == "frame_rate" else (lengths["frame"], lengths["frame"])
        if not least <= lengths[key] <= most:
            raise BadInputError(f"{path}: expected {most} values of {key}, found {lengths[key]}")
    return {key: np.asarray(file[key], np.float64).reshape(-1) for key in wanted}


def _lengths(packed: zipfile.ZipFile, keys: Collection[str]) -> tuple[dict[str, int], int]:
    """How many numbers some arrays of an npz file have, and what all take [byte], by their headers.

    Numbers count as 8 bytes at least, as they become floats.
    """
    lengths, total = dict[str, int](), 0
    for entry in packed.infolist():
        if (key := entry.filename.removesuffix(".npy")) not in keys:
            continue
        with packed.open(entry) as file:
            begin = io.BytesIO(file.read(_LONGEST_HEADER))
        old = np.lib.format.read_magic(begin) == (1, 0)
        read_header = getattr(np.lib.format, f"read_array_header_{1 if old else 2}_0")
        shape, _, kind = read_header(begin)
        if kind.hasobject:
            raise ValueError(f"{key} is pickled")
        if kind.kind not in "biuf" or min(shape, default=0) < 0:
            raise ValueError(f"{key} is no array of numbers")
        if key in lengths:
            raise ValueError(f"{key} is there twice")
        lengths[key] = math.prod(shape)
        total += lengths[key] * max(8, kind.itemsize)
    return lengths, total
