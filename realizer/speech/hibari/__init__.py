"""The hibari voice, whose model runs in a process of its own."""
