"""The table of elements and their node classes."""

from collections.abc import Mapping
from typing import Final

from bml_schema import behaviours, bmla, extensions
from bml_schema.nodes import Behaviour

# Clark tag -> class; extend it by {**VOCABULARY, Wink.tag: Wink}.
VOCABULARY: Final[Mapping[str, type[Behaviour]]] = {
    cls.tag: cls
    for module in (behaviours, bmla, extensions)
    for _, cls in sorted(vars(module).items())
    if isinstance(cls, type) and issubclass(cls, Behaviour) and hasattr(cls, "tag")
}
