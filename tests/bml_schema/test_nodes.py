"""Tests of blocks, constraints and their children."""

import pickle
from dataclasses import replace

import pytest
from hypothesis import given

from bml_schema import Behaviour, Block, Constraint, Head, Required, Synchronize, SyncRef, Wait, parse
from tests.strategies import blocks


def test_block_lists_behaviours_and_constraints_in_document_order() -> None:
    a, b, c = Wait(id="a"), Head(id="b", lexeme="NOD"), Wait(id="c")
    refs = (SyncRef(behaviour="a", sync="end"), SyncRef(behaviour="b", sync="start"))
    one = Constraint(id="one", parts=(Synchronize(refs=refs),))
    two = Constraint(parts=(Synchronize(refs=refs),), required=True)
    block = Block(id="x", children=(a, one, Required(children=(b, two)), c))
    assert block.behaviours == (a, b, c)
    assert block.constraints == (one, two)
    assert block.required == {"b"}
    assert block["b"] is b
    with pytest.raises(KeyError):
        block["nobody"]


def test_block_nodes_can_be_keys_of_a_dict() -> None:
    assert len({Wait(id="a"), Wait(id="a"), Wait(id="b")}) == 2
    assert len({Block(id="a"), Block(id="a", unknown_attributes={})}) == 1


@given(blocks())
def test_block_can_be_pickled_and_hashed(block: Block) -> None:
    back = pickle.loads(pickle.dumps(block))
    assert back == block
    assert hash(back) == hash(block)
    assert back.behaviours == block.behaviours
    assert all(isinstance(b, Behaviour) and back[b.id] == b for b in block.behaviours)


def test_constraint_references_are_those_of_all_parts_in_order() -> None:
    inner = '<before ref="a:end"><sync ref="b:start"/></before><synchronize><sync ref="1"/></synchronize>'
    (constraint,) = parse(
        f'<bml id="x"><wait id="a"/><wait id="b"/><constraint id="k">{inner}</constraint></bml>'
    ).constraints
    assert [str(ref) for ref in constraint.references] == ["b:start", "a:end", "1"]


def test_with_children_changes_and_drops_children_inside_required_too() -> None:
    block = parse('<bml id="x"><wait id="a"/><required><wait id="b"/><wait id="c"/></required></bml>')
    seen = []

    def change(node: Behaviour | Constraint, required: bool) -> Behaviour | Constraint | None:
        seen.append((node.id, required))
        return None if node.id == "b" else replace(node, id=f"{node.id}2")

    changed = block.with_children(change)
    assert seen == [("a", False), ("b", True), ("c", True)]
    assert [b.id for b in changed.behaviours] == ["a2", "c2"]
    assert changed.required == {"c2"}
