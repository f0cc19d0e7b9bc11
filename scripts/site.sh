#!/usr/bin/env bash
# Build the documentation from docs/ and the docstrings into .site, a warning being an error. It has a venv of its own, made
# anew when the list of packages or the place of this folder has changed, and needs neither ROS 2 nor compiled kernels.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
VENV=.venv-site

key="$(sha256sum <docs/requirements.txt) $PWD"
if [ "$(cat "$VENV/made_from" 2>/dev/null)" != "$key" ]; then
  echo "site: installing Sphinx into $VENV (half a minute or so)"
  rm -rf "$VENV"
  # The Python of the set-up, where there is one, is known to be able to make a venv.
  for python in .venv/bin/python3 .venv-sourced/bin/python3 python3; do
    [ ! -x "$python" ] || break
  done
  "$python" -m venv "$VENV"
  "$VENV/bin/python3" -m pip install --quiet --no-input --disable-pip-version-check -r docs/requirements.txt
  echo "$key" >"$VENV/made_from"
fi

# Nothing of a sourced ROS 2 may shine through. Every page is read anew: links between pages are checked in all of them.
env -u PYTHONPATH "$VENV/bin/python3" -m sphinx -b html --fresh-env --nitpicky --fail-on-warning --keep-going --quiet docs .site
echo "site: .site/index.html"
