"""The editors of the page: the tabs Design, Face and Label."""
