"""The routes: requests in, answers out; one module for each group."""
