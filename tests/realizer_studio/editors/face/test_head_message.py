"""The description of a head for the page."""

from __future__ import annotations

import json

from realizer.face.features import NAMES
from realizer.face.load import folder_of
from realizer_studio.editors.face.head_message import head_message


def test_head_message_has_points_zones_and_tables() -> None:
    head, arrays = head_message(folder_of("ada"))
    assert set(head["points"]) == set(head["says"]) == set(head["template"]) == set(NAMES)
    assert [row["fap"] for row in head["faps"]] == list(range(3, 69))
    assert head["by"] == []
    assert head["keep"], "the face has shapes of its own"
    assert arrays["vertices"].shape[0] == max(last for _, last in head["parts"].values())
    json.dumps(head)
