"""The bag of a flight, opened; what is wrong with its place is said by the parameter that names it."""

from collections.abc import Mapping
from pathlib import Path

from quad_core.parameters import ParameterError
from quad_flight_log.bag.writer import BagWriter
from quad_flight_log.errors import FlightLogError


def opened(directory: Path, parameters_file: str, metadata: Mapping[str, str]) -> BagWriter:
    """Return a new bag in ``directory`` with ``metadata`` and the text of ``parameters_file`` (empty: none).

    Raises ParameterError if the directory cannot be recorded to or the file cannot be read.
    """
    try:
        text = Path(parameters_file).read_text("utf-8") if parameters_file else ""
        return BagWriter(directory, metadata=metadata, parameters=text)
    except UnicodeDecodeError as error:
        raise ParameterError(f"parameters_file: {parameters_file}: not UTF-8") from error
    except OSError as error:
        raise ParameterError(f"parameters_file: {parameters_file}: {error.strerror}") from error
    except FlightLogError as error:
        raise ParameterError(f"directory: {error}") from error
