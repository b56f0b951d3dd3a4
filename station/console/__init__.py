"""The console: the station as pages of a browser on the machine beside the scanner.

command    `planish serve`
serving    the HTTP server: sockets, TLS, signals
protocol   connections: time and size of a request's head
guard      who may ask: host, origin, token, body
hub        events for browsers, in order, with those that a browser missed
control    which tab of a browser acts, the others watch
scanner    the one owner of the scanner
sitting    the one open session, its capture loop in a thread
desk       all of these together
shown      the state that is shown
broadcast  what is sent to browsers, and when
jobs, work long work in processes of their own
layers, tiles, models, words, preview, settings   what a page is looked at by
app        the routes, of the modules routes_…
"""
