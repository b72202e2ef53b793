"""Blocks know their behaviours and constraints, and what is required."""

from __future__ import annotations

import pickle

import pytest
from hypothesis import given

from bml_schema import Behaviour, Block, Constraint, Head, Required, Synchronize, SyncRef, Wait
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
