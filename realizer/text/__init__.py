"""What a voice is given: Markdown, stage directions, emoji and numbers of plain text as people mean them."""
