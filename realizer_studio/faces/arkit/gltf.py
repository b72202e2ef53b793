"""A reader of GLB and glTF 2.0 files.

No library is used: trimesh ignores morph targets, and pygltflib returns raw bytes without the sparse,
normalised and strided accessors that heads need.
"""

import base64
import binascii
import io
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from PIL import Image, UnidentifiedImageError

from realizer.core.array_types import Float64
from realizer.core.errors import FaceError
from realizer.core.json_reader import parse_json
from realizer.face.glb_file import chunks_of
from realizer_studio.faces.arkit.gltf_schema import document_fault
from realizer_studio.faces.arkit.meshopt import EXTENSIONS, unpack

KINDS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
MAX_NUMBERS = 2**26  # in all accessors together: a head of 24,000 vertices with 900 shapes
MAX_PIXELS = 8192 * 8192  # of a texture
PICTURES = 4  # kept in memory
UNPACK_KTX = "npx @gltf-transform/cli ktxdecompress HEAD.glb PLAIN.glb"
MAX_BYTES = 2**29  # of an unpacked buffer view
# Supported required extensions that are not by Khronos; those by Khronos change the look of surfaces.
UNDERSTOOD = {"EXT_meshopt_compression", "EXT_texture_webp", "EXT_texture_avif"}


class Gltf:
    """A glTF 2.0 file.

    Attributes:
        path: the file that was read.
        json: the document.
        notes: pictures that could not be read.
    """

    def __init__(self, path: Path) -> None:
        """Read a .glb, or a .gltf with the files beside it.

        Raises:
            FaceError: no such file, a truncated or other file, another version, or packed geometry.
        """
        self.path = path
        try:
            raw = path.read_bytes()
        except OSError as error:
            raise FaceError(f"{path}: wanted a GLB head, got {error.strerror}") from None
        self._binary: bytes | None = None
        text = self._chunks(raw) if raw[:4] == b"glTF" else raw
        try:
            self.json: dict[str, Any] = parse_json(text)
        except ValueError:
            raise FaceError(
                f"{path}: wanted a GLB file (binary glTF 2.0) or a .gltf, got neither; export the head again"
            ) from None
        if fault := document_fault(self.json):
            raise FaceError(f"{path}: {fault}; export the head again")
        version = str(self.json["asset"].get("version", ""))
        if not version.startswith("2."):
            raise FaceError(f"{path}: wanted glTF 2.0, got version {version!r}; export the head as glTF 2.0")
        for name in self.json.get("extensionsRequired", []):
            if name.startswith("EXT_") and name not in UNDERSTOOD:
                raise FaceError(f"{path}: it requires {name}, which is not understood; export it without")
        self.notes: tuple[str, ...] = ()
        self._buffers: dict[int, bytes] = {}
        self._unpacked: dict[int, bytes] = {}  # buffer views
        self._values: dict[int, Any] = {}  # accessors
        self._pictures: dict[int, Any] = {}
        self._room = MAX_NUMBERS

    def _chunks(self, raw: bytes) -> bytes:
        try:
            text, self._binary = chunks_of(raw)
        except ValueError as error:
            raise FaceError(f"{self.path}: {error}; copy or export it again") from None
        return text

    def list(self, name: str) -> list[dict[str, Any]]:
        """Return one of the document's lists, such as "meshes", or an empty list."""
        found: list[dict[str, Any]] = self.json.get(name, [])
        return found

    def item(self, name: str, index: int) -> dict[str, Any]:
        """Return one of the document's objects by its index.

        Raises:
            FaceError: there is no such object.
        """
        items = self.list(name)
        if not 0 <= index < len(items):
            expected = f"an index 0..{len(items) - 1}" if items else "none, as there are none"
            raise FaceError(f"{self.path}: {name}: wanted {expected}, got {index!r}; export the head again")
        return items[index]

    def put(self, index: int, values: Any) -> None:
        """Replace the values (count, width) of an accessor.

        Raises:
            FaceError: there is no such accessor, or it has another shape.
        """
        accessor = self.item("accessors", index)
        shape = (accessor["count"], WIDTHS[accessor["type"]])
        if np.shape(values) != shape:
            raise FaceError(f"{self.path}: accessors[{index}]: wanted {shape}, got {np.shape(values)}")
        self._values[index] = values

    def accessor(self, index: int) -> Float64:
        """Return an accessor's values, (count, width) float64; normalised ones as -1..1 or 0..1.

        Raises:
            FaceError: the accessor, its view or its bytes are missing.
        """
        accessor = self.item("accessors", index)
        where = f"accessors[{index}]"
        kind, width, count = accessor["componentType"], WIDTHS[accessor["type"]], accessor["count"]
        self._room -= count * width
        if self._room < 0:  # zeros need no bytes in the file
            raise FaceError(
                f"{self.path}: {where}: wanted at most {MAX_NUMBERS} numbers in the file, got more: "
                f"{count} x {width} here; export the head with fewer vertices or shapes"
            )
        start = accessor.get("byteOffset", 0)
        values = self._values.get(index)
        if values is None:
            values = self._strided(accessor.get("bufferView"), start, KINDS[kind], count, width, where)
        sparse = accessor.get("sparse")
        if sparse is not None:

            def stored(part: dict[str, Any], kind: str, width: int) -> Any:
                start = part.get("byteOffset", 0)
                return self._strided(part["bufferView"], start, kind, sparse["count"], width, where)

            targets = sparse["indices"]
            rows = stored(targets, KINDS[targets["componentType"]], 1).ravel()
            if len(rows) and rows.max() >= count:
                raise FaceError(f"{self.path}: {where}: sparse: wanted rows 0..{count - 1}, got {rows.max()}")
            values[rows] = stored(sparse["values"], KINDS[kind], width)
        with np.errstate(invalid="ignore"):  # NaN
            out = values.astype(np.float64)
        if accessor.get("normalized") and kind != 5126:
            out = np.maximum(out / np.iinfo(KINDS[kind]).max, -1.0)
        return np.asarray(out)

    def _strided(self, view: Any, start: int, kind: str, count: int, width: int, where: str) -> Any:
        """Return (count, width) values of a buffer view as a copy, or zeros if there is no view."""
        dtype = np.dtype(kind)
        if view is None:
            return np.zeros((count, width), dtype)
        layout = self.item("bufferViews", view)
        raw = self.view(view)
        step = layout.get("byteStride") or dtype.itemsize * width
        need = start + step * (count - 1) + dtype.itemsize * width if count else 0
        if need > len(raw):
            raise FaceError(
                f"{self.path}: {where}: wanted {need} bytes, its view has {len(raw)}; the file is truncated "
                "or broken: export it again"
            )
        if not count:
            return np.zeros((0, width), dtype)
        found = np.ndarray((count, width), dtype, raw, start, (step, dtype.itemsize))
        return found.copy()

    def view(self, index: Any) -> bytes:
        """Return the bytes of a buffer view, unpacked.

        Raises:
            FaceError: it or its buffer is not there, truncated, or packed wrongly.
        """
        layout = self.item("bufferViews", index)
        packed = layout.get("extensions", {})
        if not (name := next((name for name in EXTENSIONS if packed.get(name)), None)):
            return self._stored(layout, index)
        if index not in self._unpacked:
            how = packed[name]
            count, stride, mode = how["count"], how["byteStride"], how["mode"]
            try:
                if not 0 < count * stride <= MAX_BYTES:
                    raise ValueError(f"{count} x {stride} bytes")
                self._unpacked[index] = unpack(
                    self._stored(how, index), mode, how.get("filter", "NONE"), count, stride
                )
            except ValueError as error:
                where = f"{self.path}: bufferViews[{index}]: {name}"
                raise FaceError(f"{where}: {error}; export the head again") from None
        return self._unpacked[index]

    def _stored(self, view: dict[str, Any], index: Any) -> bytes:
        raw = self._buffer(view.get("buffer", 0))
        start, size = view.get("byteOffset", 0), view.get("byteLength", 0)
        if start + size > len(raw):
            raise FaceError(
                f"{self.path}: bufferViews[{index}]: wanted {start + size} bytes, its buffer has {len(raw)}; "
                "the file is truncated: copy or export it again"
            )
        return raw[start : start + size]

    def _buffer(self, index: int) -> bytes:
        if index not in self._buffers:
            uri = self.item("buffers", index).get("uri")
            if uri is None:
                if self._binary is None:
                    raise FaceError(f"{self.path}: buffers[{index}]: wanted a binary chunk, got none")
                self._buffers[index] = self._binary
            else:
                self._buffers[index] = self._fetch(uri)
        return self._buffers[index]

    def _fetch(self, uri: str) -> bytes:
        """Return the bytes behind a URI: data, or a file beside this one; never the network."""
        if uri.startswith("data:"):
            try:
                return base64.b64decode(uri.partition(",")[2], validate=False)
            except binascii.Error:
                raise FaceError(
                    f"{self.path}: wanted base64 in a data URI, got something else; export the head again"
                ) from None
        name = Path(unquote(uri))
        if "://" in uri or name.is_absolute() or ".." in name.parts:
            raise FaceError(f"{self.path}: {uri}: wanted a file beside this one; export the head as one GLB")
        try:
            return (self.path.parent / name).read_bytes()
        except (OSError, ValueError) as error:
            raise FaceError(
                f"{self.path.parent / name}: {getattr(error, 'strerror', error)}; put it beside "
                f"{self.path.name}, or export the head as one GLB"
            ) from None

    def pixels(self, image: int) -> Any:
        """Return (height, width, 4) uint8 sRGB of an image; None, and a note, if it cannot be decoded.

        Raises:
            FaceError: the image is missing, too large, or of a format that has to be converted first.
        """
        if image not in self._pictures:
            while len(self._pictures) >= PICTURES:
                del self._pictures[next(iter(self._pictures))]
            self._pictures[image] = self._decoded(image)
        return self._pictures[image]

    def _decoded(self, image: int) -> Any:
        found = self.item("images", image)
        name = f"images[{image}] {found.get('name') or found.get('uri', '')[:40]}".rstrip()
        if "bufferView" not in found and not found.get("uri"):
            raise FaceError(
                f"{self.path}: {name}: wanted a uri or a bufferView, got neither; export it again"
            )
        raw = self.view(found["bufferView"]) if "bufferView" in found else self._fetch(found["uri"])
        if raw[1:4] == b"KTX":
            raise FaceError(f"{self.path}: {name}: KTX2 textures are not read; undo them: {UNPACK_KTX}")
        try:
            with Image.open(io.BytesIO(raw)) as picture:
                if picture.width * picture.height <= MAX_PIXELS:
                    return np.asarray(picture.convert("RGBA"))
                size = f"{picture.width} x {picture.height}"
        except Image.DecompressionBombError:
            size = "more"
        except (UnidentifiedImageError, OSError, SyntaxError, ValueError):  # of the decoders
            note = f"{name}: no picture that can be decoded; drawn without it"
            self.notes = (*dict.fromkeys((*self.notes, note)),)
            return None
        raise FaceError(f"{self.path}: {name}: wanted at most 8192 x 8192 pixels, got {size}")
