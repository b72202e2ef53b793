"""Documents from their arrival to their planning: queue, limits, speech requests."""
