# Shell functions shared by setup.sh and in_env.sh: which ROS 2 is used, and how to enter it. Meant to be sourced.

ROOT=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P) # links followed: compiled kernels are found by this path
VENV=$ROOT/.venv
WORKSPACE=$ROOT/.ws

# "sourced" where a ROS 2 Jazzy environment is active and complete, else "wheels".
ros_source() {
  if [ "${ROS_DISTRO:-}" = jazzy ] && command -v colcon >/dev/null &&
    python3 -c 'import importlib.util as u, sys; sys.exit(u.find_spec("rclpy") is None)'; then
    echo sourced
  else
    echo wheels
  fi
}

# Enter the venv. With wheels, it is also the ROS installation, so nothing of another one may shine through.
enter_venv() {
  if [ "$1" = wheels ]; then
    unset PYTHONPATH AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH LD_LIBRARY_PATH _ROS_WHEELS_BOOTSTRAP_COMPLETE
    export AMENT_PREFIX_PATH=$VENV CMAKE_PREFIX_PATH=$VENV
  else
    # The node's script names the system's Python, which does not look into .venv by itself; Numba lies there.
    export PYTHONPATH=${PYTHONPATH:+$PYTHONPATH:}$(echo "$VENV"/lib/python3*/site-packages)
  fi
  export VIRTUAL_ENV=$VENV PATH=$VENV/bin:$PATH
}

# Enter the built workspace; Python code comes from the working tree, so editing it needs no rebuild.
enter_workspace() {
  set +u # colcon's scripts read unset variables
  # shellcheck disable=SC1091
  source "$WORKSPACE/install/local_setup.bash"
  set -u
  export PATH=$WORKSPACE/install/ctr_pvs/lib/ctr_pvs:$PATH
  export PYTHONPATH=$ROOT${PYTHONPATH:+:$PYTHONPATH}
}
