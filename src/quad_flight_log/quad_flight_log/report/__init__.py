"""A flight for people: tables, figures, HTML report, Rerun recording, layouts of viewers."""
