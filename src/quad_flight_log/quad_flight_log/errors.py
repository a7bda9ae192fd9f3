"""Everything that can be wrong with a flight log, rooted in one error."""


class FlightLogError(Exception):
    """Something is wrong with a flight log; the text names the file, what was found and what was expected."""


class NotAFlightError(FlightLogError):
    """There is no MCAP flight log at that place."""


class CorruptError(FlightLogError):
    """The bytes of the log are not what the recorder wrote."""


class LimitError(FlightLogError):
    """Reading would need more memory than allowed."""


class SchemaError(FlightLogError):
    """A message definition is unknown or malformed, or a payload does not fit it."""


class TopicError(FlightLogError):
    """A topic or field is missing, ambiguous, or of another type than needed."""


class ConflictError(FlightLogError):
    """Two messages of one topic and step differ."""


class BagWriteError(FlightLogError):
    """A bag cannot be created or finished."""
