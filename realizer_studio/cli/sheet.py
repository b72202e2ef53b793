"""`faces sheet`: draws every FAP, action unit and emotion of a face in one picture."""

from pathlib import Path
from typing import Any

import click

from realizer.cli import inputs, options
from realizer.cli.options import option
from realizer.cli.progress import counting, note


@click.command()
@click.argument("name", shell_complete=options.completing_faces)
@option("-o --output SHEET.png", "Picture to write.", options.OUTPUT, required=True)
@option("--faps", "Draw every low-level FAP, in both directions.", is_flag=True)
@option("--aus", "Draw every action unit.  [default: FAPs and action units]", is_flag=True)
@option("--emotions", "Draw the archetypes, and 17 angles of the wheel at 4 activations each.", is_flag=True)
@option(
    "--value",
    "Value of FAPs: 512 is half their unit distance, or 20 degrees of rotation; limited to their range.",
    options.Number(1, 4320),
    default=512,
)
@option("--intensity", "Intensity of action units.", options.Number(0, 1, min_open=True), default=1)
@option(
    "--camera",
    f"{options.CAMERAS} May be repeated to show several views.  [default: front]",
    name="cameras",
    multiple=True,
)
@options.deformer
@options.mapping
@options.light
@options.opaque_background
@option("--size", "Size of each picture.", default="220x280", callback=options.parse_size)
def sheet(
    name: str,
    output: Path,
    cameras: tuple[str, ...],
    size: tuple[int, int],
    mapping: Path | None,
    **choices: Any,
) -> None:
    """Draw what every FAP and action unit does to a face, to check the face by eye.

    Beside each picture is the difference to the neutral face, in colours over a faint neutral face; the
    larger the difference, the paler the colour (Paul 2010, 4.4.2).

    \b
    realizer faces sheet ada -o ada.png --camera front --camera profile
    realizer faces sheet ada -o ada.png --emotions
    """
    from PIL import Image

    from realizer.face.fap_mapping import mapping_of
    from realizer.outputs.output import RenderSettings
    from realizer.render.contact_sheet import album
    from realizer_studio.cli import sheet_poses

    inputs.check_suffix(output, ".png")
    cameras = cameras or ("front",)
    for camera in cameras:
        options.check_camera(name, camera)
    usual = not (choices["faps"] or choices["aus"] or choices["emotions"])
    face_mapping = mapping_of(name, inputs.settings(mapping=mapping).mapping)
    series = [sheet_poses.neutral()]
    if choices["faps"] or usual:
        series += sheet_poses.of_faps(choices["value"])
    if choices["aus"] or usual:
        series += sheet_poses.of_aus(choices["intensity"])
    if choices["emotions"]:
        series += sheet_poses.of_emotions()
    drawing = RenderSettings(size, light=choices["light"], background=choices["background"])
    count = sum(len(part.poses) for part in series)
    face = name, choices["deformer"], face_mapping
    with counting("drawing", count * len(cameras)) as step:
        groups = sheet_poses.draw(series, face, cameras, drawing, step)
    title = f"{name}: {', '.join(cameras)}. Left: as drawn; right: difference to the neutral face"
    pixels = album(groups, sheet_poses.scale(), title)
    Image.fromarray(pixels).save(output, compress_level=4)
    note(f"{output}: {count} poses, {pixels.shape[1]}x{pixels.shape[0]}")
