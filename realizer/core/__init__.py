"""Types, errors and settings that all layers share."""
