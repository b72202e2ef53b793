"""The animated head, read by foreign programs."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from PIL import Image

from realizer.animation.arkit import ARKIT_NAMES
from realizer.animation.axis import fap
from realizer.face.deform import deform
from realizer.face.drawn_mesh import drawn_mesh
from realizer.face.load import load_face
from realizer.face.maps import Maps
from realizer.offline import realize
from realizer.outputs.glb import encode_glb
from realizer.outputs.morph_targets import TOLERANCE, make_morph_targets
from realizer.outputs.output import RenderSettings
from realizer.outputs.registry import OUTPUTS
from realizer.server.http.face_glb import face_glb

pytestmark = pytest.mark.xdist_group("outputs")

FPS = 12.5
TURNED = 7e-4  # m, where the neck turns: skinning is of drawn vertices, ours of those they are drawn from
EYES = ("left_eye", "right_eye")


@pytest.fixture(scope="module", params=["mpeg4", "au"])
def played(request, turn):
    return realize(turn, deformer=request.param, voice="silent", fps=FPS)


@pytest.fixture(scope="module")
def path(played, tmp_path_factory):
    found = tmp_path_factory.mktemp("glb") / "turn.glb"
    OUTPUTS[".glb"].write(played, found, RenderSettings())
    return found


def split(face, vertices):
    """Return drawn vertices by the file's primitives: three.js names those of a mesh name_1, name_2, ..."""
    balls = [name for name, ((first, last), _) in zip(EYES, face.basis["eyes"], strict=True) if last > first]
    mesh = drawn_mesh(face)
    drawn, found, count = mesh.places @ vertices, {}, 0
    for name, (first, last) in mesh.parts.items():
        mine = mesh.triangles[(mesh.triangles[:, 0] >= first) & (mesh.triangles[:, 0] < last)]
        count += name not in balls
        found[name if name in balls else f"{face.name}_{count}"] = drawn[np.unique(mine)]
    return found


def far(got, wanted):
    return max(np.linalg.norm(np.asarray(got[name]) - wanted[name], axis=1).max() for name in wanted)


def mean(got, wanted):
    return np.mean([np.linalg.norm(np.asarray(got[name]) - wanted[name], axis=1).mean() for name in wanted])


@pytest.mark.slow
def test_glb_is_valid_and_looks_like_the_face_in_three_js(played, path, read_by):
    frames = [0, 12, played.frames - 1]
    seen = read_by("gltf.mjs", path, *(str(k / FPS) for k in frames))
    assert seen["issues"]["messages"] == []
    assert seen["duration"] == pytest.approx((played.frames - 1) / FPS)
    assert "open_jaw" in seen["targets"]
    wanted = deform(played.face, played.poses[frames])
    assert np.linalg.norm(wanted - played.face.vertices, axis=2).max() > 0.01
    for got, vertices in zip(seen["frames"], wanted, strict=True):
        assert far(got, split(played.face, vertices)) < TURNED
        assert mean(got, split(played.face, vertices)) < TOLERANCE / 2


@pytest.mark.slow
def test_glb_of_the_service_is_valid_and_looks_like_the_face_in_three_js(tmp_path, read_by):
    face = load_face("default")
    (tmp_path / "x.glb").write_bytes(face_glb(face))
    seen = read_by("gltf.mjs", tmp_path / "x.glb", "0")
    # The validator does not look into extras, which refer to the accessors of matrices.
    assert {message["code"] for message in seen["issues"]["messages"]} == {"UNUSED_OBJECT"}
    drawn = drawn_mesh(face).places @ face.vertices
    assert all(np.abs(np.array(mesh) - drawn).max() < 1e-6 for mesh in seen["frames"][0].values())


def test_glb_is_read_by_trimesh(played, path):
    scene = trimesh.load(io.BytesIO(path.read_bytes()), file_type="glb")
    mesh = drawn_mesh(played.face)
    assert sum(len(part.faces) for part in scene.geometry.values()) == len(mesh.triangles)
    drawn = mesh.places @ played.face.vertices
    assert np.allclose(scene.bounds, [drawn.min(axis=0), drawn.max(axis=0)], atol=1e-6)
    assert {part.visual.material.name for part in scene.geometry.values()} == set(mesh.parts)


def test_glb_weights_are_0_to_1(played, path):
    read_gltf = pytest.importorskip("openfacefx.importers_gltf", reason="pip install openfacefx").read_gltf
    track, notes = read_gltf(str(path), epsilon=0)
    assert notes == []
    assert track.fps == pytest.approx(FPS)
    made = make_morph_targets(played.face, played.poses)
    assert [channel.name for channel in track.channels] == list(made.names)
    times = np.arange(played.frames) / FPS
    for channel, wanted in zip(track.channels, made.weights.T, strict=True):
        got = np.interp(times, [key.time for key in channel.keys], [key.value for key in channel.keys])
        np.testing.assert_allclose(got, wanted, atol=1e-3)


@pytest.mark.slow
def test_glb_moves_pushed_eyes_by_their_nodes(tmp_path, read_by):
    face = load_face("default")
    poses = np.zeros((4, len(face.inputs)), np.float32)
    for number, value in ((27, 150), (28, -80), (23, 2e4), (24, -1e4), (49, 3e4)):
        poses[1:, face.inputs.index(fap(number).name)] = np.array([0.3, 0.7, 1]) * value
    (tmp_path / "x.glb").write_bytes(encode_glb(face, make_morph_targets(face, poses), 25.0))
    seen = read_by("gltf.mjs", tmp_path / "x.glb", *(str(k / 25) for k in range(4)))
    assert seen["issues"]["messages"] == []
    for got, vertices in zip(seen["frames"], deform(face, poses), strict=True):
        assert far(got, split(face, vertices)) < TURNED
        assert mean(got, split(face, vertices)) < TOLERANCE / 2


@pytest.mark.slow
def test_glb_includes_eyes_without_balls_in_the_face(tmp_path, read_by):
    face = load_face("default")
    flat = replace(face, basis={**face.basis, "eyes": tuple(((0, 0), at) for _, at in face.basis["eyes"])})
    poses = np.zeros((2, len(face.inputs)), np.float32)
    for number, value in ((3, 400), (19, 700), (49, 2e4)):
        poses[1, face.inputs.index(fap(number).name)] = value
    (tmp_path / "x.glb").write_bytes(encode_glb(flat, make_morph_targets(flat, poses), 25.0))
    seen = read_by("gltf.mjs", tmp_path / "x.glb", "0", "0.04")
    assert seen["issues"]["messages"] == []
    for got, vertices in zip(seen["frames"], deform(flat, poses), strict=True):
        assert far(got, split(flat, vertices)) < TURNED


def test_glb_of_a_face_at_rest_has_no_targets(tmp_path, read_by):
    face = load_face("default")
    targets = make_morph_targets(face, np.zeros((1, len(face.inputs)), np.float32))
    (tmp_path / "x.glb").write_bytes(encode_glb(face, targets, 25.0))
    seen = read_by("gltf.mjs", tmp_path / "x.glb", "0")
    assert seen["issues"]["messages"] == []
    assert seen["targets"] == []
    assert far(seen["frames"][0], split(face, face.vertices)) < 1e-6


@pytest.mark.slow
def test_glb_is_deterministic(played, path):
    made = make_morph_targets(played.face, played.poses)
    assert encode_glb(played.face, made, FPS) == path.read_bytes()


def test_glb_with_arkit_names_has_its_52_shapes(turn, tmp_path, read_by):
    played = realize(turn, voice="silent", fps=FPS)
    OUTPUTS[".glb"].write(played, tmp_path / "x.glb", RenderSettings(morphs="arkit"))
    seen = read_by("gltf.mjs", tmp_path / "x.glb", "0")
    assert seen["issues"]["messages"] == []
    assert seen["targets"] == list(ARKIT_NAMES())


def test_glb_of_a_face_with_maps_is_valid(tmp_path, read_by):
    face = with_maps(load_face("default"))
    targets = make_morph_targets(face, np.zeros((1, len(face.inputs)), np.float32))
    (tmp_path / "x.glb").write_bytes(encode_glb(face, targets, 25.0))
    seen = read_by("gltf.mjs", tmp_path / "x.glb", "0")
    assert seen["issues"]["messages"] == []
    assert seen["info"]["hasTextures"]


def with_maps(face):
    """Return the face with all maps, its skin laid out from the front, with holes at the left."""
    out = io.BytesIO()
    Image.new("RGBA", (32, 32), (200, 150, 120, 90)).save(out, "WEBP")
    uv = (face.vertices[:, :2] - face.bounds[0][:2]) / np.ptp(face.bounds, axis=0)[:2]
    corners = uv[face.triangles].astype(np.float32)
    corners[face.triangles[:, 0] >= face.parts["skin"][1]] = 4 / 1024
    files = dict.fromkeys(("albedo", "relief", "surface"), out.getvalue())
    holes = corners[:, 0, 0] < 0.3
    maps = Maps(files, corners, 0.001, 0.001, holes, np.zeros((len(face.vertices), 0), np.float32))
    return replace(face, maps=maps)
