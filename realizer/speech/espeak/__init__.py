"""The espeak-ng voice."""
