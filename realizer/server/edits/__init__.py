"""Files that clients save: `realizer serve --edit DIR`."""
