"""Tools of the page's designer of timelines: checks, frames, import and export."""
