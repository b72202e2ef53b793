import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from realizer_studio.corpus.matching_pursuit import explain

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
