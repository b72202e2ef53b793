"""The CSV file of ARKit weights, as Live Link Face writes it."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest

from realizer.animation.arkit import ARKIT_NAMES, arkit
from realizer.offline import realize
from realizer.outputs.output import RenderSettings
from realizer.outputs.registry import OUTPUTS, output_for

pytestmark = pytest.mark.xdist_group("outputs")

SAYS = "Hello my beautiful world, four blue boats have a very good view of the sea."
SPEECH = (
    '<bml id="a" xmlns="http://www.bml-initiative.org/bml/bml-1.0">'
    f'<speech id="s"><text>{SAYS}</text></speech></bml>'
)
# The header of the app's files.
HEADER = (
    "Timecode,BlendShapeCount,EyeBlinkLeft,EyeLookDownLeft,EyeLookInLeft,EyeLookOutLeft,EyeLookUpLeft,"
    "EyeSquintLeft,EyeWideLeft,EyeBlinkRight,EyeLookDownRight,EyeLookInRight,EyeLookOutRight,EyeLookUpRight,"
    "EyeSquintRight,EyeWideRight,JawForward,JawRight,JawLeft,JawOpen,MouthClose,MouthFunnel,MouthPucker,"
    "MouthRight,MouthLeft,MouthSmileLeft,MouthSmileRight,MouthFrownLeft,MouthFrownRight,MouthDimpleLeft,"
    "MouthDimpleRight,MouthStretchLeft,MouthStretchRight,MouthRollLower,MouthRollUpper,MouthShrugLower,"
    "MouthShrugUpper,MouthPressLeft,MouthPressRight,MouthLowerDownLeft,MouthLowerDownRight,MouthUpperUpLeft,"
    "MouthUpperUpRight,BrowDownLeft,BrowDownRight,BrowInnerUp,BrowOuterUpLeft,BrowOuterUpRight,CheekPuff,"
    "CheekSquintLeft,CheekSquintRight,NoseSneerLeft,NoseSneerRight,TongueOut,HeadYaw,HeadPitch,HeadRoll,"
    "LeftEyeYaw,LeftEyePitch,LeftEyeRoll,RightEyeYaw,RightEyePitch,RightEyeRoll"
)


@pytest.fixture(scope="module")
def spoken():
    return realize(SPEECH, idle=False, voice="silent")


def test_arkit_csv_has_the_columns_of_live_link_face(spoken, tmp_path):
    path = tmp_path / "Take.ARKit.csv"
    output = output_for(path)
    assert output is OUTPUTS[".arkit.csv"]
    output.write(spoken, path, RenderSettings())
    reader = csv.DictReader(io.StringIO(path.read_text("utf-8")))
    rows = list(reader)
    assert ",".join(reader.fieldnames) == HEADER
    assert len(rows) == spoken.frames
    assert {row["BlendShapeCount"] for row in rows} == {"61"}
    assert [row["Timecode"] for row in rows[:2]] == ["00:00:00:00.000", "00:00:00:01.000"]
    assert rows[30]["Timecode"] == "00:00:01:05.000"
    found = arkit(spoken.aus, spoken.mapping).weights
    for name in ("jawOpen", "mouthFunnel", "mouthSmileRight"):
        column = [float(row[name[0].upper() + name[1:]]) for row in rows]
        np.testing.assert_allclose(column, found[:, ARKIT_NAMES().index(name)], atol=1e-6)


def test_arkit_csv_timecodes_rise_at_fractional_rates(tmp_path):
    quiet = realize(SPEECH, idle=False, voice="silent", fps=29.97)
    OUTPUTS[".arkit.csv"].write(quiet, tmp_path / "x.arkit.csv", RenderSettings())
    codes = [line.split(",")[0] for line in (tmp_path / "x.arkit.csv").read_text().splitlines()[1:]]
    assert codes == sorted(codes)
    assert len(set(codes)) == len(codes) == quiet.frames


def test_arkit_csv_suffix_does_not_change_csv():
    assert output_for("x.csv") is OUTPUTS[".csv"]
    assert output_for("my.take.csv") is OUTPUTS[".csv"]


def test_arkit_csv_is_read_by_a_reader_of_live_link_face(spoken, tmp_path):
    read_csv = pytest.importorskip("openfacefx.importers_csv", reason="pip install openfacefx").read_csv
    OUTPUTS[".arkit.csv"].write(spoken, tmp_path / "x.arkit.csv", RenderSettings())
    track, notes = read_csv(str(tmp_path / "x.arkit.csv"), fps=25, epsilon=0)
    # It takes every column for a weight, and says of turns that they are none.
    assert all("Head" in note or "Eye" in note for note in notes)
    found = arkit(spoken.aus, spoken.mapping)
    for channel in track.channels:
        name = channel.name[0].lower() + channel.name[1:]
        if name in ARKIT_NAMES():
            keys = [(key.time, key.value) for key in channel.keys]
            got = np.interp(found.times, *zip(*keys, strict=True))
            wanted = found.weights[:, ARKIT_NAMES().index(name)]
            np.testing.assert_allclose(got, wanted, atol=1e-3, err_msg=name)
    assert {"JawOpen", "MouthFunnel", "MouthClose"} <= {channel.name for channel in track.channels}
