"""Tests of faps and fapFile."""

from pathlib import Path

import numpy as np
import pytest

from realizer.animation.fap.fap_clip import FAPClip
from realizer.offline import realize
from realizer.outputs.fap_text import encode

AT = 'start="0" attackPeak="0.5" relax="1.5" end="2"'


def faps(*pairs: tuple[int, float], sync: str = AT, id: str = "f") -> str:
    inside = "".join(f'<own:fap number="{n}" value="{v}"/>' for n, v in pairs)
    return f'<own:faps id="{id}" {sync}>{inside}</own:faps>'


def test_faps_hold_their_values_from_attack_peak_to_relax(play) -> None:
    played = play(faps((31, 150), (5, -80)))
    assert [played.fap(31, t) for t in (0, 0.5, 1.0, 1.5, 2.0)] == [0, 150, 150, 150, 0]
    assert [played.fap(5, t) for t in (0, 0.5, 1.0, 1.5, 2.0)] == [0, -80, -80, -80, 0]
    assert 0 < played.fap(31, 0.2) < 150
    assert played.fap(32, 1.0) == 0


def test_faps_override_other_behaviours(play) -> None:
    smile = '<faceLexeme id="s" lexeme="SMILE" amount="0.5" start="0" attackPeak="0.5" relax="1.5" end="2"/>'
    alone = play(smile).fap(12, 1.0)
    assert alone > 0
    for value in (40, 0, -30):
        both = play(smile + faps((12, value)))
        assert both.fap(12, 1.0) == pytest.approx(value)
        assert both.fap(13, 1.0) == pytest.approx(alone)


def test_faps_beyond_their_range_are_limited_with_a_warning(play) -> None:
    played = play(faps((19, 5000)))
    assert played.warnings == [("b:f", "CUSTOM_ATTRIBUTE_NOT_SUPPORTED")]
    assert "wanted -1080..1080, got 5000" in played.warnings_text
    assert played.fap(19, 1.0) == 1080


def test_faps_with_a_repeated_number_are_a_fault(play) -> None:
    played = play(faps((31, 10), (31, 20)))
    assert played.warnings == [("b:f", "CANNOT_CREATE_BEHAVIOR")]
    assert "31 (raise_l_i_eyebrow) twice" in played.warnings_text


def test_faps_of_two_behaviours_conflict(play) -> None:
    played = play(faps((31, 10), id="one") + faps((31, 20), (33, 5), id="two"))
    assert [id for id, _ in played.warnings] == ["b:two"]
    assert played.fap(31, 1.0) == 10
    assert play(faps((31, 10), id="one") + faps((33, 20), id="two")).warnings == []


def test_fap_file_plays_from_start_to_end(play, media: Path) -> None:
    played = play('<own:fapFile id="f" fileName="smile.fap" start="1"/>', media=media)
    assert played.warnings == []
    assert played.times("f") == {"start": 1, "end": 1.4}
    assert [played.fap(12, t) for t in (1.0, 1.1, 1.2, 1.25, 1.3, 1.4)] == pytest.approx(
        [0, 100, 200, 150, 100, 0], abs=1e-3
    )
    assert played.fap(31, 1.2) == 0


def test_fap_file_stretches_to_its_times(play, media: Path) -> None:
    played = play('<own:fapFile id="f" fileName="smile.fap" start="1" end="3"/>', media=media)
    assert [played.fap(13, t) for t in (1.0, 1.5, 2.0, 2.5, 3.0)] == pytest.approx([0, 100, 200, 100, 0])


def test_fap_file_plays_back_what_we_write(play, media: Path) -> None:
    document = '<bml id="b"><faceLexeme id="s" lexeme="SURPRISE"/><head id="h" lexeme="NOD"/></bml>'
    first = realize(document, fps=25, idle=False)
    (media / "own.fap").write_text(encode(FAPClip.of(first.faps, 25, "own")), "utf-8")
    again = play('<own:fapFile id="f" fileName="own.fap"/>', media=media)
    assert again.warnings == []
    np.testing.assert_allclose(again.realization.faps.values[::4], first.faps.integers(), atol=0.01)


def test_fap_file_that_does_not_begin_at_rest_is_eased(play, media: Path) -> None:
    values = np.zeros((51, 68), np.int32)
    values[:, 30] = 200
    mask = np.arange(68) == 30
    clip = FAPClip("held", 25, values, mask, np.zeros((51, 4), np.int32), np.zeros((51, 6), np.int32))
    (media / "held.fap").write_text(encode(clip), "utf-8")
    played = play('<own:fapFile id="f" fileName="held.fap"/>', media=media)
    course = played.realization.faps.values[:, 30]
    assert course[0] == course[-1] == 0
    assert course[20:-20] == pytest.approx(200)
    assert np.abs(np.diff(course)).max() < 25


def with_compound(media: Path, viseme: str, expression: str) -> None:
    """Return a file v.fap of a second with these values and FAP 31."""
    mask = " ".join("1" if fap in (1, 2, 31) else "0" for fap in range(1, 69))
    lines = [f"{mask}\n{k} {viseme} {expression} {10 * (k % 2)}" for k in range(26)]
    (media / "v.fap").write_text("\n".join(["2.1 v 25 26", *lines]), "utf-8")


def test_fap_file_shows_visemes_and_expressions(play, media: Path) -> None:
    with_compound(media, "10 0 63 0", "6 63 0 0 0 0")
    played = play('<own:fapFile id="f" fileName="v.fap"/>', media=media)
    assert played.warnings == []
    assert played.fap(5, 0.5) < -300, "the mouth says a"
    assert played.fap(32, 0.5) > 100, "a brow is surprised"
    assert played.fap(31, 0.52) == pytest.approx(10), "the other one is as the file says"


def test_fap_file_warns_of_visemes_that_cannot_be_shown(play, media: Path) -> None:
    with_compound(media, "500 0 63 0", "7 63 0 0 0 0")
    played = play('<own:fapFile id="f" fileName="v.fap"/>', media=media)
    assert played.warnings == [("b:f", "CUSTOM_ATTRIBUTE_NOT_SUPPORTED")]
    assert "FAP 1: wanted visemes 0..14, got 500: shown as none; FAP 2: wanted" in played.warnings_text


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("hello", "wanted a header"),
        ("2.1 x 25 1\n" + "0 " * 68 + "\n0\n", "wanted at least two frames, got 1"),
        ("3.1 x 25 1\n", "body animation"),
        pytest.param("#" * (8 * 2**20 + 1), "wanted at most 8 MiB of FAP text", id="too-large"),
    ],
)
def test_fap_file_that_cannot_be_read_is_dropped(play, media: Path, content: str, says: str) -> None:
    (media / "bad.fap").write_text(content, "utf-8")
    played = play('<own:fapFile id="f" fileName="bad.fap"/><head id="h" lexeme="NOD"/>', media=media)
    assert played.warnings == [("b:f", "CANNOT_CREATE_BEHAVIOR")]
    assert says in played.warnings_text
    assert "bad.fap" in played.warnings_text
    assert played.times("h")
