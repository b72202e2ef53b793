"""Options for playing documents, shared by `realize`, the commands, the service and batches."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from numbers import Integral, Real
from pathlib import Path


@dataclass(frozen=True, kw_only=True)
class PlayOptions:
    """Options for playing documents.

    Attributes:
        face: name of the face, or the path of a face folder or of a GLB head.
        deformer: "mpeg4" moves the face by FAPs, "au" by its action unit model; None: the face's own choice.
        fps: frames per second.
        scene: target name -> (x, y, z) in metres, origin between the eyes; None: no scene declared.
        seed: of all random motion; the same seed gives the same frames.
        idle: whether the face blinks and its head moves slightly.
        liveliness: 0..1: how much an idle face breathes, changes its posture and moves single muscles, and
            how much its blinks vary; needs `idle`.
        language: BCP-47 tag of speech without xml:lang.
        media: folder of the files that documents may refer to; None: they may not.
        expressions: folder of a user's expressions, which override built-in ones.
        cooccurrence: rules for AUs that no face shows together: "on" (built in), "off", or a file.
        jaw, lips: how far the jaw and the lips move in speech that does not say: 0 mumbles, 1 is usual, 2
            over-articulates.
        prosody: whether nods, brows, blinks and glances accompany speech; needs `idle`.
        mapping: file that maps AUs to FAPs and overrides the face's mapping.
        grace: seconds by which a behaviour may come too late for its references into other blocks.
        max_planning: steps of planning one block; about a million take a second.
        strict_bml: whether documents are read as BML 1.0 only, without dialects.

    Raises:
        TypeError: an option has a value of another type.
        ValueError: `fps` is not a number above 0, or another value is none of those that are possible.
    """

    face: str = "default"
    deformer: str | None = None
    fps: float = 25.0
    scene: Mapping[str, tuple[float, float, float]] | None = None
    seed: int = 0
    idle: bool = True
    liveliness: float = 1.0
    language: str = "en-US"
    media: Path | None = None
    expressions: Path | None = None
    cooccurrence: str = "on"
    prosody: bool = True
    jaw: float = 1.0
    lips: float = 1.0
    mapping: Path | None = None
    grace: float = 0.5
    max_planning: int = 2_500_000
    strict_bml: bool = False

    def __post_init__(self) -> None:
        for name, (types, wanted) in _TYPES.items():
            value = getattr(self, name)
            if not isinstance(value, types) or (isinstance(value, bool) and types is not bool):
                raise TypeError(f"{name}: wanted {wanted}, got {value!r}")
            if isinstance(value, Real) and types is not bool:  # those of numpy overflow, and are not JSON
                object.__setattr__(self, name, int(value) if isinstance(value, Integral) else float(value))
        if not (math.isfinite(self.fps) and self.fps > 0):
            raise ValueError(f"fps: wanted a number above 0, got {self.fps}")
        for name, most in (("liveliness", 1), ("jaw", 2), ("lips", 2)):
            if not 0.0 <= (value := getattr(self, name)) <= most:
                raise ValueError(f"{name}: wanted a number 0..{most}, got {value}")
        for name, least in (("grace", 0), ("max_planning", 1)):
            if not least <= (value := getattr(self, name)) < math.inf:
                raise ValueError(f"{name}: wanted a number of at least {least}, got {value}")
        if self.deformer not in (None, "mpeg4", "au"):
            raise ValueError(f"deformer: wanted mpeg4 or au, got {self.deformer!r}")
        for name, place in (self.scene or {}).items():
            numbers = list(place) if isinstance(place, Iterable) else []
            if len(numbers) != 3 or not all(isinstance(x, Real) and math.isfinite(x) for x in numbers):
                raise ValueError(f"scene: wanted x, y, z of {name} in metres, got {place!r}")


_NUMBER, _STEPS, _FLAG = (Real, "a number"), (Integral, "an integer"), (bool, "True or False")
_FILE = ((str, Path, type(None)), "a path")
# Option -> its types, and their description.
_TYPES: Mapping[str, tuple[type | tuple[type, ...], str]] = {
    "face": (str, "the name or the path of a face"),
    "deformer": ((str, type(None)), "mpeg4 or au"),
    "scene": ((Mapping, type(None)), "a mapping of names to (x, y, z)"),
    "language": (str, "a BCP-47 tag"),
    "cooccurrence": (str, "on, off, or the path of a file"),
    **dict.fromkeys(("fps", "liveliness", "jaw", "lips", "grace"), _NUMBER),
    **dict.fromkeys(("seed", "max_planning"), _STEPS),
    **dict.fromkeys(("idle", "prosody", "strict_bml"), _FLAG),
    **dict.fromkeys(("media", "expressions", "mapping"), _FILE),
}
DEFAULTS = PlayOptions()
