"""Tests of `realizer track`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from realizer.analysis.faps_from_mesh import points_of
from realizer.animation.fap.fap_reader import read_fap
from realizer.cli import cli
from realizer.emotions.archetypes import archetypes
from realizer.face.deform import deform
from realizer.face.load import load_face


def run(*args: str) -> Result:
    return CliRunner().invoke(cli, ["track", *args])


def acted(path: Path, leave_out: tuple[str, ...] = ()) -> np.ndarray:
    """Writes what a tracker would see of a face that gets sad and turns its head; returns its FAPs."""
    face = load_face("ada")
    part = np.linspace(0, 1, 6, dtype=np.float32)[:, None]
    frames = part * archetypes("published")["sadness"][0].frame()
    frames[:, 48] = part[:, 0] * 10000
    points = points_of(face, deform(face, frames))
    lines = ["frame,point,x,y,z"]
    for name, way in points.items():
        if name not in leave_out:
            lines += [f"{k},{name},{x:.7f},{y:.7f},{z:.7f}" for k, (x, y, z) in enumerate(way) if k != 3]
    path.write_text("\n".join(lines) + "\n")
    return frames


def test_track_writes_a_fap_file_and_names_the_emotion(tmp_path: Path) -> None:
    frames = acted(tmp_path / "actor.csv")
    done = run(
        str(tmp_path / "actor.csv"), "--fps", "30", "-o", str(tmp_path / "a.fap"), "--profiles", "published"
    )
    assert done.exit_code == 0, done.output
    clip = read_fap((tmp_path / "a.fap").read_text())
    assert (clip.fps, len(clip.values)) == (30, 6)
    moved = [19, 20, 21, 22, 31, 32]
    # Frame 3 was lost, and lies between its neighbours.
    assert np.abs(clip.values[:, [n - 1 for n in moved]] - frames[:, [n - 1 for n in moved]]).max() <= 2
    assert np.abs(clip.values[:, 48] - frames[:, 48]).max() < 150
    assert done.stdout.splitlines()[0].split()[::2] == ["0.00", "neutral"]
    assert done.stdout.splitlines()[-1].split()[2] == "sadness"


@pytest.mark.parametrize(
    ("leave_out", "output", "said"),
    [
        (("9.15",), "a.fap", "wanted point 9.15 in frame 0, to measure the face's proportions"),
        ((), "a.csv", "a.csv: wanted a name that ends in .fap"),
    ],
)
def test_track_refuses_missing_points_and_other_suffixes(
    tmp_path: Path, leave_out: tuple[str, ...], output: str, said: str
) -> None:
    acted(tmp_path / "actor.csv", leave_out)
    done = run(str(tmp_path / "actor.csv"), "-o", str(tmp_path / output))
    assert done.exit_code == 2
    assert said in " ".join(done.stderr.split())


def test_track_refuses_a_table_with_other_columns(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("a,b\n1,2\n")
    done = run(str(tmp_path / "x.csv"), "-o", str(tmp_path / "x.fap"))
    assert done.exit_code == 2
    assert "wanted a first line frame,point,x,y,z, got 'a,b'" in " ".join(done.stderr.split())


def test_track_refuses_other_encodings_but_takes_a_byte_order_mark(tmp_path: Path) -> None:
    table = tmp_path / "actor.csv"
    table.write_bytes(b"frame,point,x,y,z\n0,\xe4,0,0,0\n")
    done = run(str(table), "-o", str(tmp_path / "a.fap"))
    assert done.exit_code == 2
    assert "actor.csv: wanted a table in UTF-8, got byte 0xE4 at 20" in " ".join(done.output.split())
    acted(table)
    table.write_bytes(b"\xef\xbb\xbf" + table.read_bytes())
    assert run(str(table), "-o", str(tmp_path / "a.fap")).exit_code == 0
