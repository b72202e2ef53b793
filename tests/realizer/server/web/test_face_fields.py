"""The Face tab moves a head in the browser exactly as the face that the service makes of it."""

from __future__ import annotations

import base64
import dataclasses
import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from realizer.core.settings import Settings
from realizer.face.deform import deform
from realizer.face.load import load_folder
from realizer_studio.editors.face.bare_head import import_bare
from realizer_studio.editors.face.head_message import head_message
from realizer_studio.editors.face.studio import Studio
from realizer_studio.editors.packed_messages import packed
from realizer_studio.faces.mpeg4.zones import FALLOFFS
from tests.bare_heads import bare_head

SCRIPT = Path(__file__).with_name("face_fields.mjs")
SOURCE = Path(__file__).parents[4] / "realizer" / "server" / "web" / "src" / "face"
NODE = shutil.which("node")
MICROMETRE = 1e-6
EYEBALLS = (27, 28)  # they push the eyeballs too, which the service moves
pytestmark = [
    pytest.mark.slow,
    pytest.mark.xdist_group("bare"),
    pytest.mark.skipif(NODE is None or not SOURCE.is_dir(), reason="needs Node and the page's sources"),
]


def moved_by_page(head: bytes, place: Path) -> dict[tuple[int, float], Any]:
    """Return the vertices that the page's modules compute, by FAP and value."""
    (place / "head.bin").write_bytes(head)
    assert NODE is not None
    done = subprocess.run(
        [NODE, str(SCRIPT), str(SOURCE), str(place / "head.bin")], capture_output=True, text=True, check=True
    )
    rows = json.loads(done.stdout)
    return {
        (fap, value): np.frombuffer(base64.b64decode(text), np.float32).reshape(-1, 3)
        for fap, value, text in rows
    }


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bare")
    import_bare(bare_head(folder / "head.glb"), folder / "bare", "bare")
    return folder / "bare"


@pytest.mark.parametrize("falloff", [None, *FALLOFFS])
def test_page_moves_vertices_as_the_service_does(bare: Path, tmp_path: Path, falloff: str | None) -> None:
    head, arrays = head_message(bare)
    if falloff is not None:
        extra = {"ease": 35.0, "smooth_centre": 0.4, "smooth_side": 0.2}
        head["setup"]["zone"] = [{**zone, "falloff": falloff, **extra} for zone in head["setup"]["zone"]]
    page = moved_by_page(packed(head, arrays), tmp_path)
    studio = Studio(Settings(), True)
    try:
        studio._head = bare
        face = studio._draft({"setup": head["setup"], "keep": False})
    finally:
        studio.close()
    # Teeth that push the lining of lips are not in the page.
    face = dataclasses.replace(face, parts={n: p for n, p in face.parts.items() if "teeth" not in n})
    asked = [key for key in page if key[0] not in EYEBALLS]
    assert len({fap for fap, _ in asked}) >= 45
    rows = np.zeros((len(asked), 68), np.float32)
    for k, (fap, value) in enumerate(asked):
        rows[k, fap - 1] = value
    far = {
        key: float(np.abs(page[key] - at).max()) for key, at in zip(asked, deform(face, rows), strict=True)
    }
    assert max(far.values()) < MICROMETRE, sorted(far.items(), key=lambda item: -item[1])[:5]
    assert all(np.abs(page[key] - load_folder(bare, None).vertices).max() > 1e-4 for key in asked)
