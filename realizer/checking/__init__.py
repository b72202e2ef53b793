"""What is wrong with a document, and what looks like a slip of its author, as `realizer check` tells it."""
