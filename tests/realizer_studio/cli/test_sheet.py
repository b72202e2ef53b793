"""Tests of `realizer faces sheet`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from PIL import Image

from realizer.cli import cli


def sheet(*args: str) -> Result:
    return CliRunner().invoke(cli, ["faces", "sheet", "default", *args], catch_exceptions=False)


@pytest.mark.gl
@pytest.mark.long
@pytest.mark.slow
def test_sheet_draws_archetypes_from_two_sides_with_differences(tmp_path: Path) -> None:
    path = tmp_path / "x.png"
    done = sheet("-o", str(path), "--emotions", "--size", "60x80", "--camera", "front", "--camera", "profile")
    assert done.exit_code == 0
    assert "75 poses" in done.stderr  # neutral, six archetypes, 17 angles at 4 activations
    pixels = np.asarray(Image.open(path))
    assert pixels.shape[1] > 2 * 4 * 60
    # Differences are drawn in hues that no face has: violet, where they are small.
    violet = (pixels[..., 2] > pixels[..., 1] + 40) & (pixels[..., 0] > pixels[..., 1] + 20)
    assert violet.sum() > 100


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (["-o", "x.jpg"], "wanted a name that ends in .png"),
        (["-o", "x.png", "--camera", "top"], "wanted one of front, three-quarter, profile, close, got 'top'"),
        (
            ["-o", "x.png", "--light", "noon"],
            "wanted one of portrait, daylight, evening, studio, outdoors, got 'noon'",
        ),
        (["-o", "x.png", "--background", "blue"], "got 'blue', which is no file"),
        (["-o", "x.png", "--background", "transparent"], "these pictures are opaque"),
        (["-o", "x.png", "--value", "0"], "0"),
    ],
)
def test_sheet_refuses_wrong_options(args: list[str], words: str) -> None:
    done = sheet(*args)
    assert done.exit_code == 2
    assert words in " ".join(done.stderr.split())
