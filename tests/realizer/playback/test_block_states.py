"""Tests of the states of blocks."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from bml_schema import Block, parse
from realizer import playback
from realizer.behaviours.registry import VOCABULARY
from realizer.playback import block_states
from realizer.playback.block_states import TRANSITIONS, BlockEvent, State, TransitionError, next_state
from realizer.playback.player import Player
from tests.rows import each_row

DOCS = Path(__file__).parents[3] / "docs" / "blocks.md"
SMILE = '<faceLexeme id="s" lexeme="SMILE" start="0" attackPeak="0.5" relax="1" end="2"/>'
BMLA = 'xmlns:bmla="http://www.asap-project.org/bmla"'
PREPLANNED = f'{BMLA} bmla:preplan="true"'
ACTIVATE = f'<bml id="b" {BMLA}><bmla:activate id="x" target="a"/></bml>'


class Recorder(dict[tuple[State, BlockEvent], State]):
    """The table, and its rows that were used."""

    def __init__(self) -> None:
        super().__init__(TRANSITIONS)
        self.used: set[tuple[State, BlockEvent]] = set()

    def __getitem__(self, row: tuple[State, BlockEvent]) -> State:
        self.used.add(row)
        return super().__getitem__(row)


def block(attributes: str = "") -> Block:
    return parse(f'<bml id="a" {attributes}>{SMILE}</bml>', VOCABULARY)


def drawing() -> str:
    """Return the table as a state diagram of Mermaid."""
    lines = [f"    {state} --> {after}: {event}" for (state, event), after in TRANSITIONS.items()]
    final = [f"    {state} --> [*]" for state in State if not any(s is state for s, _ in TRANSITIONS)]
    return "\n".join(["```mermaid", "stateDiagram-v2", "    [*] --> IN_PREP", *lines, *final, "```"])


def test_docs_draw_the_table() -> None:
    assert drawing() in DOCS.read_text("utf-8"), f"docs/blocks.md: wanted\n{drawing()}"


@each_row("state", State)
@each_row("event", BlockEvent)
def test_next_state_follows_the_table_or_refuses(state: State, event: BlockEvent) -> None:
    if (after := TRANSITIONS.get((state, event))) is not None:
        assert next_state(state, event) is after
    else:
        with pytest.raises(TransitionError, match=f"{state} cannot {event}"):
            next_state(state, event)


def test_every_state_is_reached_and_left_unless_the_block_is_over() -> None:
    assert {State.IN_PREP, *TRANSITIONS.values()} == set(State)
    over = set(State) - {state for state, _ in TRANSITIONS}
    assert over == {State.DONE, State.INTERRUPTED, State.REVOKED}


def test_state_is_assigned_only_by_change_state() -> None:
    assigned = set()
    for path in Path(playback.__path__[0]).glob("*.py"):
        for function in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(function, ast.FunctionDef):
                assigned |= {
                    function.name
                    for node in ast.walk(function)
                    if isinstance(node, ast.Attribute)
                    and node.attr == "state"
                    and isinstance(node.ctx, ast.Store)
                }
    assert assigned == {"change_state"}


def test_every_row_happens_to_blocks_of_a_player(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(block_states, "TRANSITIONS", recorder := Recorder())
    for stopped in (None, 0.1, 1.5):  # not at all, while it plays, while it subsides
        player = Player()
        player.submit(block(), 0.0)
        if stopped is not None:
            player.stop(stopped)
        player.due(9.0)
    Player().manager.withdraw(block(), 0.0)
    for waiting in (block(), block(PREPLANNED)):
        player = Player()
        player.submit(waiting, 0.0)
        player.stop(-1.0)
    player = Player()
    player.submit(block(PREPLANNED), 0.0)
    player.submit(parse(ACTIVATE, VOCABULARY), 0.0)
    player.due(9.0)
    assert recorder.used == set(TRANSITIONS)
