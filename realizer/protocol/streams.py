"""The table of streams: names, encodings, options of `subscribe`, and contents of binary messages.

The message models, the binary format, the documentation and the constants of realizer.js are derived from it.
A new stream of numbers needs a row here and a source in `realizer.server.streams.frame_windows`;
docs/adding.md lists what another stream needs.
"""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Stream:
    """A row of the table.

    Attributes:
        dtype: NumPy's name of the numbers in a binary message; None if the payload is not numeric.
    """

    name: str
    encodings: tuple[str, ...]  # the default first
    options: tuple[str, ...]  # the fields of `subscribe` that apply to it, beside `encoding`
    kind: int | None = None  # the first byte of its binary messages; None if it has none
    dtype: str | None = None
    width: int = 1  # how many numbers belong together, such as the three coordinates of a vertex
    payload: str = ""
    flushes: bool = False  # whether a binary message can have the flag FLUSH

    @property
    def numeric(self) -> bool:
        """Whether a frame is a row of numbers, each with a name."""
        return self.dtype is not None and "json" in self.encodings


_ROWS = (
    Stream("feedback", ("text",), ("character", "elements")),
    Stream(
        "fap", ("binary", "json"), ("fps", "character", "ahead"),
        kind=1, dtype="<i4", flushes=True, payload="68 int32 in FAPU, column = FAP - 1",
    ),
    Stream(
        "au", ("binary", "json"), ("fps", "character", "ahead", "asked"),
        kind=2, dtype="<f4", flushes=True, payload="float32, 0..1, in the order of `names` in `subscribed`",
    ),
    Stream(
        "arkit", ("binary", "json"), ("fps", "character", "ahead"),
        kind=6, dtype="<f4", flushes=True,
        payload="59 float32: ARKit's 52 weights, 0..1, then rotations of head and eyes in radians",
    ),
    Stream(
        "mesh", ("binary",), ("fps", "character"),
        kind=5, dtype="<i2", width=3,
        payload="three int16 per vertex; metres = int16 x `scale` + `offset` of `subscribed`",
    ),
    Stream(
        "audio", ("binary",), ("character", "rate"),
        kind=4, dtype="<i2", flushes=True,
        payload="20 ms of mono int16 PCM, at most 100 ms ahead; none in silence",
    ),
    Stream(
        "video", ("binary",),
        ("fps", "character", "size", "camera", "light", "background", "format", "view", "quality"),
        kind=3, payload="a JPEG, PNG or WebP file",
    ),
    Stream("schedule", ("json",), ("character",)),
)  # fmt: skip
STREAMS: Mapping[str, Stream] = {row.name: row for row in _ROWS}
# Streams with frames that are JSON messages; `type` is the name of the stream.
JSON_STREAMS = tuple(row.name for row in _ROWS if "json" in row.encodings)
# First byte of a binary message -> its stream.
KINDS: Mapping[int, Stream] = dict(sorted((row.kind, row) for row in _ROWS if row.kind))
