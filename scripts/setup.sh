#!/usr/bin/env bash
# Make this folder ready to run: system packages, a venv, a colcon workspace, and the compiled kernels. Safe to call again:
# each step is skipped while what it was made from (see the keys below) has not changed.
set -euo pipefail
# shellcheck source=scripts/ros_env.sh
source "$(dirname "${BASH_SOURCE[0]}")/ros_env.sh"
cd "$ROOT"

say() { echo "setup: $*"; }
fail() { echo "setup: $*" >&2; exit 1; }

# colcon, CMake or the search paths of a shell would trip over these, one after the other and late.
refuse_unusable_folder() {
  case $ROOT in
    *[[:space:]:\;\#\$\"\'\\]*)
      fail "the path of this folder has a space or one of : ; # \$ \" ' \\ in it, which colcon and CMake cannot take;
    move it: $ROOT" ;;
  esac
}

say_which_ros() {
  if [ "$ROS" = sourced ]; then
    say "with the sourced ROS 2 Jazzy, in .venv-sourced and .ws-sourced"
    return
  fi
  [ -z "${ROS_DISTRO:-}" ] || say "ROS_DISTRO is $ROS_DISTRO, but Jazzy with colcon and rclpy is not sourced here"
  say "with ROS 2 Jazzy as Python wheels, in .venv and .ws"
}

# Interpreters that can make a venv and have the C headers the interface package needs. 3.11 and 3.12 are the versions
# the wheels were tried with.
usable_python() {
  local candidate
  for candidate in python3 python3.12 python3.11 /usr/bin/python3; do
    if "$candidate" - 2>/dev/null <<'PY'
import ensurepip, os, sys, sysconfig
headers = os.path.join(sysconfig.get_path("include"), "Python.h")
sys.exit(not ((3, 11) <= sys.version_info[:2] <= (3, 12) and os.path.exists(headers)))
PY
    then
      command -v "$candidate"
      return
    fi
  done
}

# Debian packages this kind of set-up lacks, one a line.
missing_packages() {
  if [ "$ROS" = wheels ]; then
    command -v g++ >/dev/null || echo g++
    command -v cmake >/dev/null || echo cmake
    [ -n "$(usable_python)" ] || printf '%s\n' python3-venv python3-dev
    return
  fi
  # The node runs under the system's Python here, so its libraries must be the system's too.
  local module
  for module in numpy scipy yaml matplotlib pytest; do
    /usr/bin/python3 -c "import importlib.util as u, sys; sys.exit(u.find_spec('$module') is None)" || echo "python3-$module"
  done
  /usr/bin/python3 -c 'import ensurepip' 2>/dev/null || echo python3-venv
}

install_packages() {
  [ $# -gt 0 ] || return 0
  if [ "$(id -u)" -ne 0 ] || ! command -v apt-get >/dev/null; then
    fail "these system packages are missing; install them and call make again:
    sudo apt-get install -y $*"
  fi
  say "installing system packages: $*"
  apt-get update -qq
  DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >/dev/null
}

install_wheels() { "$VENV/bin/python3" -m pip install --quiet --no-input --disable-pip-version-check "$@"; }

make_venv() {
  local python options=() lists=(-r scripts/requirements.txt)
  if [ -e "$VENV/made_from" ]; then
    say "the lists of packages or the place of this folder have changed: making everything anew"
  fi
  rm -rf "$VENV" "$WORKSPACE"
  if [ "$ROS" = wheels ]; then
    python=$(usable_python)
    [ -n "$python" ] || fail "needs Python 3.11 or 3.12 with venv and headers (python3-venv, python3-dev)"
    lists+=(-r scripts/requirements-ros.txt)
    say "installing ROS 2 Jazzy into .venv (half a minute or so)"
  else
    python=/usr/bin/python3
    options=(--system-site-packages)
    say "installing the checkers and Numba into .venv-sourced"
  fi
  "$python" -m venv "${options[@]}" "$VENV"
  # All at once, so that Numba gets a numpy that it knows.
  if ! install_wheels "${lists[@]}" -r scripts/requirements-compiler.txt; then
    say "trying without Numba"
    install_wheels "${lists[@]}"
    say "Numba could not be installed, so kernels run interpreted, slower, with the same numbers. To try again:
    $VENV/bin/python3 -m pip install -r scripts/requirements-compiler.txt"
  fi
  [ "$ROS" != wheels ] || "$VENV/bin/python3" scripts/fix_exported_cmake.py
}

build_workspace() {
  say "building the workspace with colcon"
  mkdir -p "$WORKSPACE"
  if ! colcon --log-base "$WORKSPACE/log" build --build-base "$WORKSPACE/build" --install-base "$WORKSPACE/install" \
    --cmake-args -DBUILD_TESTING=OFF >"$WORKSPACE/colcon.txt" 2>&1; then
    cat "$WORKSPACE/colcon.txt" >&2
    fail "colcon build failed"
  fi
}

# The solver also runs without: no reason to fail.
compile_kernels() {
  local outcome
  say "compiling the kernels, once for these sources (a few minutes)"
  if outcome=$(python3 -m ctr_pvs.kernel); then
    say "$outcome"
    { echo "$1"; python3 -m ctr_pvs.kernel --where; } >"$WORKSPACE/kernels_made_from"
  else
    say "${outcome:-the kernels could not be compiled}: they run interpreted, slower, with the same numbers"
  fi
}

refuse_unusable_folder
say_which_ros

if [ "$(cat "$VENV/made_from" 2>/dev/null)" != "$(venv_key)" ]; then
  mapfile -t missing < <(missing_packages)
  install_packages "${missing[@]}"
  make_venv
  venv_key >"$VENV/made_from"
fi

# Python modules are left out on purpose: they run from the working tree (see enter_workspace).
workspace_key=$(find ctr_pvs_interfaces config launch test/data package.xml setup.cfg CMakeLists.txt \
  scripts/executable.py.in -type f -print0 | sort -z | xargs -0 sha256sum | cat - "$VENV/made_from" | sha256sum)
if [ "$(cat "$WORKSPACE/made_from" 2>/dev/null)" != "$workspace_key" ]; then
  enter_venv
  build_workspace
  echo "$workspace_key" >"$WORKSPACE/made_from"
fi

# Compiled kernels lie in the user's cache, which may have been emptied since: the second line names the folder.
kernels_key=$(find ctr_pvs/kernel -name '*.py' -print0 | sort -z | xargs -0 sha256sum | cat - "$VENV/made_from" | sha256sum)
mapfile -t kernels < <(cat "$WORKSPACE/kernels_made_from" 2>/dev/null)
if [ "${kernels[0]:-}" != "$kernels_key" ] || [ ! -e "${kernels[1]:-}/COMPLETE" ]; then
  (enter_venv && compile_kernels "$kernels_key")
fi
