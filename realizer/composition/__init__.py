"""Several blocks together: who waits for whom, who wants the same, what is told of each."""

__all__: list[str] = []
