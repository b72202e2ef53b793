"""Tests of the surfaces of glTF scenes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from realizer.face.load import load_face
from realizer.facebuild.arkit.gltf import Gltf
from realizer.facebuild.arkit.scene import read_pieces


def test_read_pieces_decodes_quantised_places_in_a_turned_node(
    new_glb: Callable[[], Any], tmp_path: Path
) -> None:
    face = load_face("ada")
    glb = new_glb()
    step = 0.4 / 32767
    whole = np.rint(face.vertices / step)
    glb.mesh("head", face.vertices, face.triangles, None, {})
    attributes = glb.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["POSITION"] = glb.accessor(whole, 5122, normalized=True)
    glb.json["nodes"][0] |= {"scale": [0.4] * 3, "rotation": [0, 0.7071067811865476, 0, 0.7071067811865476],
                             "translation": [1, 2, 3]}  # fmt: skip
    path = tmp_path / "q.glb"
    path.write_bytes(glb.bytes())
    (piece,) = read_pieces(Gltf(path))
    wanted = face.vertices[:, [2, 1, 0]] * [1, 1, -1] + [1, 2, 3]
    assert np.abs(piece.vertices - wanted).max() < 2 * step


@pytest.mark.parametrize(("scale", "wanted"), [([2.0, 2.0, 2.0], [0, 1, 2]), ([-2.0, 2.0, 2.0], [2, 1, 0])])
def test_read_pieces_keeps_the_outside_of_a_reflected_head(
    new_glb: Callable[[], Any], tmp_path: Path, scale: list[float], wanted: list[int]
) -> None:
    glb = new_glb()
    glb.mesh("head", np.eye(3), np.array([[0, 1, 2]]), None, {})
    glb.json["nodes"][0] |= {"scale": scale}
    path = tmp_path / "r.glb"
    path.write_bytes(glb.bytes())
    (piece,) = read_pieces(Gltf(path))
    assert piece.vertices == pytest.approx(np.eye(3) * scale)
    assert piece.triangles.tolist() == [wanted]


def test_read_pieces_poses_vertices_by_their_skeleton(new_glb: Callable[[], Any], tmp_path: Path) -> None:
    glb = new_glb()
    at = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])
    glb.mesh("head", at, np.array([[0, 1, 2]]), None, {"jawOpen": np.tile([0, 0, 1.0], (3, 1))})
    attributes = glb.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["JOINTS_0"] = glb.accessor(np.array([[0, 1, 0, 0]] * 3), 5121)
    attributes["WEIGHTS_0"] = glb.accessor(np.array([[0.5, 0.5, 0, 0]] * 3))
    glb.json["skins"] = [{"joints": [1, 2]}]
    glb.json["nodes"][0] |= {"skin": 0}
    glb.json["nodes"] += [{"translation": [0, 2, 0]}, {"translation": [0, 4, 0]}]
    glb.json["scenes"][0]["nodes"] += [1, 2]
    path = tmp_path / "s.glb"
    path.write_bytes(glb.bytes())
    (piece,) = read_pieces(Gltf(path))
    assert piece.vertices == pytest.approx(at + np.array([0, 3, 0]))
    assert piece.moves["jawOpen"] == pytest.approx(np.tile([0, 0, 1.0], (3, 1)))


def test_read_pieces_turns_a_texture_into_colours(new_glb: Callable[[], Any], tmp_path: Path) -> None:
    glb = new_glb()
    glb.mesh("head", np.eye(3), np.array([[0, 1, 2]]), None, {}, "skin")
    pixels = np.zeros((4, 4, 3), np.uint8)
    pixels[:, :2], pixels[:, 2:] = (200, 60, 20), (10, 120, 240)
    Image.fromarray(pixels).save(tmp_path / "skin.png")
    glb.json |= {"images": [{"uri": "skin.png"}], "textures": [{"source": 0}]}
    glb.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {"index": 0}
    attributes = glb.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["TEXCOORD_0"] = glb.accessor(np.array([[0.25, 0.5], [0.75, 0.5], [0.75, 0.5]]))
    path = tmp_path / "t.glb"
    path.write_bytes(glb.bytes())
    (piece,) = read_pieces(Gltf(path))
    assert piece.colours == pytest.approx(np.array([[200, 60, 20], [10, 120, 240], [10, 120, 240]]), abs=1.5)
