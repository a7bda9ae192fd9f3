"""Bags of flights: the recorder node, reader, writer, export. What a flight tells is in ``quad_analysis``."""
