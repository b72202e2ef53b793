"""Tests of the eight steps of a document."""

import pytest

import realizer
from realizer_studio.explained import Step, as_html, as_text, steps_of

BML = """<bml id="b">
<speech id="s"><text>Hello <sync id="m"/>there</text></speech>
<faceLexeme id="f" lexeme="SMILE" start="s:m" end="3"/>
<head id="n" lexeme="NONE"/>
</bml>"""


@pytest.fixture(scope="module")
def played() -> realizer.Realization:
    return realizer.realize(BML, voice="silent", idle=False)


@pytest.fixture(scope="module")
def steps(played: realizer.Realization) -> dict[str, Step]:
    return {step.name: step for step in steps_of(played)}


def lines(step: Step) -> str:
    return "\n".join(step.lines)


def test_steps_of_a_document_are_eight(steps: dict[str, Step]) -> None:
    assert list(steps) == ["parse", "time", "schedule", "expand", "blend", "map", "deform", "draw"]
    assert all(step.lines for step in steps.values())


def test_steps_of_a_document_show_nodes_gaps_and_equations(steps: dict[str, Step]) -> None:
    assert 'faceLexeme f start="s:m" end="3"' in lines(steps["parse"])
    assert "b:f: start ~0.45 attackPeak" in lines(steps["time"])
    assert "f:start = s:m (line 3)" in lines(steps["schedule"])
    assert "f:end = bml:start +3.000" in lines(steps["schedule"])
    assert "lexeme: wanted" in lines(steps["schedule"])


def test_steps_of_a_document_show_the_times_that_were_scheduled(
    steps: dict[str, Step], played: realizer.Realization
) -> None:
    assert f"end {played.schedules[0].at('s', 'end'):.3f}" in lines(steps["schedule"])


def test_steps_of_a_document_show_what_moves(steps: dict[str, Step], played: realizer.Realization) -> None:
    assert "12L " in lines(steps["expand"])
    assert f"{played.aus.aus.max():.2f} at " in steps["blend"].lines[1]
    assert "F3 open_jaw" in lines(steps["map"])
    assert "vertices move, by up to" in lines(steps["deform"])
    assert f"{played.frames} pictures" in lines(steps["draw"])


def test_as_text_has_a_heading_for_each_step(steps: dict[str, Step]) -> None:
    heads = [line for line in as_text(list(steps.values())).splitlines() if not line.startswith(" ")]
    assert [head.split()[:2] for head in heads] == [[str(k), name] for k, name in enumerate(steps, 1)]


@pytest.mark.gl
@pytest.mark.slow
def test_as_html_has_a_timeline_and_a_picture(steps: dict[str, Step], played: realizer.Realization) -> None:
    page = as_html(list(steps.values()), played)
    assert "Timeline of b" in page
    assert '<img alt="the face" src="data:image/png;base64,' in page
