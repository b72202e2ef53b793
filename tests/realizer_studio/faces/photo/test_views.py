"""Tests of what is seen in photographs, and of those that are of no use."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageOps

from realizer.core.errors import FaceError
from realizer.face.load import load_face
from realizer.render.cameras import Framing, camera_for
from realizer.render.light import presets
from realizer.render.raster import SoftwareCanvas
from realizer.render.worker import shapes
from realizer_studio.faces.photo.views import read_views
from tests.portraits import LITERT, portrait

pytestmark = [LITERT, pytest.mark.gl("onboard")]
SIZE = 320


def turned(degrees: float) -> Image.Image:
    """Return a picture of ida, turned to her left."""
    framing = asdict(Framing(yaw=-degrees, hairline=0.2, chin=0.75))
    face = replace(load_face("ida"), cameras={"turned": framing})
    canvas = SoftwareCanvas(face, (SIZE, SIZE), camera_for(face, "turned"), presets()["portrait"], None)
    try:
        ((vertices, normals),) = shapes(face, np.zeros((1, len(face.inputs)), np.float32))
        return Image.fromarray(canvas.draw(vertices, normals)[..., :3].copy())
    finally:
        canvas.close()


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Pictures by name."""
    folder = tmp_path_factory.mktemp("photographs")
    front, side = portrait("ida"), turned(45)
    pictures = {
        "front": front,
        "left": side,
        "right": ImageOps.mirror(side),
        "profile": turned(90),
        "grey": front.convert("L"),
        "two": Image.fromarray(np.concatenate([np.asarray(front)] * 2, axis=1)),
        "wall": Image.fromarray(np.random.default_rng(1).integers(90, 120, (320, 320, 3)).astype(np.uint8)),
        "small": Image.fromarray(
            np.pad(np.asarray(front.resize((140, 140))), ((110, 110), (110, 110), (0, 0)))
        ),
    }
    for name, picture in pictures.items():
        picture.save(folder / f"{name}.png")
    (folder / "text.png").write_text("no picture")
    return {name: folder / f"{name}.png" for name in (*pictures, "text")}


def test_views_estimate_the_turn_to_either_side(files: dict[str, Path]) -> None:
    front, side = read_views(files["front"], files["left"])
    assert abs(front.turn) < 5
    assert side.turn == pytest.approx(45, abs=10)
    assert front.points is not None
    assert front.iris == pytest.approx(np.ptp(front.points[:, 1]) / 13, rel=0.2)
    _, other = read_views(files["front"], files["right"])
    assert other.turn == pytest.approx(side.turn, abs=3)


def test_views_take_a_profile_without_landmarks(files: dict[str, Path]) -> None:
    _, side = read_views(files["front"], files["profile"])
    assert (side.points, side.turn) == (None, 90)


@pytest.mark.parametrize(
    ("front", "side", "words"),
    [
        ("wall", "left", "wall.png: wanted a face from the front, found none"),
        ("two", "left", "two.png: wanted one face, found 2; cut the picture"),
        ("grey", "left", "grey.png: wanted a picture in colour, got a grey one"),
        ("text", "left", "text.png: wanted a picture, got"),
        ("small", "left", "small.png: wanted a face at least 120 pixels high"),
        (
            "front",
            "front",
            "front.png: wanted a face from the side, turned by 30 to 60 degrees or by 90, got one",
        ),
        (
            "left",
            "front",
            "left.png: wanted a face from the front, got one turned by .*; are the two exchanged",
        ),
    ],
)
def test_views_say_why_a_photograph_is_of_no_use(
    files: dict[str, Path], front: str, side: str, words: str
) -> None:
    with pytest.raises(FaceError, match=words):
        read_views(files[front], files[side])


@pytest.mark.slow
def test_views_read_a_photograph_of_20_megabytes(files: dict[str, Path], tmp_path: Path) -> None:
    large = np.asarray(portrait("ida").resize((2600, 2600)), np.int16)
    noise = np.random.default_rng(2).integers(-9, 10, large.shape)
    path = tmp_path / "large.png"
    Image.fromarray((large + noise).clip(0, 255).astype(np.uint8)).save(path, compress_level=1)
    assert path.stat().st_size > 12e6
    assert max(read_views(path, files["left"])[0].image.size) <= 1920
