"""The animated head, read by foreign programs."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from realizer.animation.axis import fap
from realizer.core.colours import linear
from realizer.face.deform import deform
from realizer.face.glb import to_glb
from realizer.face.glb_file import GlbFile
from realizer.face.load import load_face
from realizer.face.model import Face
from realizer.facebuild.arkit.gltf import Gltf
from realizer.offline import realize
from realizer.outputs.glb import encode_glb, morphing_mesh, rigid_mesh
from realizer.outputs.morph_targets import TOLERANCE, MorphTargets, make_morph_targets
from realizer.outputs.output import RenderSettings
from realizer.outputs.registry import OUTPUTS

pytestmark = pytest.mark.xdist_group("outputs")

FPS = 12.5
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
    """By the meshes of the file."""
    balls = {name: slice(*ball) for name, (ball, _) in zip(EYES, face.basis["eyes"], strict=True)}
    rest = np.ones(len(face.vertices), bool)
    for ball in balls.values():
        rest[ball] = False
    return {face.name: vertices[rest]} | {name: vertices[ball] for name, ball in balls.items()}


def far(got, wanted):
    return max(np.linalg.norm(np.asarray(got[name]) - wanted[name], axis=1).max() for name in wanted)


def test_glb_is_valid_and_looks_like_the_face_in_three_js(played, path, read_by):
    frames = [0, 7, 12, 20, played.frames - 1]
    seen = read_by("gltf.mjs", path, *(str(k / FPS) for k in frames))
    assert seen["issues"]["messages"] == []
    assert seen["duration"] == pytest.approx((played.frames - 1) / FPS)
    assert "open_jaw" in seen["targets"]
    wanted = deform(played.face, played.poses[frames])
    assert np.linalg.norm(wanted - played.face.vertices, axis=2).max() > 0.01
    for got, vertices in zip(seen["frames"], wanted, strict=True):
        assert far(got, split(played.face, vertices)) < 1.5 * TOLERANCE


def test_glb_of_the_service_is_valid(tmp_path, read_by):
    face = load_face("default")
    (tmp_path / "x.glb").write_bytes(to_glb(face))
    seen = read_by("gltf.mjs", tmp_path / "x.glb", "0")
    assert seen["issues"]["messages"] == []
    assert far(seen["frames"][0], {face.name: face.vertices}) < 1e-6


def test_glb_is_read_by_trimesh(played, path):
    scene = trimesh.load(io.BytesIO(path.read_bytes()), file_type="glb")
    meshes = scene.geometry
    wanted = split(played.face, played.face.vertices)
    assert {name: len(mesh.vertices) for name, mesh in meshes.items()} == {
        name: len(vertices) for name, vertices in wanted.items()
    }
    assert sum(len(mesh.faces) for mesh in meshes.values()) == len(played.face.triangles)
    assert np.allclose(scene.bounds, played.face.bounds, atol=1e-6)


def test_glb_reproduces_every_frame(played, path):
    file = Gltf(path)
    nodes, (animation,) = file.json["nodes"], file.json["animations"]
    tracks = {
        (nodes[channel["target"]["node"]]["name"], channel["target"]["path"]): file.accessor(
            animation["samplers"][channel["sampler"]]["output"]
        )
        for channel in animation["channels"]
    }
    assert {name for name, _ in tracks} == {played.face.name, "head", *EYES}
    (primitive,) = file.json["meshes"][0]["primitives"]
    moves = np.stack([file.accessor(target["POSITION"]) for target in primitive["targets"]])
    weights = tracks[played.face.name, "weights"].reshape(played.frames, -1)
    shares = file.accessor(primitive["attributes"]["WEIGHTS_0"])
    assert np.allclose(shares.sum(axis=1), 1)
    pivot = np.array(nodes[2]["translation"])
    for k, vertices in enumerate(deform(played.face, played.poses)):
        shaped = file.accessor(primitive["attributes"]["POSITION"]) + np.tensordot(weights[k], moves, 1)
        turned = turned_by(tracks["head", "rotation"][k], shaped - pivot) + pivot
        got = shares[:, :1] * shaped + shares[:, 1:2] * turned
        wanted = split(played.face, vertices)[played.face.name]
        assert np.linalg.norm(got - wanted, axis=1).max() < 1.5 * TOLERANCE


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


def turned_by(quaternion, vertices):
    """Vertices turned by x, y, z, w."""
    axis, w = quaternion[:3], quaternion[3]
    return vertices + 2 * np.cross(axis, np.cross(axis, vertices) + w * vertices)


def test_glb_moves_pushed_eyes_by_their_nodes(tmp_path, read_by):
    face = load_face("default")
    poses = np.zeros((4, len(face.inputs)), np.float32)
    for number, value in ((27, 150), (28, -80), (23, 2e4), (24, -1e4), (49, 3e4)):
        poses[1:, face.inputs.index(fap(number).name)] = np.array([0.3, 0.7, 1]) * value
    (tmp_path / "x.glb").write_bytes(encode_glb(face, poses, 25.0))
    seen = read_by("gltf.mjs", tmp_path / "x.glb", *(str(k / 25) for k in range(4)))
    assert seen["issues"]["messages"] == []
    for got, vertices in zip(seen["frames"], deform(face, poses), strict=True):
        assert far(got, split(face, vertices)) < 1.5 * TOLERANCE


def test_glb_includes_eyes_without_balls_in_the_face(tmp_path, read_by):
    face = load_face("default")
    flat = replace(face, basis={**face.basis, "eyes": tuple(((0, 0), at) for _, at in face.basis["eyes"])})
    poses = np.zeros((2, len(face.inputs)), np.float32)
    for number, value in ((3, 400), (19, 700), (49, 2e4)):
        poses[1, face.inputs.index(fap(number).name)] = value
    (tmp_path / "x.glb").write_bytes(encode_glb(flat, poses, 25.0))
    seen = read_by("gltf.mjs", tmp_path / "x.glb", "0", "0.04")
    assert seen["issues"]["messages"] == []
    for got, vertices in zip(seen["frames"], deform(flat, poses), strict=True):
        assert far(got, {face.name: vertices}) < 1.5 * TOLERANCE


def test_glb_of_a_face_at_rest_has_no_targets(tmp_path, read_by):
    face = load_face("default")
    (tmp_path / "x.glb").write_bytes(encode_glb(face, np.zeros((1, len(face.inputs)), np.float32), 25.0))
    seen = read_by("gltf.mjs", tmp_path / "x.glb", "0")
    assert seen["issues"]["messages"] == []
    assert seen["targets"] == []
    assert far(seen["frames"][0], split(face, face.vertices)) < 1e-6


def test_glb_is_deterministic(played, path):
    assert encode_glb(played.face, played.poses, FPS) == path.read_bytes()


@pytest.fixture
def face(balls: tuple[Face, np.ndarray]) -> Face:
    return replace(balls[0], basis={"head": np.full((len(balls[0].vertices), 1), 0.25, np.float32)})


@pytest.fixture
def eye(face: Face) -> np.ndarray:
    mine = np.zeros(len(face.vertices), bool)
    mine[slice(*face.parts["left_eye"])] = True
    return mine


def read(tmp_path, file: GlbFile) -> Gltf:
    (tmp_path / "x.glb").write_bytes(file.bytes_of({"asset": {"version": "2.0"}}))
    return Gltf(tmp_path / "x.glb")


def test_rigid_mesh_is_a_part_about_its_centre(tmp_path, face: Face, eye: np.ndarray) -> None:
    file, centre = GlbFile(), np.array([0.032, 0, -0.015], np.float32)
    (primitive,) = rigid_mesh(file, face, eye, "eye", 3, centre)["primitives"]
    found = read(tmp_path, file)
    at, ups, colours = (found.accessor(primitive["attributes"][k]) for k in ("POSITION", "NORMAL", "COLOR_0"))
    assert at == pytest.approx(face.vertices[eye] - centre)
    assert np.linalg.norm(ups, axis=1) == pytest.approx(1, abs=1e-5)
    assert colours[:, :3] == pytest.approx(linear(face.colours[eye]), abs=1e-4)
    assert primitive["material"] == 3
    triangles = found.accessor(primitive["indices"]).reshape(-1, 3)
    own = face.triangles[eye[face.triangles].all(axis=1)]
    assert np.array_equal(triangles, own - face.parts["left_eye"][0])


def test_rigid_mesh_is_darker_by_occlusion(tmp_path, face: Face, eye: np.ndarray) -> None:
    file = GlbFile()
    dark = replace(face, occlusion=np.full(len(face.vertices), 0.5, np.float32))
    (primitive,) = rigid_mesh(file, dark, eye, "eye", 0)["primitives"]
    colours = read(tmp_path, file).accessor(primitive["attributes"]["COLOR_0"])
    assert colours[:, :3] == pytest.approx(linear(face.colours[eye]) / 2, abs=1e-4)


def test_morphing_mesh_has_targets_and_two_joints(tmp_path, face: Face, eye: np.ndarray) -> None:
    moves = np.zeros((1, *face.vertices.shape), np.float32)
    moves[0, np.flatnonzero(eye)[5]] = (0, 0.01, 0)
    none = np.zeros((0, 3), np.float32)
    made = MorphTargets(("up",), moves, none[:, :1], none, np.zeros((0, 2, 2), np.float32), none[:, :2])
    file = GlbFile()
    mesh = morphing_mesh(file, face, eye, 0, made)
    (primitive,) = mesh["primitives"]
    found = read(tmp_path, file)
    assert mesh["extras"] == {"targetNames": ["up"]}
    assert mesh["weights"] == [0.0]
    assert found.accessor(primitive["targets"][0]["POSITION"]) == pytest.approx(moves[0, eye])
    assert found.accessor(primitive["attributes"]["WEIGHTS_0"])[0].tolist() == [0.75, 0.25, 0, 0]
    assert found.accessor(primitive["attributes"]["JOINTS_0"])[0].tolist() == [0, 1, 0, 0]
