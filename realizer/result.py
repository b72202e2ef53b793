"""The result of `realizer.realize`: a realization that can be saved, drawn, and shown in a notebook."""

import errno
import os
from base64 import b64encode
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from html import escape
from pathlib import Path
from typing import Self

from realizer import realization
from realizer.core.array_types import UInt8
from realizer.core.errors import RealizerError

NOTEBOOK = 320, 320  # pixels of pictures


@dataclass(frozen=True, eq=False, repr=False)
class Realization(realization.Realization):
    """Documents, played from 0 to their end. `realizer.realization.Realization` lists the attributes."""

    @classmethod
    def of(cls, played: realization.Realization) -> Self:
        """Return the same realization, with the methods of this class."""
        return cls(**{f.name: getattr(played, f.name) for f in fields(played)})

    def save(
        self,
        path: Path | str,
        *,
        camera: str = "front",
        light: str | None = None,
        size: tuple[int, int] = (512, 512),
        background: str | None = None,
        at: float | None = None,
        morphs: str = "fap",
        visemes: bool = False,
        avatar: Path | str | None = None,
    ) -> Path:
        """Write a file in the format of its suffix, of which `realizer outputs` has a list.

        Args:
            camera: front, three-quarter, profile, close, or one of the face's own.
            light: portrait, daylight, evening, studio or outdoors.
            size: width and height of pictures.
            background: a colour such as "#d8dde2", a picture's file, or with `at` "transparent".
            at: for .png: the picture of this instant, in seconds, instead of a contact sheet.
            morphs: for .glb: "fap" or "arkit".
            visemes: for .fap: whether to write FAP 1 too.
            avatar: for .glb: a .glb or .vrm file to animate instead of the face; it has ARKit's shapes.

        Returns:
            The path.

        Raises:
            ValueError: an unknown suffix, camera, light or background, or an option that does not suit.
            RealizerError: no block plays, or something that the format needs is not installed.
            OSError: the file cannot be written.
        """
        from realizer.outputs.output import RenderSettings
        from realizer.outputs.registry import output_for

        output, path = output_for(path), Path(path)
        drawing = RenderSettings(size, camera, at, light, background, morphs, visemes, avatar)
        output.check(drawing, self)
        if not path.parent.is_dir():
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path.parent))
        if not self.has_content:
            reasons = [*self.refusals, *(warning.text for warning in self.warnings)]
            raise RealizerError(f"{path}: not written, as no block plays: {reasons[0]}")
        output.write(self, path, drawing)
        return path

    def picture(
        self,
        at: float = 0.0,
        *,
        camera: str = "front",
        light: str | None = None,
        size: tuple[int, int] = (512, 512),
        background: str | None = None,
    ) -> UInt8:
        """Return the picture of an instant, (h, w, 3) uint8; (h, w, 4) with a transparent background.

        Arguments and errors are those of `save`.
        """
        from realizer.outputs.output import RenderSettings
        from realizer.outputs.png import picture_at
        from realizer.outputs.registry import OUTPUTS

        if at is None:
            raise TypeError("at: wanted seconds, got None")
        drawing = RenderSettings(size, camera, at, light, background)
        OUTPUTS[".png"].check(drawing, self)
        return picture_at(self, drawing)

    def __repr__(self) -> str:
        blocks = ", ".join(schedule.block for schedule in self.schedules[:3])
        more = f" and {len(self.schedules) - 3} more" if len(self.schedules) > 3 else ""
        count = len(self.warnings)
        warned = f"; {count} warning{'s' * (count > 1)}" if count else ""
        warned += "; nothing is heard or moves" if self.plays_nothing else ""
        length = f"{self.duration:.2f} s, {self.frames} frames at {self.fps:g} fps"
        return f"<Realization of {blocks}{more}: {length}, face {self.face_name}{warned}>"

    def _repr_html_(self) -> str:
        """Return the contact sheet, the timeline and a player, for notebooks."""
        return "\n".join(f"<div>{part}</div>" for part in self._parts())

    def _parts(self) -> Iterator[str]:
        yield escape(repr(self))
        yield _shown(lambda: f'<img alt="contact sheet" src="{self._data(".png")}">')
        if self.blocks is not None:
            from realizer.charts.chart_data import charts_of
            from realizer.charts.picture import timeline
            from realizer.charts.svg import svg

            accepted = [active.first_schedule for active in self.blocks.all()]
            yield svg(timeline(charts_of(self.blocks, accepted)))
        yield _shown(lambda: f'<video controls src="{self._data(".mp4")}"></video>')

    def _data(self, suffix: str) -> str:
        from realizer.outputs.output import RenderSettings
        from realizer.outputs.registry import OUTPUTS

        output = OUTPUTS[suffix]
        content = output.encode(self, RenderSettings(size=NOTEBOOK))
        return f"data:{output.media_type};base64,{b64encode(content).decode()}"


def _shown(part: Callable[[], str]) -> str:
    try:
        return part()
    except RealizerError as error:
        return escape(str(error))
