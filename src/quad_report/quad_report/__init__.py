"""A recorded flight for people: figures, HTML page, live view, and the command line ``log``."""
