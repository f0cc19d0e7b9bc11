# What setup.sh and in_env.sh share: which ROS 2 is used, where what is made for it lies, and how to enter it. Meant to be
# sourced.

ROOT=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P) # links followed: compiled kernels are found by this path

# "sourced" where a ROS 2 Jazzy environment is active and complete, else "wheels".
ros_source() {
  if [ "${ROS_DISTRO:-}" = jazzy ] && command -v colcon >/dev/null &&
    python3 -c 'import importlib.util as u, sys; sys.exit(u.find_spec("rclpy") is None)'; then
    echo sourced
  else
    echo wheels
  fi
}

ROS=$(ros_source)
# Folders of their own, so that a terminal of the one kind leaves alone what one of the other has made, and may be using.
VENV=$ROOT/.venv
WORKSPACE=$ROOT/.ws
if [ "$ROS" = sourced ]; then
  VENV=$VENV-sourced
  WORKSPACE=$WORKSPACE-sourced
fi

# What the venv is made from. The folder is part of it: neither a venv nor a colcon workspace can be moved.
venv_key() {
  local sources
  sources=$(cd "$ROOT" && cat scripts/requirements*.txt scripts/fix_exported_cmake.py | sha256sum | cut -d' ' -f1)
  echo "$ROS $sources $ROOT"
}

set_up_in_this_folder() { [[ "$(cat "$VENV/made_from" 2>/dev/null)" == *" $ROOT" ]]; }

# Enter the venv. With wheels, it is also the ROS installation, so nothing of another one may shine through.
enter_venv() {
  if [ "$ROS" = wheels ]; then
    unset PYTHONPATH AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH LD_LIBRARY_PATH _ROS_WHEELS_BOOTSTRAP_COMPLETE
    export AMENT_PREFIX_PATH=$VENV CMAKE_PREFIX_PATH=$VENV
  else
    # Where the node's script names the system's Python, that does not look into the venv by itself; Numba lies there.
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
