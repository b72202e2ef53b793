"""Values and settings that every layer shares."""
