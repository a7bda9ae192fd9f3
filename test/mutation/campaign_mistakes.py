"""Mistakes of what campaigns and studies count, by function: (what, what stands there, what it becomes)."""

CAMPAIGN = {
    "quad_campaign.batch.row": [
        ("score", "result.outcome == ENDED and ", ""),
        ("score", "figures[name] <= limit", "figures[name] >= limit"),
        ("score", "score.largest_error, score.last_error", "score.last_error, score.largest_error"),
    ],
    "tune.flight_cost": [
        ("score", "result.outcome != 'ended' or ", ""),
        ("score", "- result.trajectory_start", ""),
        ("score", "variation / objective.variation_scale", "variation"),
        ("score", "2.0 - result.steps / max(1, result.end_step)", "1.0"),
    ],
    "study_statistics.spread": [
        ("metrics", "[0.05, 0.5, 0.95]", "[0.05, 0.5, 0.9]"),
        ("metrics", "values[np.isfinite(values)]", "np.nan_to_num(values)"),
    ],
    "study_statistics.paired": [
        ("metrics", "np.median(differences)", "np.mean(differences)"),
        ("metrics", "differences[np.isfinite(differences)]", "np.nan_to_num(differences)"),
    ],
    "study_statistics.summary": [
        ("metrics", "own.loc[both, metric].to_numpy(float) - first", "first.loc[both, metric].to_numpy(float) - own"),
        ("metrics", "set_index('seed')", "reset_index()"),
    ],
}
