"""The espeak-ng voice, whose engine runs in a process of its own."""
