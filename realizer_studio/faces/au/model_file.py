"""The writer of the text file of a fitted model, which `realizer.face.au.file` reads."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.au.file import ANGLES, ORDER
from realizer.face.au.functions import LOWER
from realizer.face.au.model import Model

HEAD = """\
# source: {source}
# units: metres; m, B, alpha and beta in centimetres from the motion's origin, angles in radians
# licence: {licence}
# Metres begin between the eyes: +x the character's left, +y up, +z forward.
# A symmetric matrix is written xx, yy, zz, xy, xz, yz. A displacement is the sum of the Gaussians times the
# unit vector [cos alpha cos beta, sin beta, sin alpha cos beta] (Wojdel 2005, equations 4.1 and 4.3 to 4.7).
# alpha = (v A1 v)(A2 v) + v A3 v + A4 v + c, and so is beta with its own A1 to A4 and c.
"""


def write_model(path: Path, model: Model) -> None:
    """Write a model."""
    lines = [
        HEAD.format(source=model.source, licence=model.licence),
        f'form = "{model.form}"',
        "",
        "[mouth]  # where the lips meet, from the middle to the corner, and how that plane rises with z",
        *(f"{key} = {_list(getattr(model.mouth, key))}" for key in ("x", "y", "z", "slope")),
        "",
        "[pivots]",
        f"head = {_list(model.head.pivot)}",
        f"left_eye = {_list(model.eyes[0])}",
        f"right_eye = {_list(model.eyes[1])}",
        f"jaw = {_list(model.jaw)}",
        "",
        "[neck]  # a smooth step of y + tilt z: 1 from top on, 0 below end",
        *(f"{key} = {_number(getattr(model.head, key))}" for key in ("top", "end", "tilt")),
        "",
        "[degrees]  # of the turns, with full intensity",
        *(f"AU{au} = {_number(value)}" for au, value in sorted(model.degrees.items())),
    ]
    for au, unit in sorted(model.units.items()):
        lines += ["", f"[AU{au}]"]
        if unit.jaw_degrees:
            lines.append(f"jaw_degrees = {_number(unit.jaw_degrees)}")
        for half, motion in unit.motions.items():
            lines += [f"[AU{au}.{half}]", f"origin = {_list(motion.origin)}"]
            for name, values in (("alpha", motion.alpha), ("beta", motion.beta)):
                parts = ", ".join(
                    f"{key} = {_list(values[part]) if key != 'c' else _number(values[18])}"
                    for key, part in ANGLES.items()
                )
                lines.append(f"{name} = {{ {parts} }}")
            lines += ["gaussians = [", *map(_gaussian, motion.gaussians), "]"]
    path.write_text("\n".join(lines) + "\n", "utf-8")


def _gaussian(row: Float64) -> str:
    root = np.zeros((3, 3))
    for value, place in zip(row[4:], LOWER, strict=True):
        root[place] = value
    matrix = root @ root.T
    values = _list(matrix[place] for place in ORDER)
    return f"  {{ eta = {_number(row[0])}, m = {_list(row[1:4])}, B = {values} }},"


def _number(value: Any) -> str:
    text = f"{float(value):.8g}"
    return "0.0" if text == "-0" else text if "." in text or "e" in text else text + ".0"


def _list(values: Iterable[Any]) -> str:
    return "[" + ", ".join(_number(value) for value in values) + "]"
