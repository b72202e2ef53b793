"""The formats of sound files, by their first bytes, with the suffixes of their names."""

import re
from typing import NamedTuple


class SoundFormat(NamedTuple):
    """A row of the table: FFmpeg's name, the suffixes, and an expression for the first bytes."""

    name: str
    suffixes: tuple[str, ...]
    begin: re.Pattern[bytes]


def _row(name: str, suffixes: str, begin: bytes) -> SoundFormat:
    return SoundFormat(name, tuple(suffixes.split()), re.compile(begin, re.DOTALL))


# A format is found by the content, because names are often wrong. FFmpeg is always given one, because it
# would also read playlists, which lead to other files.
FORMATS = (
    _row("wav", ".wav .wave", rb"(RIFF|RIFX|RF64|BW64).{4}WAVE"),
    _row("w64", ".w64", rb"riff\x2e\x91\xcf\x11"),
    _row("flac", ".flac", rb"fLaC"),
    _row("ogg", ".ogg .oga .opus .spx", rb"OggS"),
    _row("mov", ".m4a .m4b .mp4 .mov .3gp", rb".{4}ftyp"),
    _row("matroska", ".webm .weba .mka .mkv", rb"\x1aE\xdf\xa3"),
    _row("aiff", ".aiff .aif .aifc", rb"FORM.{4}AIF[FC]"),
    _row("au", ".au .snd", rb"\.snd"),
    _row("caf", ".caf", rb"caff"),
    _row("amr", ".amr", rb"#!AMR"),
    _row("wv", ".wv", rb"wvpk"),
    _row("asf", ".wma", rb"\x30\x26\xb2\x75\x8e\x66\xcf\x11"),
    _row("aac", ".aac", rb"\xff[\xf0\xf1\xf8\xf9]"),
    _row("mp3", ".mp3 .mp2", rb"ID3|\xff[\xe2\xe3\xf2-\xf5\xfa-\xfd]"),
)
SUFFIXES = tuple(suffix for row in FORMATS for suffix in row.suffixes)


def format_of(content: bytes) -> str | None:
    """Return FFmpeg's name of the format of a sound file, or None."""
    return next((row.name for row in FORMATS if row.begin.match(content)), None)


def without_id3(content: bytes) -> bytes:
    """Return the content behind an ID3v2 tag, which programs write before sound of any format."""
    if content[:3] != b"ID3" or len(content) < 10:
        return content
    high, upper, lower, low = (byte & 0x7F for byte in content[6:10])
    size = 10 + (high << 21 | upper << 14 | lower << 7 | low)
    rest = content[size:].lstrip(b"\0")
    return rest if format_of(rest) else content
