"""The server's side of HTTP.

protocol  connections: time and size of a request's head
guard     who may ask: host, origin, token, body
files     the files of the page
"""
