"""Tests of `realizer emotion`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from realizer.cli import cli
from realizer.emotions.profile import read_profiles
from realizer.emotions.wheel import affect, wheel
from realizer.emotions.words import emotion


def run(*args: str) -> Result:
    return CliRunner().invoke(cli, ["emotion", *args], standalone_mode=True)


def test_emotion_prints_the_ranges_and_middles_of_a_word() -> None:
    said = run("joy").stdout.splitlines()
    assert said[0] == "joy (own)"
    low, high = emotion("joy").ranges[12]
    line = next(line for line in said if "raise_l_cornerlip " in line)
    assert line.split() == [
        "F12",
        "raise_l_cornerlip",
        f"{low:.1f}",
        "..",
        f"{high:.1f}",
        f"{(low + high) / 2:.1f}",
    ]


def test_emotion_as_json_has_ranges_and_68_values() -> None:
    said = json.loads(run("afraid", "--profiles", "published", "--json").stdout)
    assert said["ranges"]["open_jaw"] == [400, 560]
    assert len(said["values"]) == 68
    assert said["values"][2] == 480


def test_emotion_with_a_seed_has_random_values_within_the_ranges() -> None:
    values = [json.loads(run("joy", "--json", "--seed", seed).stdout)["values"] for seed in ("1", "1", "2")]
    assert values[0] == values[1] != values[2]
    assert values[2] == pytest.approx(emotion("joy").draw(2), abs=1e-3)


def test_emotion_takes_a_place_by_angle_or_by_valence_and_arousal() -> None:
    by_angle = json.loads(run("--angle", "-700", "--activation", "5", "--json").stdout)
    assert np.allclose(by_angle["values"], wheel(20, 5).frame(), atol=1e-2)
    by_affect = json.loads(run("--valence", "-0.6", "--arousal", "0.4", "--json").stdout)
    assert np.allclose(by_affect["values"], affect(-0.6, 0.4).frame(), atol=1e-2)


def test_emotion_prints_the_shares_of_a_place_and_no_negative_zero() -> None:
    assert run("--angle", "-700").stdout.splitlines()[0] == "trust 56% and fear 44% (own)"
    assert run("--angle", "45").stdout.splitlines()[0] == "fear 100% (own)"
    assert json.loads(run("--angle", "20", "--json").stdout)["shares"] == {"trust": 0.5556, "fear": 0.4444}
    assert "-0.0" not in run("--valence", "0", "--arousal", "1").stdout
    assert run("--angle", "1e308").exit_code == 0


@pytest.mark.parametrize(
    "place", [["--valence", "0", "--arousal", "0"], ["--angle", "45", "--activation", "0"], ["neutral"]]
)
def test_emotion_in_the_middle_of_the_wheel_is_neutral(place: list[str]) -> None:
    assert run(*place).stdout == "neutral (own)\n"
    said = json.loads(run(*place, "--json").stdout)
    assert (said["emotion"], said["ranges"], "shares" in said) == ("neutral", {}, False)


def test_emotion_help_shows_no_empty_range() -> None:
    assert "None" not in run("--help").stdout


def test_emotion_prints_nothing_if_the_file_cannot_be_written(tmp_path: Path) -> None:
    done = run("joy", "-o", str(tmp_path / "no" / "joy.txt"))
    assert done.exit_code != 0
    assert done.stdout == ""


def test_emotion_writes_a_profile_file(tmp_path: Path) -> None:
    assert run("fear 3", "--profiles", "raw", "-o", str(tmp_path / "fear.txt")).exit_code == 0
    (back,) = read_profiles((tmp_path / "fear.txt").read_text())
    assert back.name == "Fear 3"
    assert back.ranges == emotion("fear 3", "raw").ranges


def test_emotion_reads_a_profile_file(tmp_path: Path) -> None:
    path = tmp_path / "Fear.TXT"
    run("fear 3", "--profiles", "raw", "-o", str(path))
    said = json.loads(run(str(path), "--json").stdout)
    assert said["values"] == json.loads(run("fear 3", "--profiles", "raw", "--json").stdout)["values"]
    assert (said["emotion"], said["profiles"]) == ("Fear 3", str(path))


def test_emotion_prints_every_profile_of_a_file(tmp_path: Path) -> None:
    path = tmp_path / "two.txt"
    path.write_text("Fear 9\nF3 [400, 560]\nSurprise 0\nF3 [569, 1201]\n", "utf-8")
    assert [line for line in run(str(path)).stdout.splitlines() if "(" in line] == [
        f"Fear 9 ({path})",
        f"Surprise 0 ({path})",
    ]
    assert run("surprise", "--profiles", str(path)).stdout.startswith("Surprise 0")
    done = run(str(tmp_path / "none.txt"))
    assert done.exit_code == 2
    assert "wanted a file of profiles, got: No such file" in " ".join(done.stderr.split())


def test_emotion_refuses_a_file_that_is_not_text(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_bytes(b"\xff\xfe")
    done = run(str(tmp_path / "mine.txt"))
    assert done.exit_code == 2
    assert "mine.txt: wanted a text in UTF-8" in " ".join(done.stderr.split())


@pytest.mark.slow
@pytest.mark.long
def test_emotion_draws_a_word_and_the_wheel_of_64_faces(tmp_path: Path) -> None:
    from PIL import Image

    chart, picture = tmp_path / "wheel.png", tmp_path / "awe.png"
    done = run("awe", "--wheel", str(chart), "-o", str(picture))
    assert (done.exit_code, "64 faces" in done.stderr) == (0, True)
    with Image.open(picture) as alone, Image.open(chart) as drawn:
        assert alone.size == (512, 512)
        pixels = np.asarray(drawn, np.int16)
    assert pixels.shape[1] == 16 * 166 + 6
    # Calm and full fear are different faces, full fear and full anger too.
    cell = [
        pixels[6 + row * (pixels.shape[0] - 6) // 4 :][:160, 6 + k * 166 :][:, :160]
        for row, k in ((0, 2), (3, 2), (3, 10))
    ]
    assert np.abs(cell[0] - cell[1]).mean() > 1
    assert np.abs(cell[1] - cell[2]).mean() > 1


@pytest.mark.parametrize(
    ("args", "said"),
    [
        (["joy", "--profiles", "ekman"], "wanted own, published, raw or a file FILE.txt, got 'ekman'"),
        (["gilty"], "got 'gilty', did you mean guilty?"),
        (["fear 33", "--profiles", "published"], "got 'fear 33', did you mean fear 9?"),
        (["feer 8", "--profiles", "published"], "got 'feer 8', did you mean fear 8"),
        (["fear 8"], "wanted fear 0 of the own profiles, got 'fear 8'; the published profiles have it"),
        (["accepting"], "accepting: its activation was never rated"),
        (["joy", "--angle", "3"], "wanted one of a word, an angle, or valence with arousal"),
        ([], "wanted one of a word"),
        (["joy", "--seed", "-1"], "-1 is not in the range x>=0"),
        (["--valence", "0.3"], "wanted valence and arousal together"),
        (["--activation", "3"], "wanted an angle with the activation"),
        (["--angle", "3", "--activation", "40"], "activation: wanted 0..7, got 40"),
        (["--angle", "nan"], "angle: wanted a number of degrees, got nan"),
        (["--angle", "3", "--activation", "nan"], "activation: wanted 0..7, got nan"),
        (["--valence", "nan", "--arousal", "0"], "valence: wanted -1..1, got nan"),
        (["--valence", "7", "--arousal", "0"], "valence: wanted -1..1, got 7"),
        (["joy", "-o", "joy.gif"], "joy.gif: wanted a name that ends in .png or .txt"),
        (["--wheel", "wheel.svg"], "wheel.svg: wanted a name that ends in .png"),
        (["--wheel", "w.png", "--json"], "wanted a WORD or a place for --json"),
        (["joy", "-o", "x.png", "--camera", "above"], "--camera"),
    ],
)
def test_emotion_refuses_wrong_options(args: list[str], said: str, tmp_path: Path) -> None:
    done = run(*args)
    assert done.exit_code == 2
    assert said in " ".join(done.stderr.split())
