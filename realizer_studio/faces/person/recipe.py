"""The recipe.toml of a person: a reader and its checks.

A recipe has sliders, or shape targets and colours, and tables for hair, look and glasses."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from realizer.core.errors import FaceError
from realizer.core.similar import did_you_mean, similar
from realizer.core.toml_text import parse_toml
from realizer.face.reading import face_errors
from realizer.tables import toml_table
from realizer_studio.faces.hair.style import style_of
from realizer_studio.faces.person import makehuman
from realizer_studio.faces.person.clothing import glasses_of
from realizer_studio.faces.person.sliders import description_of, is_number, person_faults, person_tables

COLOURS = (
    "skin", "blush", "lips", "mouth", "brows", "lashes", "hair", "shirt", "tongue", "tooth", "root", "gum",
    "pupil", "iris_inner", "iris_middle", "iris_outer", "ring", "white", "corner",
)  # fmt: skip
TABLES = ("person", "targets", "colours", "hair", "look", "glasses")


@dataclass(frozen=True, slots=True)
class Appearance:
    """The numbers of a person's look; `realizer/tables/look.toml` explains them."""

    brow_thick: float
    brow_low: float
    brow_grey: float
    brow_cover: float
    brow_gap: float
    brow_arch: float
    brow_hair: float
    beard: float
    lash: float
    lips: float
    flush: float
    stubble: float
    freckles: float
    moles: float
    age: float
    collar_low: float
    collar_point: float


@dataclass(frozen=True, eq=False)
class Recipe:
    """The recipe of a person."""

    description: str  # a sentence about them, for lists of faces
    targets: dict[str, float]  # shape target -> weight 0..1; `*` in a name stands for both sides
    colours: dict[str, list[float]]  # name of `COLOURS` -> sRGB 0..255
    hair: dict[str, Any] = field(default_factory=dict)  # the style of the hair, and numbers that it changes
    # Numbers of `Appearance` that differ from the defaults.
    look: dict[str, Any] = field(default_factory=dict)
    # A style of `realizer/tables/glasses.toml`, and numbers that it changes; empty for no glasses.
    glasses: dict[str, Any] = field(default_factory=dict)


def read_recipe(path: Path, data: Path) -> Recipe:
    """Read a recipe from a file; its other tables override the values of the sliders in [person].

    Without [person], [targets] and [colours], all sliders have their defaults.

    Args:
        data: the folder of shape targets.

    Raises:
        FaceError: the file is missing or not TOML, or has faults; the text lists all, with key and reason.
    """
    with face_errors(path, "a recipe (copy the one of another face and change it)"):
        raw = parse_toml(path.read_text("utf-8"))
    keys = ("says", *TABLES)
    faults = [f"wanted one of {', '.join(keys)}, got {key!r}" for key in raw if key not in keys]
    tables: dict[str, dict[str, Any]] = {}
    for name in TABLES:
        tables[name] = raw.get(name, {})
        if not isinstance(tables[name], dict):
            faults.append(f"{name}: wanted a table, got {tables[name]!r}")
            tables[name] = {}
    person = tables.pop("person")
    wrong = person_faults(person)
    faults += wrong
    if not wrong and ("person" in raw or not {"targets", "colours"} & raw.keys()):
        for name, values in person_tables(person).items():
            tables[name] = {**values, **tables[name]}
    description = raw.get("says", description_of(person))
    if not isinstance(description, str) or not description.strip():
        faults.append(f"says: wanted a sentence about the person, got {description!r}")
    if not wrong:  # otherwise targets and colours are missing because of the sliders
        faults += _target_faults(tables["targets"], data)
        faults += _colour_faults(tables["colours"])
    for reader, name in ((style_of, "hair"), (appearance_of, "look"), (glasses_of, "glasses")):
        try:
            reader(tables[name])
        except FaceError as error:
            faults.append(str(error))
    if faults:
        raise FaceError("\n".join(f"{path}: {fault}" for fault in faults))
    return Recipe(description, **tables)


def appearance_of(table: Mapping[str, Any]) -> Appearance:
    """Return the default look with the changes of a recipe's [look].

    Raises:
        FaceError: an unknown key, or a value that is no number.
    """
    names = [field.name for field in fields(Appearance)]
    for key, value in table.items():
        if key not in names:
            raise FaceError(f"look: wanted one of {', '.join(names)}, got {key!r}")
        if not is_number(value):
            raise FaceError(f"look: {key}: wanted a number, got {value!r}")
    defaults = toml_table("look.toml")
    return Appearance(**{name: float(table.get(name, defaults[name])) for name in names})


def recipe_text(tables: Mapping[str, Any]) -> str:
    """Return a recipe as TOML: `says`, then its tables."""
    lines = [f"says = {json.dumps(tables['says'], ensure_ascii=False)}"]
    for name, table in tables.items():
        if isinstance(table, Mapping):
            lines += ["", f"[{name}]", *(f"{key} = {_toml(value)}" for key, value in table.items())]
    return "\n".join(lines) + "\n"


def _toml(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_toml(inner)}" for key, inner in value.items()) + " }"
    return json.dumps(value, ensure_ascii=False)


def _target_faults(targets: Mapping[str, Any], data: Path) -> list[str]:
    names = makehuman.target_names(data)
    faults = []
    if not any(str(name).startswith("macrodetails/") for name in targets):
        faults.append("targets: wanted at least one of macrodetails/..., got none")
    for name, weight in targets.items():
        if name not in names:
            faults.append(
                f"targets: {name}: no such shape target{did_you_mean(similar(name, names, 1, 0.4))}"
            )
        if not is_number(weight) or not 0 <= weight <= 1:
            faults.append(f"targets: {name}: wanted a weight 0..1, got {weight!r}")
    return faults


def _colour_faults(colours: Mapping[str, Any]) -> list[str]:
    missing = [name for name in COLOURS if name not in colours]
    faults = [f"colours: wanted also {', '.join(missing)}"] if missing else []
    for name, colour in colours.items():
        if name not in COLOURS:
            faults.append(f"colours: {name}: wanted one of {', '.join(COLOURS)}")
        elif not isinstance(colour, list) or [is_number(c) and 0 <= c <= 255 for c in colour] != [True] * 3:
            faults.append(f"colours: {name}: wanted three numbers 0..255, got {colour!r}")
    return faults
