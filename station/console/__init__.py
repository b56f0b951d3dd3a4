"""The web interface: the station in a browser at the scanner.

serving      the HTTP server: sockets, TLS, signals
app          the routes behind the guard
routes       requests in, answers out
state        the scanner, the open session, jobs, settings, and events for browsers
shown_pages  the views of a page: its row, layers, tiles, models, words
http         connections, who may ask, the files of the page
work         the process of a job
vendored     what the page takes from npm
faults       errors as the page shows them
"""
