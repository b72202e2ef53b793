"""What the site has beside the pages of docs/: pages made from code, and files of other folders."""
