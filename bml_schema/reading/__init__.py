"""The reading of documents: parser, repairs of what is not well-formed, encodings."""
