"""A writer of GLB files from a glTF 2.0 document and arrays, their division into both, and quaternions."""

import json
import struct
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from realizer.core.array_types import Float32
from realizer.core.json_reader import parse_json

COMPONENTS = {"u1": 5121, "u2": 5123, "u4": 5125, "f4": 5126}
KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
MAGIC, JSON_CHUNK, BINARY_CHUNK = 0x46546C67, 0x4E4F534A, 0x004E4942


class GlbFile:
    """A GLB file to which arrays are added as accessors.

    Args:
        document, data: the file to add to; see `read_glb`.
    """

    def __init__(self, document: Mapping[str, Any] = MappingProxyType({}), data: bytes = b"") -> None:
        self._views: list[dict[str, Any]] = [*document.get("bufferViews", ())]
        self._accessors: list[dict[str, Any]] = [*document.get("accessors", ())]
        self._data = bytearray(data + b"\0" * (-len(data) % 4))

    def add(
        self, array: Any, *, target: int | None = None, normalised: bool = False, bounds: bool = False
    ) -> int:
        """Add the rows of an array (uint8, uint16, uint32 or float32); return the accessor's number.

        Args:
            target: ARRAY_BUFFER of vertices, ELEMENT_ARRAY_BUFFER of triangles, None of anything else.
            normalised: whether integers stand for 0..1.
            bounds: whether to store minimum and maximum, which glTF requires for positions and times.
        """
        raw = _little(array)
        accessor = {"bufferView": self._view(raw, target), **_shape(raw)}
        if normalised:
            accessor["normalized"] = True
        return self._accessor(accessor, raw, bounds)

    def add_colours(self, colours: Float32) -> int:
        """Add opaque colours of vertices, (n, 3) linear light 0..1."""
        out = np.full((len(colours), 4), 65535, np.uint16)
        out[:, :3] = np.rint(colours * 65535)
        return self.add(out, target=ARRAY_BUFFER, normalised=True)

    def add_sparse(self, array: Any, *, bounds: bool = False) -> int:
        """Add an array of mostly zero rows; only the other rows are stored."""
        raw = _little(array)
        rows = np.flatnonzero(raw.reshape(len(raw), -1).any(axis=1))
        accessor = _shape(raw)
        if len(rows):
            index = _little(rows.astype(np.uint16 if len(raw) <= 65536 else np.uint32))
            accessor["sparse"] = {
                "count": len(rows),
                "indices": {
                    "bufferView": self._view(index, None),
                    "componentType": _shape(index)["componentType"],
                },
                "values": {"bufferView": self._view(raw[rows], None)},
            }
        return self._accessor(accessor, raw, bounds)

    def add_bytes(self, raw: bytes) -> int:
        """Add the bytes of a picture; return the buffer view's number."""
        return self._view(np.frombuffer(raw, np.uint8), None)

    def animation(self, name: str, clock: int, keys: Iterable[tuple[int, str, Any]]) -> dict[str, Any]:
        """Return an animation of nodes, linear between its keys.

        Args:
            clock: number of the accessor with the times of the keys.
            keys: (node, "translation", "rotation" or "weights", a value for each time); as float32.
        """
        channels: list[dict[str, Any]] = []
        samplers: list[dict[str, Any]] = []
        for node, path, values in keys:
            channels.append({"sampler": len(samplers), "target": {"node": node, "path": path}})
            samplers.append({"input": clock, "output": self.add(values.astype(np.float32))})
        return {"name": name, "channels": channels, "samplers": samplers}

    def bytes_of(self, document: dict[str, Any]) -> bytes:
        """Return the file: the document with these accessors, and their data."""
        whole = {
            **document,
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": len(self._data)}, *document.get("buffers", ())[1:]],
        }
        text = json.dumps(whole, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<II", len(text), JSON_CHUNK) + text
        chunks += struct.pack("<II", len(self._data), BINARY_CHUNK) + self._data
        return struct.pack("<III", MAGIC, 2, 12 + len(chunks)) + chunks

    def _view(self, raw: Any, target: int | None) -> int:
        view = {"buffer": 0, "byteOffset": len(self._data), "byteLength": raw.nbytes}
        if target is not None:
            view["target"] = target
        self._data += raw.tobytes() + b"\0" * (-raw.nbytes % 4)
        self._views.append(view)
        return len(self._views) - 1

    def _accessor(self, accessor: dict[str, Any], raw: Any, bounds: bool) -> int:
        if bounds:
            rows = raw.reshape(len(raw), -1)
            accessor["min"], accessor["max"] = rows.min(axis=0).tolist(), rows.max(axis=0).tolist()
        self._accessors.append(accessor)
        return len(self._accessors) - 1


def chunks_of(raw: bytes) -> tuple[bytes, bytes | None]:
    """Return the text of the document of a GLB file, and its binary chunk if it has one.

    Raises:
        ValueError: it is another file, one of another version, or truncated.
    """
    if raw[:4] != b"glTF":
        raise ValueError(f"wanted a GLB file, which begins with 'glTF', got {raw[:4]!r}")
    if len(raw) < 20:
        raise ValueError(f"wanted a GLB header, got {len(raw)} bytes: it is truncated")
    _, version, length = struct.unpack_from("<III", raw)
    if version != 2:
        raise ValueError(f"wanted GLB version 2, got {version}; export it as glTF 2.0")
    if length > len(raw):
        raise ValueError(f"wanted {length} bytes, as its header says, got {len(raw)}: it is truncated")
    found: dict[int, bytes] = {}
    at = 12
    while at + 8 <= length:
        size, kind = struct.unpack_from("<II", raw, at)
        chunk = raw[at + 8 : at + 8 + size]
        if len(chunk) < size:
            raise ValueError(f"wanted a chunk of {size} bytes, got {len(chunk)}: it is truncated")
        found.setdefault(kind, chunk)
        at += 8 + size
    return found.get(JSON_CHUNK, b""), found.get(BINARY_CHUNK)


def read_glb(raw: bytes) -> tuple[dict[str, Any], bytes]:
    """Return the document and the binary chunk of a GLB file of glTF 2.0 that contains its data.

    Raises:
        ValueError: it is another file, or truncated.
    """
    text, data = chunks_of(raw)
    document = parse_json(text)
    buffers = document.get("buffers") if isinstance(document, dict) else None
    if data is None or not buffers:
        raise ValueError("wanted a GLB file with meshes, got one without data")
    if "uri" in buffers[0]:
        raise ValueError("wanted a GLB file that contains its data, got one with data beside it")
    return document, data


def _little(array: Any) -> Any:
    return np.ascontiguousarray(array, np.asarray(array).dtype.newbyteorder("<"))


def _shape(raw: Any) -> dict[str, Any]:
    return {
        "componentType": COMPONENTS[f"{raw.dtype.kind}{raw.dtype.itemsize}"],
        "count": len(raw),
        "type": KINDS[raw.size // len(raw)],
    }


def quaternions(turns: Float32) -> Float32:
    """Convert pitch, yaw, roll (n, 3) to x, y, z, w (n, 4), as `face.deform` does: roll first, yaw last."""
    from scipy.spatial.transform import Rotation

    rotations = Rotation.from_euler("YXZ", turns[:, [1, 0, 2]].astype(np.float64)).as_quat()
    out: Float32 = np.where(rotations[:, 3:] < 0, -rotations, rotations).astype(np.float32)
    return out


def half_turns(turns: Float32) -> Float32:
    """Return quaternions (n, 4), w >= 0, of half the angles: neck and head turn by half each."""
    out: Float32 = turns + np.array([0, 0, 0, 1], np.float32)
    out /= np.linalg.norm(out, axis=-1, keepdims=True)
    return out
