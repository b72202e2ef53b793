"""What is wrong with a document, and what looks like a slip of its author, as `realizer check` tells it."""

from realizer.checking.advice import ADVICE, advice
from realizer.checking.document import Checked, checked
from realizer.checking.finding import Finding, Label

__all__ = ["ADVICE", "Checked", "Finding", "Label", "advice", "checked"]
