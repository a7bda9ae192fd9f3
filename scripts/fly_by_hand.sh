#!/usr/bin/env bash
# The flight of scripts/fly as five plain ROS 2 commands; --help explains.
set -u
usage() {
    cat <<'END'
usage: scripts/fly_by_hand.sh [CASE] [DIR] [ROS ARGUMENT...]

Flies CASE (default: case1) with five plain `ros2 run` commands, recorded in DIR
(default: flights/CASE-by-hand, or CASE-by-hand-2 and so on where that exists).

  scripts/fly_by_hand.sh hover flights/mine -p flight.seed:=7
  scripts/fly_by_hand.sh hover flights/mine -p trajectory:hover.duration:=2.0     a parameter of one node

Needs a sourced workspace (source scripts/env.sh, or install/setup.bash of a sourced ROS 2).
Exit code: 0 flown to the end and within the limits, 1 not, 2 bad usage or set-up.
END
}
case ${1:-} in
    --help | -h) usage; exit 0 ;;
    -*) echo "fly_by_hand.sh: found $1, expected CASE; --help explains" >&2; exit 2 ;;
esac
case=${1:-case1}
directory=${2:-flights/$case-by-hand}
if [[ -z ${2:-} ]]; then
    for ((count = 2; count < 10000; count++)); do
        [[ -e $directory ]] || break
        directory=flights/$case-by-hand-$count
    done
fi
config=$(cd "$(dirname "${BASH_SOURCE[0]}")/../src/quad_flight/quad_flight/config" && pwd -P)
arguments=(--params-file "$config/vehicles/paper.yaml" --params-file "$config/controllers/tuned.yaml"
    --params-file "$config/scenarios/$case.yaml" "${@:3}")

if ! command -v ros2 >/dev/null; then
    # Without the ROS 2 command line tools: start what `ros2 run PACKAGE EXECUTABLE` would start.
    ros2() {
        exec "$(executable "$2" "$3")" "${@:4}"
    }
fi
executable() {
    local prefixes prefix
    IFS=: read -ra prefixes <<<"${AMENT_PREFIX_PATH:-}"
    for prefix in "${prefixes[@]}"; do
        if [[ -x $prefix/lib/$1/$2 ]]; then printf '%s\n' "$prefix/lib/$1/$2" && return; fi
    done
    return 1
}
if ! executable quad_dynamics simulator >/dev/null; then
    echo "fly_by_hand.sh: no quad_dynamics simulator in AMENT_PREFIX_PATH; source scripts/env.sh first" >&2
    exit 2
fi

ros2 run quad_dynamics simulator --ros-args "${arguments[@]}" &
simulator=$!
ros2 run quad_trajectory trajectory --ros-args "${arguments[@]}" &
trajectory=$!
ros2 run quad_position_ctrl position_controller --ros-args "${arguments[@]}" &
position=$!
ros2 run quad_attitude_ctrl attitude_controller --ros-args "${arguments[@]}" &
attitude=$!
ros2 run quad_flight_log recorder --ros-args "${arguments[@]}" -p directory:="$directory" &
recorder=$!

nodes=($simulator $trajectory $position $attitude $recorder)
# `ros2 run` does not pass signals on to its node.
below() { for node in "${nodes[@]}"; do cat "/proc/$node/task/$node/children" 2>/dev/null; done; }
# SIGTERM: what a script starts in the background ignores SIGINT until it has a handler of its own.
stop() { kill -TERM "${nodes[@]}" $(below) 2>/dev/null; }
trap stop INT TERM HUP

worst=0 refused=
while ((${#nodes[@]})); do
    # Not `wait -n`: it fails for ever over a job that bash has reaped and forgotten; `wait PID` knows its code still.
    sleep 0.1
    for index in "${!nodes[@]}"; do
        if kill -0 "${nodes[index]}" 2>/dev/null; then continue; fi
        wait "${nodes[index]}"
        code=$?
        unset "nodes[index]"
        if ((code > worst)); then worst=$code; fi
        # What was refused will not join: the others need not wait for it.
        case $code in 2 | 126 | 127) refused=yes; stop ;; esac
    done
done
if [[ -n $refused ]]; then exit 2; fi
if ((worst)); then exit 1; fi
ros2 run quad_report log check "$directory" --limits "$config/limits/approach.yaml"
