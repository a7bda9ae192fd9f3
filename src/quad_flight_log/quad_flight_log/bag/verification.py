"""Whether a bag is what its recorder wrote: content decoded in full, metadata.yaml compared with the file itself."""

import json

from quad_core.parameter_files import load_yaml
from quad_flight_log.bag.notes import METADATA_FILE, ROSBAG2
from quad_flight_log.bag.reader import Flight
from quad_flight_log.errors import one_line


def problems_of(flight: Flight) -> list[str]:
    """Return what is wrong with an opened bag, empty if nothing is.

    Raises SchemaError or CorruptError where a payload or the parameters cannot be decoded.
    """
    problems = [flight.damage] if flight.truncated else []
    problems += flight.unreadable.values()
    for _ in flight.batches(*(name for name in flight.topics if name not in flight.unreadable)):
        pass
    _ = flight.parameters
    return problems + _metadata_problems(flight)


def _metadata_problems(flight: Flight) -> list[str]:
    path = flight.path.parent / METADATA_FILE
    if not path.is_file():
        return [f"{path}: missing"]
    try:
        about = load_yaml(path.read_text(encoding="utf-8"))["rosbag2_bagfile_information"]
        counts = {
            item["topic_metadata"]["name"]: (item["topic_metadata"]["type"], item["message_count"])
            for item in about["topics_with_message_count"]
        }
        files = list(about["relative_file_paths"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        return [f"{path}: cannot be read ({type(error).__name__}: {one_line(error)})"]
    have = {topic.name: (topic.type, topic.messages) for topic in flight.topics.values()}
    expected = flight.file_names
    problems = [f"{path}: names the files {files}, expected {expected}"] if files != expected else []
    if counts != have:
        wrong = sorted(name for name in {*counts, *have} if counts.get(name) != have.get(name))
        problems.append(f"{path}: types or counts differ from the bag's: {', '.join(wrong)}")
    inside = flight.record(ROSBAG2).get("serialized_metadata")
    if not problems and inside is not None and len(files) == 1 and _canonical(inside) != _as_json(about):
        problems.append(f"{path}: differs from the metadata that the bag itself holds")
    return problems


def _canonical(text: str) -> str:
    try:
        return _as_json(load_yaml(text))
    except ValueError:
        return ""


def _as_json(content: object) -> str:
    # 1, 1.0 and true are equal in Python, and different in JSON
    return json.dumps(content, sort_keys=True, default=repr)
