# Source this in bash: the built workspace, its Python, and the middleware as the scripts use it.
_quad_root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)
if [[ ! -f $_quad_root/install/env.bash ]]; then
    echo "scripts/env.sh: found no built workspace in $_quad_root: run scripts/setup first" >&2
    unset _quad_root
    return 2 2>/dev/null || exit 2
fi
IFS=: read -ra _quad_prefixes <<<"${AMENT_PREFIX_PATH:-}"
for _quad_prefix in "${_quad_prefixes[@]}"; do
    if [[ $_quad_prefix != "$_quad_root"/* && -f ${_quad_prefix%/*}/env.bash && -f ${_quad_prefix%/*}/.quad ]]; then
        echo "scripts/env.sh: this shell has the environment of another checkout (${_quad_prefix%/install/*}):" \
            "use a new shell for $_quad_root" >&2
        unset _quad_root _quad_prefix _quad_prefixes
        return 2 2>/dev/null || exit 2
    fi
done
unset _quad_prefix _quad_prefixes
source "$_quad_root/install/env.bash"
export QUAD_ROOT=$_quad_root
MYPYPATH=$(printf "%s:" "$_quad_root"/src/quad_*)
export MYPYPATH=${MYPYPATH%:}
export VIRTUAL_ENV=${QUAD_VENV:-$_quad_root/.venv}
if [[ ":${AMENT_PREFIX_PATH:-}:" != *":$QUAD_AMENT_PREFIX_PATH:"* ]]; then
    if [[ -z $QUAD_ROS ]]; then
        # The wheels are a ROS 2 prefix of their own, below the workspace.
        export AMENT_PREFIX_PATH=$VIRTUAL_ENV${AMENT_PREFIX_PATH:+:$AMENT_PREFIX_PATH}
        export CMAKE_PREFIX_PATH=$VIRTUAL_ENV${CMAKE_PREFIX_PATH:+:$CMAKE_PREFIX_PATH}
        export ROS_DISTRO=jazzy ROS_VERSION=2 ROS_PYTHON_VERSION=3
    fi
    export AMENT_PREFIX_PATH=$QUAD_AMENT_PREFIX_PATH${AMENT_PREFIX_PATH:+:$AMENT_PREFIX_PATH}
    export CMAKE_PREFIX_PATH=$QUAD_CMAKE_PREFIX_PATH${CMAKE_PREFIX_PATH:+:$CMAKE_PREFIX_PATH}
    export LD_LIBRARY_PATH=$QUAD_LD_LIBRARY_PATH${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
    export PYTHONPATH=$QUAD_PYTHONPATH${PYTHONPATH:+:$PYTHONPATH}
fi
if [[ ":$PATH:" != *":$VIRTUAL_ENV/bin:"* ]]; then export PATH=$VIRTUAL_ENV/bin:$PATH; fi
export RMW_IMPLEMENTATION=${RMW_IMPLEMENTATION:-rmw_fastrtps_cpp}
# This machine only: UDP on the loopback interface (docs/explanation/fast_dds.md). Transports that you have chosen hold.
if [[ ${FASTDDS_BUILTIN_TRANSPORTS:-SHM} == SHM ]]; then
    unset ROS_AUTOMATIC_DISCOVERY_RANGE FASTDDS_BUILTIN_TRANSPORTS
    export FASTRTPS_DEFAULT_PROFILES_FILE=${FASTRTPS_DEFAULT_PROFILES_FILE:-$_quad_root/src/quad_node/quad_node/fastdds.xml}
    export SKIP_DEFAULT_XML_FILE=1 # a DEFAULT_FASTRTPS_PROFILES.xml in the working folder
fi
unset _quad_root QUAD_ROS QUAD_AMENT_PREFIX_PATH QUAD_CMAKE_PREFIX_PATH QUAD_LD_LIBRARY_PATH QUAD_PYTHONPATH
hash -r
