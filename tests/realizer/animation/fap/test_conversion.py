"""The conversion of AUs to FAPs."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer import tables
from realizer.animation.axis import AU_NAMES, au, axis, fap, mask_channel
from realizer.animation.fap.conversion import FapMapping, PiecewiseMatrix, standard, to_fap
from realizer.animation.frames import AUFrames
from realizer.core.array_types import Float32
from realizer.tables import AuToFap

PAIRS = [(4, 5), (8, 10), (9, 11), (51, 52), (55, 57), (56, 58)]


def frames(*rows: dict[str, float]) -> AUFrames:
    values = np.zeros((len(rows), len(axis())), np.float32)
    for k, row in enumerate(rows):
        for name, value in row.items():
            values[k, axis()[name].column] = value
    return AUFrames(np.arange(len(rows)) / 25, values)


def shown(**aus: float) -> Float32:
    clip = frames({name.removeprefix("au"): value for name, value in aus.items()})
    row: Float32 = to_fap(clip).values[0]
    return row


def value(number: int, **aus: float) -> float:
    return float(shown(**aus)[number - 1])


faces = st.dictionaries(st.sampled_from(AU_NAMES()), st.floats(0.0, 1.0, width=32), max_size=8)


def test_to_fap_of_a_face_at_rest_is_zero() -> None:
    assert not to_fap(frames({}, {})).values.any()


def test_to_fap_is_linear_in_an_action_unit() -> None:
    most = {row.key: row.fap_to for row in tables.au_to_fap()}[12, "L", 12]
    assert value(12, au12L=0.5) == pytest.approx(most / 2)
    assert value(12, au12L=1.0) == pytest.approx(most)
    assert value(13, au12L=1.0) == 0


def test_to_fap_adds_the_strongest_value_of_each_sign() -> None:
    up, down = value(33, au1L=1.0), value(33, au4L=1.0)
    assert up > 0 > down
    assert value(33, au1L=1.0, au4L=1.0) == pytest.approx(up + down)
    outer, joined = value(5, au25=1.0), value(5, au25=1.0, au26=1.0)
    assert joined == pytest.approx(min(outer, value(5, au26=1.0)))


def test_to_fap_adds_rotations() -> None:
    assert value(49, au51=0.5, au52=0.2) == pytest.approx(0.3 * value(49, au51=1.0), rel=1e-5)
    assert value(23, au61=0.5, au65=0.5) == pytest.approx(value(23, au61=0.5) + value(23, au65=0.5), rel=1e-5)


def test_to_fap_bends_at_knots_and_is_constant_after_the_last() -> None:
    rows = (AuToFap(26, "", 3, 0.2, 0.6, 0.0, 100.0), AuToFap(26, "", 3, 0.6, 0.8, 100.0, 300.0))
    au = np.array([0.0, 0.2, 0.4, 0.6, 0.7, 0.8, 1.0])
    got = to_fap(frames(*({"26": v} for v in au)), FapMapping(rows, ())).values[:, 2]
    assert got == pytest.approx([0, 0, 50, 100, 200, 300, 300], abs=1e-3)


@cache
def mirrors() -> tuple[list[int], Float32]:
    rows = tables.faps()
    return [row.mirror - 1 for row in rows], np.array([row.sign for row in rows], np.float32)


def mirrored(name: str) -> str:
    turns = {"51": "52", "52": "51", "55": "56", "56": "55", "61": "62", "62": "61"}
    return turns.get(name, name.translate(str.maketrans("LR", "RL")))


@given(faces)
def test_to_fap_swaps_sides_with_the_aus(face: dict[str, float]) -> None:
    one = to_fap(frames(face)).values
    other = to_fap(frames({mirrored(name): value for name, value in face.items()})).values
    columns, signs = mirrors()
    np.testing.assert_allclose(other, one[:, columns] * signs, atol=0.01)


@given(faces)
def test_to_fap_limits_every_fap_to_its_range(face: dict[str, float]) -> None:
    values = to_fap(frames(face, {"open_jaw": 1e6, "head_yaw": -1e6})).values
    assert np.all(values >= [row.least for row in tables.faps()])
    assert np.all(values <= [row.most for row in tables.faps()])


@given(st.lists(faces, min_size=2, max_size=6))
def test_to_fap_converts_each_frame_by_itself(clip: list[dict[str, float]]) -> None:
    together = to_fap(frames(*clip)).values
    alone = np.concatenate([to_fap(frames(face)).values for face in clip])
    np.testing.assert_allclose(together, alone, rtol=1e-5, atol=1e-3)


@pytest.mark.parametrize("jaw", ["26", "27"])
@given(face=faces)
def test_to_fap_widens_the_lip_gap_as_the_jaw_drops(jaw: str, face: dict[str, float]) -> None:
    clip = [{**face, jaw: float(v)} for v in np.linspace(0, 1, 9)]
    values = to_fap(frames(*clip)).values
    for upper, lower in PAIRS:
        gap = -(values[:, upper - 1] + values[:, lower - 1])
        assert np.all(np.diff(gap) >= -0.01)


@given(faces, st.sampled_from(["43", "45"]))
def test_to_fap_shuts_eyes_whatever_else_the_face_does(face: dict[str, float], au: str) -> None:
    values = to_fap(frames({**face, f"{au}L": 1.0, f"{au}R": 1.0})).values[0]
    assert values[18] + values[20] == pytest.approx(1024, abs=0.1)
    assert values[19] + values[21] == pytest.approx(1024, abs=0.1)


@given(faces)
def test_to_fap_never_crosses_lids(face: dict[str, float]) -> None:
    values = to_fap(frames(face)).values[0]
    assert values[18] + values[20] <= 1024.1
    assert values[19] + values[21] <= 1024.1


def test_to_fap_moves_lids_with_the_eyes() -> None:
    assert value(19, au63=1.0) < 0 < value(19, au64=1.0)


def test_to_fap_masks_lips_in_speech_but_not_brows() -> None:
    smile = {"12L": 1.0, "12R": 1.0, "26": 1.0, "1L": 1.0}
    silent, speaking = to_fap(frames(smile, {**smile, "lips": 1.0})).values
    owned = np.array([row.speech_owns for row in tables.faps()])
    np.testing.assert_allclose(speaking, silent * (1 - owned), atol=0.01)
    assert speaking[2] == 0
    assert speaking[11] > 0
    assert speaking[30] == silent[30] != 0


def test_to_fap_adds_faps_of_speech_unchanged() -> None:
    both = to_fap(frames({"26": 1.0, "lips": 1.0, "open_jaw": 200.0}))
    assert both.values[0, 2] == 200


def test_to_fap_mask_is_constant_and_without_compound_faps() -> None:
    masks = [to_fap(frames(face)).mask for face in ({}, {"12L": 1.0}, {"open_jaw": 9.0})]
    assert all((mask == masks[0]).all() for mask in masks)
    assert not masks[0][:2].any()
    assert masks[0][[row.fap - 1 for row in tables.au_to_fap()]].all()
    assert masks[0][45]  # the tongue of speech


def test_to_fap_reads_the_columns_of_speech_and_masks() -> None:
    clip = frames({"head_roll": 5.0, "lips": 0.5})
    assert clip.faps[0, 49] == 5
    assert fap(50).name == "head_roll"
    assert clip.values[0, mask_channel("lips").column] == 0.5


@pytest.mark.parametrize(("inner", "middle", "side"), [(31, 33, "L"), (32, 34, "R")])
def test_to_fap_lifts_the_brow_in_one_arch(inner: int, middle: int, side: str) -> None:
    one, two = {f"au1{side}": 1.0}, {f"au2{side}": 1.0}
    assert value(middle, **one, **two) > max(value(middle, **one), value(middle, **two))
    assert 0 < value(inner, **one, **two) < value(inner, **one)


def test_to_fap_scales_combinations_by_their_weaker_unit() -> None:
    def more(first: float, second: float) -> float:
        both = value(33, au1L=first, au2L=second)
        return both - max(value(33, au1L=first), value(33, au2L=second))

    assert more(1.0, 0.0) == 0
    assert more(1.0, 0.5) == pytest.approx(more(0.5, 1.0)) == pytest.approx(more(1.0, 1.0) / 2)


AT = (0.0, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 1.0)


def asked(rows: tuple[AuToFap, ...], fap: int) -> Float32:
    """Return the values of a FAP as AU26 rises."""
    aus = np.zeros((len(AU_NAMES()), len(AT)), np.float32)
    aus[au(26)[0].column] = AT
    raised, lowered, turned = PiecewiseMatrix.of(rows).evaluate(aus)
    found: Float32 = (raised - lowered + turned)[fap - 1]
    return found


def test_matrix_is_constant_between_two_pieces() -> None:
    rows = (AuToFap(26, "", 3, 0.1, 0.3, 0.0, 100.0), AuToFap(26, "", 3, 0.7, 0.9, 100.0, 300.0))
    assert asked(rows, 3) == pytest.approx([0, 0, 50, 100, 100, 100, 300, 300], abs=1e-3)


def test_matrix_of_no_rows_is_zero() -> None:
    assert not asked((), 3).any()


def test_matrix_mask_has_the_faps_of_rows_and_speech() -> None:
    mask = PiecewiseMatrix.of((AuToFap(9, "L", 63, 0.0, 1.0, 0.0, 30.0),)).mask
    assert mask[62]
    assert mask[2]  # speech opens the jaw
    assert not mask[[0, 1, 30]].any()


def test_matrix_separates_raising_and_lowering() -> None:
    rows = (AuToFap(26, "", 3, 0.0, 0.5, 0.0, 100.0), AuToFap(26, "", 3, 0.5, 1.0, 100.0, -100.0))
    aus = np.zeros((len(AU_NAMES()), len(AT)), np.float32)
    aus[au(26)[0].column] = AT
    raised, lowered, _ = PiecewiseMatrix.of(rows).evaluate(aus)
    assert np.flatnonzero(raised.any(axis=1)).tolist() == [2]
    assert raised[2] == pytest.approx([0, 20, 40, 60, 100, 20, 0, 0], abs=1e-3)
    assert lowered[2] == pytest.approx([0, 0, 0, 0, 0, 0, 60, 100], abs=1e-3)


def test_matrix_closed_is_the_greatest_value_of_each_fap() -> None:
    rows = (AuToFap(43, "L", 19, 0.0, 1.0, 0.0, 200.0), AuToFap(7, "L", 19, 0.0, 1.0, 0.0, 900.0))
    closed = PiecewiseMatrix.of(rows).closed
    assert closed[18] == 900
    assert np.count_nonzero(closed) == 1


def test_standard_mapping_is_the_table() -> None:
    assert standard().rows == tables.au_to_fap()
    assert standard() is standard()


def test_mapping_replaces_units_completely_on_one_side() -> None:
    own = AuToFap(12, "L", 6, 0.0, 1.0, 0.0, 99.0)
    mapping = standard().replaced({(12, "L"): (own,)}, "mine")
    assert [row for row in mapping.rows if (row.au, row.side) == (12, "L")] == [own]
    others = [row for row in mapping.rows if (row.au, row.side) != (12, "L")]
    assert others == [row for row in standard().rows if (row.au, row.side) != (12, "L")]
    assert mapping.sources == ("au_to_fap.csv", "mine")


def test_mapping_replaces_a_unit_by_nothing() -> None:
    mapping = standard().replaced({(25, ""): ()}, "mine")
    assert 25 not in {row.au for row in mapping.rows}
