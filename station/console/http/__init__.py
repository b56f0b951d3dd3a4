"""The server's side of HTTP: connections, who may ask, the files of the page."""
