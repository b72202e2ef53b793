"""The type of outputs: suffix, media type, and the function that encodes a realization."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from numbers import Integral, Real
from pathlib import Path
from typing import TYPE_CHECKING, Any

from realizer.core.array_types import UInt8
from realizer.core.atomic_files import write_bytes
from realizer.core.errors import PluginError, RealizerError

# A package with a behaviour and an output is imported while the modules of a realization are.
if TYPE_CHECKING:
    from realizer.face.model import Face
    from realizer.realization import Realization
    from realizer.render.renderer import Renderer

MORPHS = ("fap", "arkit")
# Setting -> the only suffix that it is for, and the reason.
ONLY_FOR = {
    "at": (".png", "for the picture of an instant"),
    "morphs": (".glb", "to write morph targets into"),
    "avatar": (".glb", "to write the avatar into"),
    "visemes": (".fap", "to write FAP 1 into"),
}


@dataclass(frozen=True)
class RenderSettings:
    """Settings of an output: options of `realize` from --size to --visemes."""

    size: tuple[int, int] = (512, 512)  # width, height
    camera: str = "front"
    at: float | None = None  # seconds of a single picture; None: the whole span
    light: str | None = None  # a preset; None: the default of `realizer.render.Renderer`
    background: str | None = None  # "#rrggbb", a picture's path, or for a single picture "transparent"
    morphs: str = "fap"  # names of a .glb file's morph targets: "fap" or "arkit"
    visemes: bool = False  # whether a .fap file has FAP 1 in addition to the FAPs of the lips
    avatar: str | Path | None = None  # a .glb or .vrm file to animate in a .glb file, instead of the face
    renderer: Renderer | None = None  # started by `Output.begin`
    # Called with the number of pictures that are drawn, and of all.
    drawn: Callable[[int, int], None] | None = field(default=None, compare=False)

    def check_types(self) -> None:
        """Raise TypeError for a value of another type, and ValueError for an impossible size."""
        for name, (types, wanted) in _TYPES.items():
            if not isinstance(value := getattr(self, name), types) or (name == "at" and value is True):
                raise TypeError(f"{name}: wanted {wanted}, got {value!r}")
        if len(self.size) != 2 or not all(isinstance(n, Integral) and 16 <= n <= 4096 for n in self.size):
            raise ValueError(f"size: wanted (width, height), each 16..4096 pixels, got {self.size!r}")

    def check_look(self, face: Face) -> None:
        """Raise UnknownLookError unless there are such a camera of a face, a light and a background."""
        from realizer.render.backdrop import background_of
        from realizer.render.cameras import camera_for
        from realizer.render.light import preset

        camera_for(face, self.camera)
        preset(self.light)
        background_of(self.background)

    def pictures(
        self, realization: Realization, size: tuple[int, int], frames: Sequence[int]
    ) -> Generator[UInt8, None, None]:
        """Yield pictures of the first character in these frames, rising, drawn a batch ahead.

        Close the generator unless it is exhausted.
        """
        from realizer.pipeline import pictures

        faces = realization.faces
        ends = [*(first for first, _ in faces[1:]), realization.frames]
        with ExitStack() as stack:
            renderers: dict[str, Renderer] = {}
            done = 0
            for (first, part), end in zip(faces, ends, strict=True):
                rows = [frame - first for frame in frames if first <= frame < end]
                if not rows:
                    continue
                if part.face_name not in renderers:
                    renderers[part.face_name] = stack.enter_context(
                        self.make_renderer(realization, size, part.face_name)
                    )
                for picture in pictures(part, renderers[part.face_name], rows):
                    yield picture
                    done += 1
                    if self.drawn is not None:
                        self.drawn(done, len(frames))

    def make_renderer(
        self, realization: Realization, size: tuple[int, int], face: str, *, alpha: bool = False
    ) -> Renderer:
        """Return a renderer for one of a realization's faces; `alpha` if pictures may be transparent."""
        if face == realization.face_name and self.renderer is not None and self.renderer.size == size:
            return self.renderer
        return self.make_renderer_for(face, realization.deformer, size, alpha=alpha)

    def make_renderer_for(
        self, face: str, deformer: str | None, size: tuple[int, int], *, alpha: bool = False
    ) -> Renderer:
        """Return a renderer for a face and a deformer, not yet started."""
        from realizer.render.renderer import Renderer

        return Renderer(
            face,
            size,
            self.camera,
            light=self.light,
            background=self.background,
            alpha=alpha,
            deformer=deformer,
        )


_WORD = ((str, type(None)), "a string")
_TYPES: Mapping[str, tuple[type | tuple[type, ...], str]] = {
    "size": ((tuple, list), "(width, height)"),
    "camera": (str, "the name of a camera"),
    "at": ((Real, type(None)), "seconds"),
    "light": _WORD,
    "background": _WORD,
    "morphs": (str, " or ".join(MORPHS)),
    "avatar": ((str, Path, type(None)), "a path"),
    "visemes": (bool, "True or False"),
}


@dataclass(frozen=True)
class Output:
    """A file format into which realizations are encoded.

    Attributes:
        suffix: such as ".fap"; the name in `realizer outputs` is the suffix without its dot.
        media_type: such as "video/mp4".
        description: one line for `realizer outputs`.
        encode: returns the content of the file for a realization and settings.
        needs: the extras to install; () if none.
        picture_size: returns width and height of its pictures, and whether they may be transparent; None if
            it has no pictures.
        all_characters: whether it contains all characters; otherwise only the first.
        save: writes a file piece by piece, if it may be too long for memory.
    """

    suffix: str
    media_type: str
    description: str
    encode: Callable[[Realization, RenderSettings], bytes]
    needs: tuple[str, ...] = ()
    picture_size: Callable[[RenderSettings], tuple[tuple[int, int], bool]] | None = None
    all_characters: bool = False
    save: Callable[[Realization, Path, RenderSettings], None] | None = None

    def check(self, drawing: RenderSettings, realization: Realization | None = None) -> None:
        """Check that settings suit this format.

        Args:
            realization: what will be written; its face may have cameras, and its duration limits `at`.

        Raises:
            TypeError: a setting has a value of another type.
            ValueError: a setting is for another format, or there is no such camera, light or instant.
        """
        drawing.check_types()
        usual, single = RenderSettings(), self.suffix == ".png" and drawing.at is not None
        for name, (suffix, reason) in ONLY_FOR.items():
            if getattr(drawing, name) != getattr(usual, name) and self.suffix != suffix:
                raise ValueError(f"{name}: wanted a {suffix} file {reason}, got {self.suffix}")
        if drawing.morphs not in MORPHS:
            raise ValueError(f"morphs: wanted {' or '.join(MORPHS)}, got {drawing.morphs!r}")
        if drawing.avatar is not None and realization is None:
            from realizer.outputs.avatar import read_avatar

            read_avatar(drawing.avatar)
        if drawing.background == "transparent" and not single:
            raise ValueError(
                "background: wanted a colour such as #d8dde2: only the picture of one instant, a .png with a "
                "time, can be transparent"
            )
        if realization is None:
            return
        if drawing.at is not None and not 0 <= drawing.at <= realization.duration + 1e-9:
            raise ValueError(f"at: wanted 0..{realization.duration:.2f} s, got {drawing.at:g}")
        if self.picture_size is not None:
            drawing.check_look(realization.face)

    def write(self, realization: Realization, path: Path, drawing: RenderSettings) -> None:
        """Write the file completely or not at all; `path` may be a device or a pipe.

        Raises:
            PluginError: this is the output of a plug-in, and has failed.
        """
        try:
            if self.save is not None:
                self.save(realization, path, drawing)
            else:
                write_bytes(path, self.encode(realization, drawing))
        except (OSError, RealizerError):
            raise
        except Exception as error:
            if self.encode.__module__.startswith("realizer."):
                raise
            words = f"the output {self.suffix} of a plug-in failed: {type(error).__name__}: {error}"
            raise PluginError(words) from error

    def begin(self, drawing: RenderSettings, face: str, deformer: str | None = None) -> RenderSettings:
        """Return the settings for `write` with a renderer that starts now, during planning.

        Raises:
            RenderError: if `drawing.background` is neither a colour nor a file.
        """
        if self.picture_size is None:
            return drawing
        size, alpha = self.picture_size(drawing)
        renderer = drawing.make_renderer_for(face, deformer, size, alpha=alpha)
        renderer.start()
        return replace(drawing, renderer=renderer)


def text_output(
    suffix: str, media_type: str, description: str, encode: Callable[[Realization], str], **attributes: Any
) -> Output:
    """Return the output of a text, which needs no settings; further attributes as of `Output`."""
    return Output(suffix, media_type, description, lambda made, _: encode(made).encode(), **attributes)
