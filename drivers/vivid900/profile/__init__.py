"""Command profiles: the bytes of every command and block for one firmware."""
