"""The comparison of whole controllers on held-out seeds: which files a study leaves behind.

``scripts/study paper --seeds N --out DIR`` flies every controller of ``config/study.yaml`` (a position law, an attitude
law, a file of tuned gains) on every case, plant and held-out seed, and writes:

``DIR/flights.parquet``
    One row per flight: ``controller``, ``case``, ``plant`` (text), ``seed`` (int), ``outcome`` (``ended``,
    ``diverged`` or ``refused``), ``steps`` (int, plant steps flown), then one float column per name of
    ``quad_flight_log.metrics.METRICS`` (NaN where the metric does not exist or the flight did not end).
``DIR/summary.parquet``
    One row per ``controller``, ``case``, ``plant``, ``metric``: ``flights``, ``ended``, ``median``, ``low``, ``high``
    (5 and 95 %) over the seeds that ended with a number, and against the first controller on the same seeds:
    ``pairs``, ``difference`` (median of this controller minus the first), ``difference_low``, ``difference_high``
    (bootstrap confidence interval, 95 %); NaN on the first controller's own rows.
``DIR/examples/<controller>-<case>.npz``
    One flight each (plant ``rigid_body``, first held-out seed): an array per step topic as in
    ``quad_campaign.flight.Result.topics``, key = topic name (``truth``, ``reference``, ``attitude_setpoint``,
    ``wrench_setpoint``, ``actuation``, ``disturbance``, ``position_controller/internals``,
    ``attitude_controller/internals``).
``DIR/study.json``
    ``name``, ``command``, ``created`` (UTC), ``commit``, ``versions``, ``cases``, ``plants``, ``seeds`` (held out),
    ``training_seeds``, ``seed_rule``, ``controllers``: {name: ``title``, ``position``, ``attitude``, ``gains`` ({node:
    {parameter: value}} as tuned), ``parameters`` ({node: {parameter: value}}, all of both laws),
    ``tuning`` (record of the tuning)}, ``objective``, ``metrics``: {name: [unit, meaning]}.
``DIR/parts/*.parquet``
    Rows of ``flights.parquet`` as they were flown; a study that was killed goes on from them.

Controllers are listed in one order everywhere, the proposed one first.
"""

SUMMARY_KEYS = ("controller", "case", "plant", "metric")
FLIGHT_KEYS = ("controller", "case", "plant", "seed", "outcome", "steps")
