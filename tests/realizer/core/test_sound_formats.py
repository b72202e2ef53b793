"""Tests of the table of formats of sound files."""

from realizer.core.sound_formats import FORMATS, SUFFIXES, format_of, without_id3
from tests.rows import each_row


def test_no_suffix_is_of_two_formats() -> None:
    assert len(set(SUFFIXES)) == len(SUFFIXES)
    assert all(suffix.startswith(".") and suffix == suffix.lower() for suffix in SUFFIXES)


@each_row(
    "content, name",
    [
        (b"RIFF\0\0\0\0WAVEfmt ", "wav"),
        (b"RIFF\n\n\n\nWAVE", "wav"),
        (b"RIFF\0\0\0\0AVI ", None),
        (b"\0\0\0\x1cftypM4A ", "mov"),
        (b"FORM\0\0\0\0AIFC", "aiff"),
        (b"\xff\xfb\x90\x64", "mp3"),
        (b"\xff\xf1\x4c\x80", "aac"),
        (b"\xff\xfeH\0i\0", None),  # a text in UTF-16
        (b"<bml/>", None),
        (b"", None),
    ],
)
def test_format_of_finds_the_format_by_its_first_bytes(content: bytes, name: str | None) -> None:
    assert format_of(content) == name
    assert name is None or name in {row.name for row in FORMATS}


@each_row(
    "content, rest",
    [
        (b"ID3\4\0\0\0\0\0\2xxfLaC", b"fLaC"),
        (b"ID3\4\0\0\0\0\0\2xx\0\0fLaC", b"fLaC"),
        (b"ID3\4\0\0\0\0\0\2xxno sound", b"ID3\4\0\0\0\0\0\2xxno sound"),
        (b"ID3\4\0\0\x7f\x7f\x7f\x7f", b"ID3\4\0\0\x7f\x7f\x7f\x7f"),
        (b"ID3", b"ID3"),
        (b"fLaC", b"fLaC"),
    ],
)
def test_without_id3_leaves_out_a_tag_before_a_sound(content: bytes, rest: bytes) -> None:
    assert without_id3(content) == rest
