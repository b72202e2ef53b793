"""Lip synchronisation: channels of lips, jaw and tongue from phonemes."""
