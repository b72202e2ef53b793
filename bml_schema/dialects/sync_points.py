"""The sync points of dialects: their names in attributes and references become those of BML 1.0."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from bml_schema.canonical import MAX_ATTRIBUTES
from bml_schema.dialects.table import Row, point_row, squeezed, table
from bml_schema.node_schema import local
from bml_schema.vocabulary import VOCABULARY

# Name of a behaviour -> its sync points.
POINTS = {local(tag): cls.sync_points for tag, cls in VOCABULARY.items()}
_REFERENCE = re.compile(r"\s*([^:\s]+)\s*:\s*([A-Za-z_-]+?)(\s*[+-]\s*[0-9.]+\s*)?")
_FUNCTION = re.compile(r"\s*(?:after|before)\s*\((.*)\)\s*")


@dataclass(frozen=True)
class SyncPoints:
    """The sync points of one document."""

    kinds: Mapping[str, str]  # id of a behaviour -> name of its element
    apply: Callable[[Row], None]  # called with each used row of the table
    in_dialect: bool  # whether the document is in a dialect, so that rows for any dialect apply too

    def translate(self, element: Any) -> None:
        """Rename the sync points of a behaviour, and those that it refers to."""
        points = POINTS.get(local(str(element.tag)))
        if points is None or len(element.attrib) > MAX_ATTRIBUTES:
            return
        for name, value in element.items():
            point = name
            if name not in points:
                row = point_row(name)
                meant = self._point(row, name, points) if row is not None else ""
                if row is None or not meant:
                    continue
                self.apply(row)
                del element.attrib[name]
                if meant in element.attrib:
                    continue
                point = meant
            reference = self.reference(value)
            if reference != value or point != name:
                element.set(point, reference)

    def reference(self, value: str) -> str:
        """Return a reference with the name of its sync point in BML 1.0."""
        if function := _FUNCTION.fullmatch(value):
            self.apply(table().elements["*"])
            value = function[1]
        found = _REFERENCE.fullmatch(value)
        if found is None:
            return value
        id, point, offset = found.groups()
        if id == "act" and id not in self.kinds:
            return f"bml:{point}{offset or ''}"
        points = POINTS.get(self.kinds.get(id, ""))
        row = point_row(point)
        if points is None or row is None or point in points:
            return value
        translated = self._point(row, point, points)
        if not translated:
            return value
        self.apply(row)
        return f"{id}:{translated}{offset or ''}"

    def _point(self, row: Row, name: str, points: tuple[str, ...]) -> str:
        """Return the first sync point of a row that a behaviour has, or "" if the row does not apply."""
        meant = next((point for point in row.becomes.split("|") if point in points), "")
        spelled = name.lower() != meant.lower() and squeezed(name) == squeezed(meant)
        return meant if self.in_dialect or spelled else ""
