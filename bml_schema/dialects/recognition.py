"""Recognition of documents in a dialect; what they mean in BML 1.0 is in the translator."""

from collections.abc import Iterable, Mapping, Sequence
from functools import cache, lru_cache

from lxml import etree

from bml_schema.behaviours import Face, FaceShift
from bml_schema.dialects.table import Row, table
from bml_schema.node_schema import local, schema_of
from bml_schema.nodes import DRAFTS, Behaviour, Block
from bml_schema.reading.undeclared_prefixes import SMARTBODY
from bml_schema.steps import next_element
from bml_schema.vocabulary import VOCABULARY

_SMARTBODY = f"{{{SMARTBODY}}}"


def is_draft(root: etree._Element) -> bool:
    """Return whether a document is in the namespace of a draft."""
    return str(root.tag).rpartition("}")[0][1:] in DRAFTS


@cache
def _words() -> Mapping[type[Behaviour], tuple[str, tuple[Row, ...]]]:
    """Return class -> (its field with values of dialects, their rows)."""
    classes = {local(tag): cls for tag, cls in VOCABULARY.items()}
    words: dict[type[Behaviour], tuple[str, tuple[Row, ...]]] = {}
    for row in table().rows:
        cls = classes.get(row.element)
        spec = schema_of(cls).attributes.get(row.attribute) if cls else None
        if cls and spec and row.value and row.dialect != "any" and spec.value.type == "string":
            words[cls] = spec.field, (*words.get(cls, ("", ()))[1], row)
    return words


@lru_cache(maxsize=1000)
def _is_word(tag: str, value: str) -> bool:
    return any(row.fits(value) for row in _words()[VOCABULARY[tag]][1])


def has_words_of_dialects(block: Block) -> bool:
    """Return whether a block has words of a dialect that are no fault in BML 1.0, such as Greta's lexemes."""
    return _any(block.behaviours)


def _any(nodes: Iterable[Behaviour]) -> bool:
    words = _words()
    for node in nodes:
        next_element()
        if (word := words.get(type(node))) is not None and _is_word(node.tag, getattr(node, word[0])):
            return True
        if node.unknown_attributes and any(name.startswith(_SMARTBODY) for name in node.unknown_attributes):
            return True
        parts: Sequence[Behaviour] = node.parts if isinstance(node, Face | FaceShift) else ()
        if parts and _any(parts):
            return True
    return False
