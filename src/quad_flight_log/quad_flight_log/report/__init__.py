"""A flight for people: tables, figures, HTML report, a view in RViz."""
