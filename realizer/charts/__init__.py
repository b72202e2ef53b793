"""Pictures of schedules: blocks as plain data, laid out as shapes, written as SVG or PNG."""

__all__: list[str] = []
