"""The build of a face from two photographs, and the recipe with their colours and hair."""

import shutil
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from realizer.core.array_types import Float64
from realizer.core.colours import linear, srgb
from realizer.core.errors import FaceError
from realizer.tables import toml_table
from realizer_studio.faces.person import makehuman
from realizer_studio.faces.person.person import person_of
from realizer_studio.faces.person.person_build import RECIPE, Photographs, build_face
from realizer_studio.faces.person.recipe import recipe_text
from realizer_studio.faces.person.sliders import person_tables, person_targets
from realizer_studio.faces.photo.photo_fit import fit_person
from realizer_studio.faces.photo.texture import Painter
from realizer_studio.faces.photo.views import View, read_views
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


CHEEKS = (50, 280, 205, 425, 101, 330, 118, 347, 151, 9)  # landmarks on plain skin
TOP, CHIN, JAW, SIDES, TEMPLES = 10, 152, (132, 361), (234, 454), (127, 356)
# Ratio of colours in a picture to the skin's albedo, by channel, measured on renderings of shipped faces.
REFLECTED = np.array([0.97, 0.91, 0.83])
ABOVE = (0.10, 0.16, 0.22)  # heights of the face above its uppermost landmark where hair is sampled
BESIDE = (0.18, 0.25, 0.32)  # widths of the face beside the jaw
ALIKE = 0.35  # largest distance of the logarithms of colours of one material
TEMPLE = 0.06  # heights of the face above the landmark at the temple where a rim of hair is sampled
PATCH = 4  # pixels around a sampled position
ON_SKIN = ("skin", "blush", "lips", "corner")  # colours that are scaled with the skin's


def recipe_of(
    front: View, person: Mapping[str, Any], fixed: Mapping[str, Any], hair: str | None
) -> dict[str, Any]:
    """Return the tables of a recipe: sliders, colours of skin, hair and eyes, and a hair style.

    Args:
        person: the sliders of the shape.
        fixed: sliders with fixed values.
        hair: a style of `realizer/tables/hair.toml`; None for the likeliest.
    """
    assert front.points is not None
    table, points = toml_table("person.toml"), front.points
    pixels = np.asarray(front.image, np.float64)
    skin = np.median([_colour(pixels, points[k]) for k in CHEEKS], axis=0)
    tones = np.array(table["skin"]["tones"], float)
    fine = np.stack(
        [np.interp(np.linspace(0, len(tones) - 1, 200), np.arange(len(tones)), c) for c in tones.T], 1
    )
    tone = int(np.linalg.norm(fine - skin, axis=1).argmin())
    up = points[TOP] - points[CHIN]
    found = np.median([_colour(pixels, points[TOP] + share * up) for share in ABOVE], axis=0)
    rim = _rim(pixels, points, skin) if _colour_difference(found, skin) < ALIKE else None
    hairs = {name: row["colour"] for name, row in table["hair_colours"].items()}
    eyes = {name: row["colours"][1] for name, row in table["eye_colours"].items()}
    found_sliders = {
        "skin": round(tone / 199, 3),
        "hair": _nearest(found if rim is None else rim, hairs),
        "eyes": _nearest(_iris(pixels, front), eyes),
    }
    sliders = {**person, **found_sliders, **fixed}
    tables = person_tables(sliders)
    share = linear(skin) / linear(fine[tone])
    colours = {
        name: np.rint(255 * srgb(linear(np.array(tables["colours"][name])) * share)) for name in ON_SKIN
    }
    style = hair or ("rim" if rim is not None else _style(pixels, points, found, skin, sliders["sex"]))
    return {
        "says": f"A face made of two photographs, with {sliders['hair']} hair",
        "person": sliders,
        "colours": {name: colour.tolist() for name, colour in colours.items()},
        # The sampled colour includes grey hair.
        "hair": {"style": style, "grey": 0.0},
    }


def _colour(pixels: Float64, position: Any) -> Float64:
    """Return the albedo (3,), sRGB 0..255, around a position."""
    x, y = np.clip(np.rint(position).astype(int), PATCH, np.array(pixels.shape[1::-1]) - PATCH - 1)
    around = pixels[y - PATCH : y + PATCH + 1, x - PATCH : x + PATCH + 1].reshape(-1, 3)
    return np.asarray(255.0 * srgb(linear(np.median(around, axis=0)) / REFLECTED))


def _iris(pixels: Float64, front: View) -> Float64:
    """Return the colour of both irises beside and below the pupils, outside the shadow of the lids."""
    turn = np.radians([-20, 0, 20, 45, 135, 160, 180, 200])
    ring = 0.33 * front.iris * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    x, y = np.rint(front.irises[:, None] + ring).astype(int).reshape(-1, 2).T
    return np.asarray(255.0 * srgb(linear(np.median(pixels[y, x], axis=0)) / REFLECTED))


def _nearest(colour: Float64, colours: Mapping[str, Any]) -> str:
    return min(colours, key=lambda name: _colour_difference(colour, np.array(colours[name], float)))


def _colour_difference(one: Float64, other: Float64) -> float:
    return float(np.linalg.norm(np.log(linear(one) + 0.02) - np.log(linear(other) + 0.02)))


def _rim(pixels: Float64, points: Float64, skin: Float64) -> Float64 | None:
    """Return the colour of hair beside the temple on the brighter side, or None if there is no hair."""
    up, wide = points[TOP] - points[CHIN], points[SIDES[1]] - points[SIDES[0]]
    sides = [points[k] + TEMPLE * up for k in TEMPLES]
    side, sign = max(zip(sides, (-1, 1), strict=True), key=lambda one: _colour(pixels, one[0]).sum())
    beside, behind = _colour(pixels, side), _colour(pixels, side + sign * BESIDE[0] * wide)
    return (
        beside if min(_colour_difference(beside, skin), _colour_difference(beside, behind)) >= ALIKE else None
    )


def _style(pixels: Float64, points: Float64, hair: Float64, skin: Float64, sex: float) -> str:
    """Return a style: long if there is hair beside the jaw, "buzz" if the hair has the colour of skin."""
    if _colour_difference(hair, skin) < ALIKE:
        return "buzz"
    behind = _colour(pixels, np.array([0.0, 0.0]))
    wide = points[SIDES[1]] - points[SIDES[0]]
    sides = [
        _colour(pixels, points[k] + sign * share * wide)
        for k, sign in zip(JAW, (-1, 1), strict=True)
        for share in BESIDE
    ]
    hanging = sum(_colour_difference(side, hair) < _colour_difference(side, behind) for side in sides)
    if hanging >= len(sides) / 2:
        return "bob"
    return "bun" if sex < 0.4 else "short"
