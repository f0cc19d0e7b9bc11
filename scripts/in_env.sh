#!/usr/bin/env bash
# Run one command inside the environment that setup.sh made: scripts/in_env.sh ros2-or-python-command ...
set -euo pipefail
# shellcheck source=scripts/ros_env.sh
source "$(dirname "${BASH_SOURCE[0]}")/ros_env.sh"

if ! set_up_in_this_folder; then
  echo "$0: $ROOT is not set up for this terminal (ROS 2: $ROS): call make setup" >&2
  exit 1
fi
enter_venv
enter_workspace
# The solver's matrices are small: threads of the linear algebra library only get in each other's way.
export OPENBLAS_NUM_THREADS=${OPENBLAS_NUM_THREADS:-1}
exec "$@"
