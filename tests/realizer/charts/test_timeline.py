"""Tests of the values of a chart and their JSON."""

import json

import pytest

from realizer.charts.links import Link
from realizer.charts.timeline import BehaviourRow, BlockChart, Dropped, Gap, Point, WordSpan
from realizer.scheduling.timing import Warning

GAP = Gap("start", "end", 1.5, 1.0, 0.25, 4.0)
LINE = BehaviourRow(
    "n",
    "head",
    3,
    True,
    (Point("start", 0.5, 2.5), Point("end", 2.0, 4.0)),
    (GAP,),
    (Link("start", "attribute", None, None, None, 0.5, line=3),),
    (WordSpan(0.5, 1.0, "yes"),),
)
BLOCK = BlockChart(
    "b",
    None,
    "IN_EXEC",
    2.0,
    4.0,
    (LINE,),
    (Dropped("f", "faceLexeme", 4, "CANNOT_CREATE_BEHAVIOR", "no such lexeme"),),
    (Warning("b:f", "CANNOT_CREATE_BEHAVIOR", "no such lexeme"),),
)


def test_gap_costs_what_the_scheduler_pays() -> None:
    assert (GAP.stretch, GAP.cost) == (1.5, 1.0)


@pytest.mark.parametrize(
    "gap", [Gap("start", "end", 1.5), Gap("start", "end", 1.5, 1.5, 1.5, rigid=True, most=1.5)]
)
def test_gap_without_stiffness_costs_nothing(gap: Gap) -> None:
    assert gap.cost == 0.0


def test_gap_without_preferred_length_has_no_stretch() -> None:
    assert Gap("start", "end", 0.2, 0.0, 0.0, 1.0).stretch is None


def test_block_chart_to_json_is_what_the_stream_sends() -> None:
    written = json.loads(json.dumps(BLOCK.to_json(), allow_nan=False))
    assert {key: written[key] for key in ("block", "character", "state", "start", "end", "cost")} == {
        "block": "b",
        "character": None,
        "state": "IN_EXEC",
        "start": 2.0,
        "end": 4.0,
        "cost": 1.0,
    }
    (line,) = written["behaviours"]
    assert (line["id"], line["element"], line["line"], line["required"]) == ("n", "head", 3, True)
    assert line["syncs"][1] == {"name": "end", "time": 2.0, "at": 4.0}
    assert line["gaps"] == [
        {
            "from": "start",
            "to": "end",
            "actual": 1.5,
            "preferred": 1.0,
            "least": 0.25,
            "most": None,
            "stiffness": 4.0,
            "rigid": False,
            "stretch": 1.5,
            "cost": 1.0,
        }
    ]
    assert line["words"] == [{"start": 0.5, "end": 1.0, "text": "yes"}]
    assert written["dropped"][0]["text"] == written["warnings"][0]["text"] == "no such lexeme"


def test_block_chart_head_leaves_out_the_behaviours() -> None:
    assert BLOCK.head().keys() == {"block", "character", "state", "start", "end"}
    assert BLOCK.head().items() <= BLOCK.to_json().items()


def test_block_chart_detail_is_by_behaviour() -> None:
    detail = BLOCK.detail()
    assert detail["gaps"] == {"n": BLOCK.to_json()["behaviours"][0]["gaps"]}
    assert [link["offset"] for link in detail["links"]["n"]] == [0.5]
