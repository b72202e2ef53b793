"""Lip synchronisation: phonemes to lip, jaw and tongue channels."""
