"""A flight for people: tables, figures, HTML report, layouts of viewers."""
