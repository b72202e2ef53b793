"""The hibari voice."""
