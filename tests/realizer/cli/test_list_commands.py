"""`realizer outputs`: what can be written here."""

from __future__ import annotations

import subprocess
import sys

import pytest

from realizer.outputs.registry import OUTPUTS


def lines(before: str = "") -> dict[str, str]:
    """Suffix -> the rest of its line."""
    code = f"import sys; {before}\nfrom realizer.cli import main; sys.argv = ['realizer', 'outputs']; main()"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return dict(line.split(maxsplit=1) for line in done.stdout.splitlines())


def test_every_output_has_a_line_that_says_what_it_is():
    found = lines()
    assert list(found) == sorted(OUTPUTS)
    for suffix, output in OUTPUTS.items():
        assert output.media_type in found[suffix]
        assert output.description in found[suffix]


def test_what_is_missing_is_said_with_what_to_install():
    found = lines("sys.modules['av'] = None")
    for suffix in (".mp4", ".webm"):
        assert "pip install 'bml-realizer[film]'" in found[suffix]
    assert not [suffix for suffix in (".fap", ".glb", ".wav") if "missing" in found[suffix]]


@pytest.mark.parametrize("suffix", OUTPUTS)
def test_an_output_that_draws_says_that_it_needs_what_draws(suffix):
    assert ("render" in OUTPUTS[suffix].needs) == (OUTPUTS[suffix].picture_size is not None)
