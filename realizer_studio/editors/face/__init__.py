"""The editor behind the page's tab Face."""
