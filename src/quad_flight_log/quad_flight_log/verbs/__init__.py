"""The verbs of ``log``, one module each (the contract is ``quad_flight_log.cli.Verb``)."""
