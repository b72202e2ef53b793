"""The library of expressions: shipped ones and a user's own, what they mean, and timelines of them."""

from realizer.expressions.expression import Expression, key
from realizer.expressions.library import Library, library_of, shipped
from realizer.expressions.search import by_action_units, by_meaning
from realizer.expressions.spans import Span, evident, lasts, spans
from realizer.expressions.timeline import Entry, Timeline, Track, faults_of, remarks
from realizer.expressions.timeline_reader import read_timeline
from realizer.expressions.user_expressions import read_folder

__all__ = [
    "Entry",
    "Expression",
    "Library",
    "Span",
    "Timeline",
    "Track",
    "by_action_units",
    "by_meaning",
    "evident",
    "faults_of",
    "key",
    "lasts",
    "library_of",
    "read_folder",
    "read_timeline",
    "remarks",
    "shipped",
    "spans",
]
