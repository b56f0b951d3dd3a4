"""The server's side of HTTP.

connections  how many at the same time, from before their handshake
protocol     time and size of a request's head
guard        who may ask: host, origin, token, body
files        the files of the page
"""
