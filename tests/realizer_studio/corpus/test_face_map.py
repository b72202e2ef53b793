"""Tests of `realizer_studio.corpus.face_map`."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer_studio.corpus.face_map import (
    SIDE,
    borders,
    explain,
    features,
    learn,
    load,
    picture,
    save,
    template_faps,
    train,
)
from realizer_studio.corpus.recording import Annotation, CorpusError, Recording


def acted(seed: int, frames: int = 4000, labelled: bool = True) -> Recording:
    """A face with templates at random times, a mouth that speaks, and noise."""
    chance, shown = np.random.default_rng(seed), template_faps()
    values, labels, at = np.zeros((frames, 68)), [], 20
    while at < frames - 120:
        name = str(chance.choice(["surprise", "anger", "happiness", "disgust"], p=[0.4, 0.3, 0.2, 0.1]))
        length = int(chance.integers(12, 60))
        there = np.zeros(frames)
        there[at : at + length] = chance.uniform(0.6, 1.1)
        values += np.convolve(there, np.ones(6) / 6, "same")[:, None] * shown[name]
        labels.append(Annotation(at / 25, (at + length) / 25, name, "eva"))
        at += length + int(chance.integers(15, 70))
    values[:, 2] += 60 * np.convolve(chance.uniform(0, 1, frames), np.ones(3) / 3, "same")
    values += chance.normal(0, 8, values.shape)
    return Recording(f"r{seed}", {}, tuple(labels) if labelled else (), faps=values)


def test_learn_keeps_nine_tenths_of_the_variance() -> None:
    recording = acted(0)
    learnt = learn([recording])
    frames = features(recording) - learnt.mean
    kept = np.square(learnt.project(features(recording))).sum() / np.square(frames).sum()
    fewer = np.square(frames @ learnt.components[:-1].T).sum() / np.square(frames).sum()
    assert fewer < 0.9 <= kept
    assert np.allclose(learnt.components @ learnt.components.T, np.eye(len(learnt.components)))


def test_learn_names_cells_by_labels_or_templates() -> None:
    labelled = learn([acted(0)])
    assert {"surprise", "anger", "happiness"} <= set(labelled.names)
    bare = learn([acted(0, labelled=False)])
    assert {"surprise", "happiness"} <= set(bare.names)
    # Cells have the same faces, and most of those with a label have the same name.
    assert np.allclose(labelled.neurons, bare.neurons)
    both = [(a, b) for a, b in zip(labelled.names, bare.names, strict=True) if a in ("surprise", "happiness")]
    assert np.mean([a == b for a, b in both]) > 0.7


def test_learn_is_the_same_twice() -> None:
    assert np.array_equal(learn([acted(1)]).neurons, learn([acted(1)]).neurons)


def test_train_puts_similar_neurons_side_by_side() -> None:
    corners = np.array([[0.0, 0.0], [10.0, 0.0], [0.0, 10.0], [10.0, 10.0]])
    chance = np.random.default_rng(0)
    frames = np.concatenate([corner + chance.normal(0, 0.5, (200, 2)) for corner in corners])
    neurons = train(frames)
    apart = borders(neurons)[::2, 1::2]
    spread = np.linalg.norm(neurons[:, None] - neurons, axis=-1)
    assert np.median(apart) < 0.3 * np.median(spread)
    assert min(np.linalg.norm(neurons - corner, axis=1).min() for corner in corners) < 1
    assert all(np.linalg.norm(neurons - corner, axis=1).min() < 1 for corner in corners)


def test_borders_are_distances_of_neighbours() -> None:
    neurons = np.indices((SIDE, SIDE)).reshape(2, -1).T.astype(float)
    assert np.allclose(borders(neurons), 1)
    neurons[::SIDE] -= [0, 4]  # the first column
    assert np.allclose(borders(neurons)[::2, 1], 5)
    assert np.allclose(borders(neurons)[0, 0], (5 + 1) / 2)


def test_save_is_loaded_with_names_changed_by_hand(tmp_path: Path) -> None:
    learnt = learn([acted(0)])
    save(tmp_path, learnt)
    cells = tmp_path / "map.toml"
    cells.write_text(cells.read_text().replace("surprise", "astonishment"))
    back = load(tmp_path)
    assert np.array_equal(back.neurons, learnt.neurons)
    assert back.names == tuple(name.replace("surprise", "astonishment") for name in learnt.names)
    assert picture(learnt).shape == (28 * 19, 28 * 19)
    assert (tmp_path / "map.png").is_file()
    cells.write_text("cells = [['a']]")
    with pytest.raises(CorpusError, match="wanted 10 rows of 10 names, got 1"):
        load(tmp_path)
    with pytest.raises(CorpusError, match="make it by `realizer corpus learn`"):
        load(tmp_path / "none")


def test_features_of_points_ignore_pose_size_and_lost_points() -> None:
    chance = np.random.default_rng(0)
    rest = chance.normal(0, 1, (20, 3))
    moved = np.repeat(rest[None], 30, axis=0)
    moved[:, 3, 1] += np.linspace(0, 0.5, 30)
    turn = np.linalg.qr(chance.normal(0, 1, (3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    names = tuple(map(str, range(20)))
    still = features(Recording("x", points=(names, moved)))
    turned = features(Recording("x", points=(names, 7 * moved @ turn + 3)))
    between = np.linalg.norm(still[:, None] - still, axis=-1)
    assert np.allclose(np.linalg.norm(turned[:, None] - turned, axis=-1), between, atol=1e-6)
    lost = moved.copy()
    lost[10, 3] = np.nan
    assert np.allclose(features(Recording("x", points=(names, lost))), still, atol=1e-3)


def test_learn_refuses_what_it_cannot_learn_from() -> None:
    with pytest.raises(CorpusError, match="wanted FAPs or points, got none"):
        learn([Recording("x")])
    with pytest.raises(CorpusError, match="wanted 333 frames that differ, got 100"):
        learn([replace(acted(0), faps=np.zeros((100, 68)))])
    points = ("a", "b"), np.random.default_rng(0).normal(0, 1, (600, 2, 3))
    with pytest.raises(CorpusError, match="wanted FAPs, or the same points"):
        learn([acted(0), Recording("y", points=points)])


SHAPES = np.array([[2.0, 0, 0, 0], [1, 1, 0, 0], [0, 0, 3, 0], [0, 0, 0, 0]])


@given(st.lists(st.tuples(st.floats(0.2, 2), st.floats(0.2, 2)), min_size=1, max_size=5))
def test_explain_finds_the_shapes_that_faces_are_made_of(pairs) -> None:  # type: ignore[no-untyped-def]
    faces = np.array([a * SHAPES[0] + b * SHAPES[2] for a, b in pairs])
    chosen, weights = explain(faces, SHAPES, most=4, least_gain=1e-6)
    assert sorted(chosen) == [0, 2]
    assert np.allclose(weights @ SHAPES[chosen], faces)


def test_explain_never_shows_a_shape_reversed() -> None:
    chosen, weights = explain(-SHAPES[:3], SHAPES, most=4, least_gain=0.01)
    assert chosen == []
    assert weights.shape == (3, 0)


def test_explain_leaves_out_a_shape_that_is_not_worth_it() -> None:
    face = np.array([[2.0, 0, 0.3, 0]])  # the second of both explains 2.2 % of the squared movement
    assert explain(face, SHAPES, most=4, least_gain=0.03)[0] == [0]
    assert explain(face, SHAPES, most=4, least_gain=0.02)[0] == [0, 2]
    assert explain(face, SHAPES, most=1, least_gain=0.02)[0] == [0]


def test_explain_of_a_face_at_rest_needs_no_shape() -> None:
    assert explain(np.zeros((2, 4)), SHAPES, most=4, least_gain=0.02)[0] == []
