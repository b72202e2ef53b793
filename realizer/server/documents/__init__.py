"""Documents between their arrival and their planning."""
