"""What faces do while people talk (Wojdel 2005, chapter 6): advice on documents, faces for a text."""
