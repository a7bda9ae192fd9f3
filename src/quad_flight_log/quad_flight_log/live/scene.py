"""The Rerun scene of a flight that is still flown: the same entities as of a bag (``viewer``)."""

from pathlib import Path

from quad_core.geometry import rotate
from quad_core.types import Vec3
from quad_flight_log.errors import FlightLogError
from quad_flight_log.live.shapes import Sight, Trail
from quad_flight_log.report.interactive_figures import PALETTE
from quad_flight_log.report.rerun_recording import APPLICATION, TIMELINE, blueprint, log_scene, rerun
from quad_flight_log.report.vehicle_drawing import DISTURBANCE_SCALE, THRUST_SCALE, rgb

_PATH_POINTS = 4000
_PATH_EVERY = 10  # instants between two redrawn paths


class LiveScene:
    """A Rerun recording that grows; ``save`` or ``connect`` it first."""

    def __init__(self) -> None:
        """Start a recording; raises FlightLogError if rerun is not installed."""
        self._rr = rerun()
        self._out = self._rr.RecordingStream(APPLICATION)
        self._count = 0
        self._path: Path | None = None
        self._flown, self._planned = Trail(_PATH_POINTS), Trail(_PATH_POINTS)

    def save(self, path: Path) -> None:
        """Write into a .rrd file; raises FlightLogError if it cannot be written."""
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._out.save(path, default_blueprint=blueprint())
            self._path = path
        except OSError as error:
            raise FlightLogError(f"{path}: {error.strerror or error}") from error
        log_scene(self._out)

    def connect(self, port: int) -> None:
        """Send to the viewer of this machine that listens at ``port``, now or soon."""
        self._out.connect_grpc(f"rerun+http://127.0.0.1:{port}/proxy", default_blueprint=blueprint())
        log_scene(self._out)

    def again(self) -> None:
        """Begin new paths."""
        self._flown, self._planned = Trail(_PATH_POINTS), Trail(_PATH_POINTS)

    def show(self, sight: Sight) -> None:
        """Log one instant."""
        rr, out = self._rr, self._out
        out.set_time(TIMELINE, duration=sight.stamp_ns * 1e-9)
        out.log("world/vehicle", rr.Transform3D(translation=sight.position, quaternion=sight.attitude))
        if sight.thrust is not None:
            arrow = rotate(sight.attitude, Vec3(0.0, 0.0, THRUST_SCALE * sight.thrust))
            self._arrow("world/thrust", arrow, sight.position, PALETTE[1])
            out.log("thrust/achieved", rr.Scalars(sight.thrust))
        if sight.force is not None:
            force = Vec3(*(DISTURBANCE_SCALE * part for part in sight.force))
            self._arrow("world/disturbance", force, sight.position, PALETTE[2])
        if sight.reference is not None:
            target = rr.Points3D([sight.reference], colors=rgb(PALETTE[4]), radii=0.12)
            out.log("world/target", target)
            for axis, wanted, flown in zip("xyz", sight.reference, sight.position, strict=True):
                out.log(f"error/{axis}", rr.Scalars(flown - wanted))
            self._planned.add(sight.reference)
        self._flown.add(sight.position)
        if self._count % _PATH_EVERY == 0:
            self._paths()
        self._count += 1

    def flush(self) -> None:
        """Draw the paths to their ends and hand over what is still on the way, unless the viewer was closed.

        Raises FlightLogError if a file cannot be written.
        """
        self._paths()
        try:
            self._out.flush()
        except RuntimeError as error:
            if self._path:
                raise FlightLogError(f"{self._path}: {' '.join(str(error).split())}") from error

    def _arrow(self, entity: str, vector: Vec3, origin: Vec3, colour: str) -> None:
        self._out.log(entity, self._rr.Arrows3D(vectors=[vector], origins=[origin], colors=rgb(colour), radii=0.04))

    def _paths(self) -> None:
        for entity, trail, colour in (("flown", self._flown, PALETTE[0]), ("reference", self._planned, "#9aa4af")):
            if len(trail.points) > 1:
                strip = self._rr.LineStrips3D([trail.points], colors=rgb(colour), radii=0.03)
                self._out.log(f"world/{entity}", strip)
