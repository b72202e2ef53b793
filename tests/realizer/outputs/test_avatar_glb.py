"""Somebody's own avatar with an animation, as three.js shows it."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from realizer.animation.arkit import ARKIT_NAMES, arkit
from realizer.face.glb_file import read_glb
from realizer.offline import realize
from realizer.outputs.vrma import expressions
from tests import avatars

pytestmark = pytest.mark.xdist_group("outputs")

FPS = 12.5
FRAMES = (0, 12, 20)


@pytest.fixture(scope="module")
def played(turn):
    return realize(turn, voice="silent", fps=FPS)


@pytest.fixture
def shown(played, tmp_path, read_by):
    """Return a function that animates an avatar and returns what three.js makes of it in some frames."""

    def show(content: bytes, **settings: Any) -> dict[str, Any]:
        (tmp_path / "mine.glb").write_bytes(content)
        path = played.save(tmp_path / "x.glb", avatar=tmp_path / "mine.glb", **settings)
        return read_by("gltf.mjs", path, *(str(frame / FPS) for frame in FRAMES))

    return show


def turned(played, frame: int, places: Any, head: Any) -> np.ndarray:
    """Return places after the head has turned: half by the neck, half by itself."""
    yaw, pitch, roll = arkit(played.aus, played.mapping).head[frame]
    half = Rotation.from_rotvec(Rotation.from_euler("YXZ", [yaw, pitch, roll]).as_rotvec() / 2)
    neck = head - np.array([0, 0.09, 0])
    return neck + half.apply(half.apply(places - head) + head - neck)


@pytest.mark.parametrize("how", [{}, {"twist": 5}, {"twist": 6, "matrices": True}, {"vrm": 1, "twist": 7}])
def test_avatar_turns_its_head_and_opens_its_mouth(played, shown, how):
    names = ("jawOpen", "mouthSmileLeft")
    seen = shown(avatars.avatar(names, expressions=dict(zip(names, names, strict=True)), **how))
    assert seen["issues"]["numErrors"] == seen["issues"]["numWarnings"] == 0
    weights = arkit(played.aus, played.mapping).weights
    head = np.array([0, 0.9 + 0.1 + 0.13 + 0.25 + 0.09, 0])
    corners = np.array([[-0.05, -0.03, 0.11], [0.05, -0.03, 0.11], [0.05, -0.02, 0.11], [-0.05, -0.02, 0.11]])
    for frame, meshes in zip(FRAMES, seen["frames"], strict=True):
        at = head + corners
        at[:2, 1] -= 0.03 * sum(weights[frame, ARKIT_NAMES().index(name)] for name in names)
        np.testing.assert_allclose(meshes["Mouth"], turned(played, frame, at, head), atol=1e-5)
    assert weights[list(FRAMES), ARKIT_NAMES().index("jawOpen")].max() > 0.1


def test_avatar_turns_its_eyes_in_the_head(played, shown):
    seen = shown(avatars.avatar(twist=8))
    head, frame = np.array([0, 1.47, 0]), FRAMES[-1]
    yaw, pitch = arkit(played.aus, played.mapping).eyes[frame, 0]
    assert abs(yaw) > 0.05
    ball = np.array([[-0.01, -0.01, 0.01], [0.01, -0.01, 0.01], [0.01, 0.01, 0.01], [-0.01, 0.01, 0.01]])
    at = head + avatars.EYES["leftEye"] + Rotation.from_euler("YX", [yaw, pitch]).apply(ball)
    np.testing.assert_allclose(seen["frames"][-1]["leftEye"], turned(played, frame, at, head), atol=1e-5)


def test_avatar_of_an_earlier_run_has_animations_of_different_names(played, tmp_path):
    (tmp_path / "mine.glb").write_bytes(avatars.avatar())
    first = played.save(tmp_path / "first.glb", avatar=tmp_path / "mine.glb")
    again = played.save(tmp_path / "again.glb", avatar=first)
    third = played.save(tmp_path / "third.glb", avatar=again)
    document, _ = read_glb(third.read_bytes())
    names = [animation["name"] for animation in document["animations"]]
    assert names == ["performance", "performance 3", "performance 2"], "the newest first"


def test_avatar_of_vrm_0_looks_back(played, shown):
    content = avatars.avatar(("a",), vrm=0, expressions={"aa": "a"})
    seen = shown(content)["frames"]
    ahead = shown(avatars.avatar(("jawOpen",)))["frames"]
    for back, front in zip(seen, ahead, strict=True):
        face = np.asarray(front["Face"]) * (-1, 1, -1)
        np.testing.assert_allclose(back["Face"], face, atol=1e-5)


@pytest.mark.parametrize("vrm", [0, 1])
def test_avatar_without_shapes_shows_the_expressions_of_vrm(played, shown, tmp_path, vrm):
    shown(avatars.avatar(("a", "b", "c"), vrm=vrm, expressions={"aa": "a", "ou": "c"}))
    rows = weights_in(tmp_path / "x.glb", 3)
    found = expressions(played)
    np.testing.assert_allclose(rows, np.stack([found["aa"], 0 * found["aa"], found["ou"]], axis=1), atol=1e-6)


def weights_in(path, count: int) -> np.ndarray:
    """Return the weights (n, targets) of the animation of the mouth."""
    document, data = read_glb(path.read_bytes())
    animation = document["animations"][0]
    channel = next(c for c in animation["channels"] if c["target"]["path"] == "weights")
    accessor = document["accessors"][animation["samplers"][channel["sampler"]]["output"]]
    start = document["bufferViews"][accessor["bufferView"]]["byteOffset"]
    return np.frombuffer(data, "<f4", accessor["count"], start).reshape(-1, count)


def test_avatar_keeps_its_own_animations_and_resting_weights(played, shown, tmp_path):
    (tmp_path / "first.glb").write_bytes(avatars.avatar(("jawOpen", "hat")))
    document, data = read_glb(played.save(tmp_path / "first.glb", avatar=tmp_path / "first.glb").read_bytes())
    document["meshes"][1]["weights"] = [0.0, 0.25]
    document["animations"][0]["name"] = "dance"
    from realizer.face.glb_file import GlbFile

    shown(GlbFile(document, data).bytes_of(document))
    written, _ = read_glb((tmp_path / "x.glb").read_bytes())
    assert [animation["name"] for animation in written["animations"]] == ["performance", "dance"]
    assert set(weights_in(tmp_path / "x.glb", 2)[:, 1]) == {0.25}


@pytest.mark.slow
def test_avatar_made_of_our_own_face_is_valid(turn, tmp_path, read_by):
    played = realize(turn, voice="silent", fps=2)
    played.save(tmp_path / "mine.glb", morphs="arkit")
    path = played.save(tmp_path / "x.glb", avatar=str(tmp_path / "mine.glb"))
    seen = read_by("gltf.mjs", path)
    assert seen["issues"]["messages"] == []
    assert json.dumps(seen["targets"]) == json.dumps(list(ARKIT_NAMES()))


def test_avatar_that_lacks_shapes_is_warned_of_once(played, tmp_path, caplog):
    (tmp_path / "mine.glb").write_bytes(avatars.avatar())
    played.save(tmp_path / "x.glb", avatar=tmp_path / "mine.glb")
    assert len(caplog.messages) == 1
    assert "mine.glb: lacks ARKit's eyeBlinkLeft, eyeBlinkRight, mouthFunnel" in caplog.text
    assert caplog.messages[0].endswith(" and 34 more")


def test_avatar_is_for_glb_files_alone(played, tmp_path):
    with pytest.raises(ValueError, match=r"avatar: wanted a \.glb file"):
        played.save(tmp_path / "x.mp4", avatar="mine.glb")
    with pytest.raises(TypeError, match="avatar: wanted a path"):
        played.save(tmp_path / "x.glb", avatar=7)
