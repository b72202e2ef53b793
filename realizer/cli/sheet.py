"""`faces sheet`: draws every FAP, action unit and emotion of a face in one picture."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from realizer.cli import options

if TYPE_CHECKING:
    from collections.abc import Callable

    from realizer.animation.fap.conversion import FapMapping
    from realizer.cli.sheet_poses import Series
    from realizer.outputs.output import RenderSettings
    from realizer.render.contact_sheet import Cell

SCALE = (260, 16)  # pixels of the colour scale


@click.command()
@click.argument("name")
@click.option(
    "-o", "--output", required=True, metavar="SHEET.png", type=options.OUTPUT, help="Picture to write."
)
@click.option("--faps", is_flag=True, help="Draw every low-level FAP, in both directions.")
@click.option("--aus", is_flag=True, help="Draw every action unit.  [default: FAPs and action units]")
@click.option(
    "--emotions", is_flag=True, help="Draw the archetypes, and 17 angles of the wheel at 4 activations each."
)
@click.option(
    "--value",
    type=options.Number(1, 4320),
    default=512,
    show_default=True,
    help="Value of FAPs: 512 is half their unit distance, or 20 degrees of rotation; limited to their range.",
)
@click.option(
    "--intensity",
    type=options.Number(0, 1, min_open=True),
    default=1,
    show_default=True,
    help="Intensity of action units.",
)
@click.option(
    "--camera",
    "cameras",
    multiple=True,
    help=f"{options.CAMERAS} May be repeated to show several views.  [default: front]",
)
@options.deformer
@options.mapping
@options.light
@options.opaque_background
@click.option(
    "--size", default="220x280", show_default=True, callback=options.parse_size, help="Size of each picture."
)
def sheet(
    name: str,
    output: Path,
    faps: bool,
    aus: bool,
    emotions: bool,
    value: float,
    intensity: float,
    cameras: tuple[str, ...],
    deformer: str | None,
    mapping: Path | None,
    light: str | None,
    background: str | None,
    size: tuple[int, int],
) -> None:
    """Draw what every FAP and action unit does to a face, to check the face by eye.

    Beside each picture is the difference to the neutral face, in colours over a faint neutral face; the
    larger the difference, the paler the colour (Paul 2010, 4.4.2).

    \b
    realizer faces sheet ada -o ada.png --camera front --camera profile
    realizer faces sheet ada -o ada.png --emotions
    """
    from PIL import Image

    from realizer.cli import sheet_poses
    from realizer.face.fap_mapping import mapping_of
    from realizer.outputs.output import RenderSettings
    from realizer.render.contact_sheet import Group, album

    options.check_suffix(output, ".png")
    cameras = cameras or ("front",)
    for camera in cameras:
        options.check_camera(name, camera)
    if not (faps or aus or emotions):
        faps = aus = True
    face_mapping = mapping_of(name, options.settings(mapping=mapping).mapping)
    series = [sheet_poses.neutral()]
    if faps:
        series += sheet_poses.of_faps(value)
    if aus:
        series += sheet_poses.of_aus(intensity)
    if emotions:
        series += sheet_poses.of_emotions()
    drawing = RenderSettings(size, light=light, background=background)
    count = sum(len(part.poses) for part in series)
    with click.progressbar(
        length=count * len(cameras), label="drawing", file=sys.stderr, hidden=options.is_quiet()
    ) as bar:
        groups = [
            Group(part.heading, cells, part.columns)
            for part, cells in _cells(name, deformer, face_mapping, series, cameras, drawing, bar.update)
        ]
    title = f"{name}: {', '.join(cameras)}. Left: as drawn; right: difference to the neutral face"
    pixels = album(groups, _scale(), title)
    Image.fromarray(pixels).save(output, compress_level=4)
    options.note(f"{output}: {count} poses, {pixels.shape[1]}x{pixels.shape[0]}")


def _cells(
    name: str,
    deformer: str | None,
    mapping: FapMapping,
    series: list[Series],
    cameras: tuple[str, ...],
    drawing: RenderSettings,
    step: Callable[[int], None],
) -> Iterator[tuple[Series, list[Cell]]]:
    """Yield each series with its cells; the first pose of all is the neutral one."""
    import numpy as np

    from realizer.animation.pose import poses as poses_of
    from realizer.cli import sheet_poses
    from realizer.face.load import input_names
    from realizer.render.backdrop import backdrop
    from realizer.render.contact_sheet import Cell
    from realizer.render.difference_image import difference, faint, flatten
    from realizer.render.light import preset
    from realizer.render.renderer import Renderer

    # A plain background, so that only the face differs.
    behind = np.rint(np.array(preset(drawing.light).backdrop_middle) * 255)
    if drawing.background:
        behind = backdrop(drawing.size, preset(drawing.light), drawing.background)[..., :3]
    all_poses = [pose for part in series for pose in part.poses]
    rows = poses_of(sheet_poses.frames(series), input_names(name, deformer=deformer), mapping)
    pictures: list[list[Any]] = [[] for _ in all_poses]
    for camera in cameras:
        neutral = below = None
        with Renderer(
            name, drawing.size, camera, light=drawing.light, background="transparent", deformer=deformer
        ) as renderer:
            for k, drawn in enumerate(renderer.frames(rows)):
                picture = flatten(drawn, behind)
                if neutral is None or below is None:
                    neutral, below = picture, faint(drawn)
                pictures[k] += [picture, difference(picture, neutral, below)]
                step(1)
    remaining = iter(pictures)
    for part in series:
        yield part, [Cell(next(remaining), pose.title, pose.notes) for pose in part.poses]


def _scale() -> Any:
    """Return the scale of difference colours, (h, w, 3) uint8, with a label."""
    import numpy as np
    from PIL import Image, ImageDraw, ImageFont

    from realizer.render.contact_sheet import INK, PAPER
    from realizer.render.difference_image import MAX_DIFFERENCE, ramp

    width, height = SCALE
    image = Image.new("RGB", (width, height * 2 + 8), PAPER)
    bar = np.broadcast_to(ramp(np.linspace(0, 1, width, dtype=np.float32)), (height, width, 3))
    image.paste(Image.fromarray(np.rint(bar).astype(np.uint8)), (0, 0))
    text = f"differs by 0 .. {MAX_DIFFERENCE:.0%} of white or more"
    ImageDraw.Draw(image).text((0, height + 4), text, INK, ImageFont.load_default(14))
    return np.asarray(image)
