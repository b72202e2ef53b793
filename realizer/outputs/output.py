"""The output value: suffix, media type, and the function that encodes a realization."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from realizer.core.array_types import UInt8
from realizer.core.atomic_files import write_bytes

if TYPE_CHECKING:
    from realizer.realization import Realization
    from realizer.render import Renderer


@dataclass(frozen=True)
class RenderSettings:
    """How it is drawn or written: what `realize --size --camera --at --light --background --visemes` say."""

    size: tuple[int, int] = (512, 512)  # width, height
    camera: str = "front"
    at: float | None = None  # seconds; None: the whole span
    light: str | None = None  # a preset; None: as `realizer.render.Renderer` takes it, as is
    background: str | None = None  # "#rrggbb", or of one picture "transparent"
    visemes: bool = False  # whether a .fap file has FAP 1 beside the FAPs of the lips
    renderer: Renderer | None = None  # what draws, where `Output.begin` started it

    def pictures(
        self, realization: Realization, size: tuple[int, int], frames: Sequence[int]
    ) -> Generator[UInt8, None, None]:
        """The first character in these frames, rising, with the face it has in each; drawn a batch ahead.

        Close it where not all of them are taken.
        """
        from realizer.pipeline import pictures

        faces = realization.faces
        ends = [*(first for first, _ in faces[1:]), realization.frames]
        with ExitStack() as stack:
            renderers: dict[str, Renderer] = {}
            for (first, part), end in zip(faces, ends, strict=True):
                rows = [frame - first for frame in frames if first <= frame < end]
                if not rows:
                    continue
                if part.face_name not in renderers:
                    renderers[part.face_name] = stack.enter_context(
                        self.make_renderer(realization, size, face=part.face_name)
                    )
                yield from pictures(part, renderers[part.face_name], rows)

    def make_renderer(
        self,
        realization: Realization,
        size: tuple[int, int],
        *,
        alpha: bool = False,
        face: str | None = None,
    ) -> Renderer:
        """What draws poses of a realization like that; `alpha` where the picture may be transparent.

        Args:
            face: one that it has for a time; None: its own.
        """
        own = face in (None, realization.face_name)
        if own and self.renderer is not None and self.renderer.size == size:
            return self.renderer
        return self.make_renderer_for(face or realization.face_name, realization.deformer, size, alpha=alpha)

    def make_renderer_for(
        self, face: str, deformer: str | None, size: tuple[int, int], *, alpha: bool = False
    ) -> Renderer:
        """What draws that face, moved by that deformer; nothing has started yet."""
        from realizer.render import Renderer

        return Renderer(
            face,
            size,
            self.camera,
            light=self.light,
            background=self.background,
            alpha=alpha,
            deformer=deformer,
        )


@dataclass(frozen=True)
class Output:
    """One encoding.

    Attributes:
        suffix: ".fap"; the name in `realizer outputs` is the suffix without its dot.
        media_type: such as "video/mp4".
        description: one line for `realizer outputs`.
        encode: (realization, drawing) -> the content of the file.
        needs: the extras to install; () if it always works.
        picture_size: width and height of its pictures, and whether they may be transparent; None: there are
            none.
        all_characters: whether it holds what all characters do; others hold the face of the first.
        save: (realization, path, drawing) -> None, of what may be too long to be held: writes it bit by bit.
        reader: the program of others that reads it in the tests; "" if there is none.
    """

    suffix: str
    media_type: str
    description: str
    encode: Callable[[Realization, RenderSettings], bytes]
    needs: tuple[str, ...] = ()
    picture_size: Callable[[RenderSettings], tuple[tuple[int, int], bool]] | None = None
    all_characters: bool = False
    save: Callable[[Realization, Path, RenderSettings], None] | None = None
    reader: str = ""

    def write(self, realization: Realization, path: Path, drawing: RenderSettings) -> None:
        """Write the file, whole or not at all; `path` may be any place that can be written."""
        if self.save is not None:
            self.save(realization, path, drawing)
        else:
            write_bytes(path, self.encode(realization, drawing))

    def begin(self, drawing: RenderSettings, face: str, deformer: str | None = None) -> RenderSettings:
        """The drawing to hand to `write`; what draws starts now, and gets ready while the rest is planned.

        Raises:
            RenderError: `drawing.background` is none.
        """
        if self.picture_size is None:
            return drawing
        size, alpha = self.picture_size(drawing)
        renderer = drawing.make_renderer_for(face, deformer, size, alpha=alpha)
        renderer.start()
        return replace(drawing, renderer=renderer)
