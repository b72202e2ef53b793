"""The build of a face from two photographs."""

import shutil
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from realizer.core.errors import FaceError
from realizer_studio.faces.person import makehuman
from realizer_studio.faces.person.build import RECIPE, Photographs, build_face
from realizer_studio.faces.person.person import person_of
from realizer_studio.faces.person.recipe import recipe_text
from realizer_studio.faces.person.sliders import person_targets
from realizer_studio.faces.photo.fit import fit_person
from realizer_studio.faces.photo.looks import recipe_of
from realizer_studio.faces.photo.texture import Painter
from realizer_studio.faces.photo.views import read_views
from realizer_studio.faces.photo.warp import warp_of


def build_from_photographs(
    front: Path,
    side: Path,
    folder: Path,
    data: Path,
    *,
    sliders: Mapping[str, Any],
    hair: str | None = None,
    progress: Callable[[str], None] = print,
) -> Path:
    """Build a face folder from two photographs of a person; an error leaves no files.

    Args:
        front, side: pictures of a face at rest, the second one turned by 30 to 60 degrees or by 90.
        folder: the folder to write, which must not exist, or be empty.
        data: the CC0 MakeHuman data, as for `build_face`.
        sliders: fixed sliders of the recipe, such as {"age": 40, "eyes": "blue"}.
        hair: a style of hair; None for the likeliest.
        progress: called with the name of the next step.

    Returns:
        The folder.

    Raises:
        FaceError: a photograph, the data or a slider cannot be used, or the folder is not empty.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise FaceError(f"{folder}: there is something already; wanted a new folder (-o)")
    data = makehuman.data_folder(data)
    progress("find the landmarks")
    views = read_views(front, side)
    progress("fit the recipe")
    fit = fit_person(
        *views, data, {key: value for key, value in sliders.items() if key in ("age", "sex", "people")}
    )
    tables = recipe_of(views[0], fit.person, sliders, hair)
    at = person_of(data, person_targets(tables["person"])).figure.at
    warp = warp_of(fit, at)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".photo-", dir=folder.parent) as temporary:
        draft = Path(temporary) / folder.name
        draft.mkdir()
        (draft / RECIPE).write_text(recipe_text(tables), "utf-8")
        warp.write(draft)
        build_face(folder.name, data, draft, progress, Photographs(warp, Painter(fit)))
        if folder.exists():
            folder.rmdir()
        shutil.move(draft, folder)
    return folder
