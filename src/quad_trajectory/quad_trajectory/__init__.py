"""Reference trajectories: the paper's two cases and hover, each reached by a smooth approach."""
