"""Values, errors and settings that every layer shares."""
