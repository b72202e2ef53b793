"""The reader of FAP files."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.animation.fap.fap_clip import FAPClip
from realizer.animation.fap.fap_reader import read_fap
from realizer.animation.frames import FAPFrames
from realizer.core.errors import RealizerError
from tests.rows import each_row

JAW, LIP = 3, 4


def mask(*used: int, columns: int = 68) -> str:
    first = 0 if columns == 69 else 1
    return " ".join("1" if fap in used else "0" for fap in range(first, 69))


def clip(**faps) -> FAPClip:
    count = len(next(iter(faps.values()), []))
    values = np.zeros((count, 68), np.int32)
    used = np.zeros(68, bool)
    for name, column in faps.items():
        fap = int(name[3:])
        values[:, fap - 1], used[fap - 1] = column, True
    return FAPClip("x", 25, values, used, np.zeros((count, 4), np.int32), np.zeros((count, 6), np.int32))


PLAIN = clip(fap3=[10, 20], fap4=[-1, -2])


M = mask(JAW, LIP)


BODY = f"{M}\n0 10 -1\n{M}\n1 20 -2\n"


# Text, the clip that it means, and words of the expected note (None: no note).
ODD = {
    "plain": (f"2.1 x 25 2\n{BODY}", PLAIN, None),
    "leading comment": (f"# by hand\n2.1 x 25 2\n{BODY}", PLAIN, None),
    "byte order mark": (f"\ufeff2.1 x 25 2\n{BODY}", PLAIN, None),
    "crlf": (f"2.1 x 25 2\n{BODY}".replace("\n", "\r\n"), PLAIN, None),
    "tabs": (f"2.1 x 25 2\n{M}\n0\t10\t-1\n{M}\n1\t20\t-2\n", PLAIN, None),
    "trailing blanks": (f"2.1 x 25 2\n{BODY}".replace("\n", " \n"), PLAIN, None),
    "blank lines": (f"\n2.1 x 25 2\n\n{BODY}\n\n".replace(f"\n{M}", f"\n\n{M}"), PLAIN, None),
    "no last newline": (f"2.1 x 25 2\n{BODY}".rstrip(), PLAIN, None),
    "name with a path": (f"2.1 C:\\faps\\x.fap 25 2\n{BODY}", PLAIN, None),
    "name with blanks": (f"2.1 my best clip.fap 25 2\n{BODY}", PLAIN, "blanks"),
    "no name": (f"2.1 25 2\n{BODY}", PLAIN, "no name"),
    "version 2.0": (f"2.0 x 25 2\n{BODY}", PLAIN, "version 2.0"),
    "no header": (BODY, PLAIN, "no header"),
    "a network message": (f"\n{M}\n910 10 -1\n{M}\n911 20 -2\n", PLAIN, "910"),
    "frames from 1": (f"2.1 x 25 2\n{M}\n1 10 -1\n{M}\n2 20 -2\n", PLAIN, "numbered from 1"),
    "frames out of order": (f"2.1 x 25 2\n{M}\n1 20 -2\n{M}\n0 10 -1\n", PLAIN, None),
    "count too high": (f"2.1 x 25 9\n{BODY}", PLAIN, "says 9 frames, the file has 2"),
    "count too low": (f"2.1 x 25 1\n{BODY}", PLAIN, "says 1 frames, the file has 2"),
    "rate 0": (f"2.1 x 0 2\n{BODY}", PLAIN, "frame rate"),
    "69 columns": (
        f"2.1 x 25 2\n{BODY}".replace(M, mask(JAW, LIP, columns=69)),
        PLAIN,
        "69 columns",
    ),
    "69 columns, null FAP given": (
        f"2.1 x 25 1\n{mask(0, JAW, columns=69)}\n0 77 10\n",
        clip(fap3=[10]),
        "69 columns",
    ),
    "single frame": (f"2.1 x 25 1\n{M}\n0 10 -1\n", clip(fap3=[10], fap4=[-1]), None),
    "no frames": ("2.1 x 25 0\n", clip(), None),
    "mask cut off": (f"2.1 x 25 2\n{BODY}{M}\n", PLAIN, None),
    "mask varies": (
        f"2.1 x 25 2\n{mask(JAW)}\n0 10\n{M}\n1 20 -2\n",
        clip(fap3=[10, 20], fap4=[0, -2]),
        "mask varies",
    ),
    "empty mask": (
        f"2.1 x 25 1\n{mask()}\n0\n",
        FAPClip.of(FAPFrames(np.zeros(1), np.zeros((1, 68), np.float32), np.zeros(68, bool)), 25, "x"),
        None,
    ),
    "beyond the range": (f"2.1 x 25 1\n{mask(JAW)}\n0 99999\n", clip(fap3=[99999]), "open_jaw"),
    "negative one-way FAP": (f"2.1 x 25 1\n{mask(JAW)}\n0 -5\n", clip(fap3=[-5]), "open_jaw"),
    "floats": (f"2.1 x 25 1\n{M}\n0 10.4 -1.0\n", clip(fap3=[10], fap4=[-1]), "not integers"),
    "garbage": (f"2.1 x 25 1\n{M}\n0 inf abc\n", clip(fap3=[0], fap4=[0]), "not a number"),
    "value missing": (f"2.1 x 25 1\n{M}\n0 10\n", clip(fap3=[10], fap4=[0]), "wanted 2 values, got 1"),
    "value too many": (f"2.1 x 25 1\n{M}\n0 10 -1 5\n", clip(fap3=[10], fap4=[-1]), "wanted 2 values, got 3"),
    "frame twice": (f"2.1 x 25 2\n{M}\n0 1 1\n{M}\n0 10 -1\n", clip(fap3=[10], fap4=[-1]), "twice"),
    "frame gap": (
        f"2.1 x 25 2\n{M}\n0 10 -1\n{M}\n2 20 -2\n",
        clip(fap3=[10, 0, 20], fap4=[-1, 0, -2]),
        "gaps",
    ),
    "frames broken over lines": (
        f"2.1 x 25 2\n{BODY}".replace(" 0 0 0 0 ", " 0 0\n0 0 ").replace("10 -1", "10\n-1"),
        PLAIN,
        "not lines",
    ),
    "a frame a line": (f"2.1 x 25 2\n{M} 0 10 -1\n{M} 1 20 -2\n", PLAIN, "not lines"),
    "all frames in one line": (
        f"2.1 x 25 2\n{BODY}".replace("\n", " ").replace("25 2 ", "25 2\n"),
        PLAIN,
        "not lines",
    ),
    "wild frame numbers": (f"2.1 x 25 2\n{M}\n0 10 -1\n{M}\n2000000000 20 -2\n", PLAIN, "far apart"),
}


@each_row("case", ODD)
def test_read_fap_tolerates(case):
    text, wanted, note = ODD[case]
    got = read_fap(text)
    assert np.array_equal(got.values, wanted.values)
    assert np.array_equal(got.mask, wanted.mask)
    assert got.fps == 25
    assert (got.notes == ()) if note is None else any(note in n for n in got.notes), got.notes
    assert read_fap(text.encode()) == got


@pytest.mark.parametrize("fps", [2, 5, 10, 12.5, 25, 30, 60])
def test_read_fap_uses_the_rate_of_the_header(fps):
    got = read_fap(f"2.1 x {fps} 2\n{BODY}")
    assert got.fps == fps
    assert got.frames().times[1] == pytest.approx(1 / fps)


@pytest.mark.parametrize(
    ("values", "viseme", "expression", "jaw"),
    [
        ("0 3 0 63 0 2 40 0 0 1 0 10", [3, 0, 63, 0], [2, 40, 0, 0, 1, 0], 10),
        ("0 500 2 40 0 0 1 0 10", [500, 0, 0, 0], [2, 40, 0, 0, 1, 0], 10),
        ("0 3 0 63 0 2 10", [3, 0, 63, 0], [2, 0, 0, 0, 0, 0], 10),
        ("0 500 2 10", [500, 0, 0, 0], [2, 0, 0, 0, 0, 0], 10),
    ],
)
def test_read_fap_reads_compound_faps_of_one_number(values, viseme, expression, jaw):
    got = read_fap(f"2.1 x 25 1\n{mask(1, 2, JAW)}\n{values}\n")
    assert got.visemes[0].tolist() == viseme
    assert got.expressions[0].tolist() == expression
    assert got.values[0, 2] == jaw
    assert not got.frames().mask[:2].any()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("3.1 walk 25 10\n", "line 1: wanted FAP version 2.0 or 2.1, got 3.1: body animation"),
        ("hello world\n", "line 1: wanted a header"),
        (f"2.1 x 25 1\n0 1 0\n0 5\n{M}\n", "line 2: wanted a mask of 68 columns, got 3"),
    ],
)
def test_read_fap_refuses_other_texts_with_their_line(text, message):
    with pytest.raises(RealizerError, match=re.escape(message)):
        read_fap(text)


@given(st.text(max_size=200))
def test_read_fap_reads_or_refuses_any_text(text):
    try:
        assert read_fap(text).values.shape[1:] == (68,)
    except RealizerError as error:
        assert "wanted" in str(error)  # noqa: PT017


@pytest.mark.parametrize("digits", [20, 5000])
def test_read_fap_refuses_or_reads_numbers_of_thousands_of_digits(digits: int) -> None:
    number = "9" * digits
    with pytest.raises(RealizerError, match="wanted a"):
        read_fap(f"2.1 x 25 1\n{mask(JAW).replace('1', number, 1)}\n0 100\n")
    clip = read_fap(f"2.1 x 25 {number}\n{mask(JAW)}\n0 {number}\n")
    assert len(clip.values) == 1
