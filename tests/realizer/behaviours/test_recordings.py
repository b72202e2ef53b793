"""Tests of recordings that documents name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.media import MediaError
from realizer.behaviours.recordings import faults, recording
from realizer.speech.utterance import Recording

CLIP = Recording(8000, np.zeros(80, np.int16))


def test_recording_is_a_file_of_the_media_folder(media: Path) -> None:
    found = recording("hello.wav", PlanningContext(media=media))
    assert (found.rate, len(found.pcm)) == (8000, 4000)


def test_recording_is_a_clip_of_a_client() -> None:
    assert recording(" clip:hi ", PlanningContext(clips={"hi": CLIP})) is CLIP


@pytest.mark.parametrize("name", ["clip:hi", "hello.wav"])
def test_recording_without_media_and_clips_is_an_error(name: str) -> None:
    with pytest.raises(MediaError):
        recording(name, PlanningContext())
    (fault,) = faults(name, PlanningContext())
    assert fault.fatal
    assert fault.text.startswith("fileName: wanted a ")


def test_faults_suggest_the_id_of_a_clip() -> None:
    (fault,) = faults("clip:helo", PlanningContext(clips={"hello": CLIP}))
    assert fault.text.endswith("""got 'clip:helo', did you mean "clip:hello"?""")
    assert faults("clip:hello", PlanningContext(clips={"hello": CLIP})) == ()
