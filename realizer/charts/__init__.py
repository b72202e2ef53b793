"""Pictures of schedules: blocks as plain data, laid out as shapes, written as SVG or PNG."""
