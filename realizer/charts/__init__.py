"""Charts of schedules as SVG or PNG."""
