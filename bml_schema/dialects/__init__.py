"""Dialects of BML: documents that were written for other realizers, or to drafts of the standard."""
