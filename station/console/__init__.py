"""The console: the station as pages of a browser on the machine beside the scanner.

command    `planish serve`
serving    the HTTP server: sockets, TLS, signals
protocol   connections: time and size of a request's head
guard      who may ask: host, origin, token, body
hub        events for browsers, in order, with those that a browser missed
control    which tab of a browser acts, the others watch
scanner    the one owner of the scanner
sitting    the one open session, its shift in a thread
station    all of these together, and the state that they show
app        the routes
"""
