#!/usr/bin/env bash
# environment.sh VENV: makes the virtual environment that everything is installed in.
# ur-rtde has wheels for CPython 3.11 and 3.12: of the first interpreter that is one of them, else of one that uv brings
# (from a mirror where UV_PYTHON_INSTALL_MIRROR names one), else of the Python there is, for which the client is built.
set -euo pipefail
cd "$(dirname "$0")/.."
venv=$1
brought=build/python
quietly="--quiet --disable-pip-version-check"

first_of() {  # VERSIONS PYTHON…: the first interpreter of one of these versions
  local versions=$1 python
  shift
  for python in "$@"; do
    "$python" -c "import sys; sys.exit(sys.version_info[:2] not in $versions)" 2>/dev/null && echo "$python" && return
  done
  return 1
}

with_wheels() { first_of '((3, 11), (3, 12))' python3.12 python3.11 python3 python "$brought"/*/bin/python3.12; }

bring() {  # Python 3.12 by uv, which comes as a package where it is not there
  local uv
  echo "make: there are no wheels of ur-rtde for $("$1" --version); bringing Python 3.12 into $brought" >&2
  uv=$(command -v uv) || {
    uv=build/tools/bin/uv
    "$1" -m venv build/tools && build/tools/bin/python -m pip install $quietly "$(cat requirements/uv.txt)"
  } && UV_PYTHON_INSTALL_DIR=$brought "$uv" python install --no-bin 3.12
}

build_client() {  # its wheel for this Python, in build/wheels
  echo "make: building the arm's client for $("$1" --version), which takes some minutes" >&2
  requirements/system.sh client "$1" && "$1" -m venv build/tools &&
    CMAKE_TOOLCHAIN_FILE=$PWD/requirements/client.cmake CMAKE_BUILD_PARALLEL_LEVEL=$(nproc) \
      build/tools/bin/python -m pip wheel $quietly --require-hashes --no-deps --no-binary ur-rtde \
      --wheel-dir build/wheels --requirement requirements/client.txt
}

built=()
if ! python=$(with_wheels); then
  python=$(first_of '((3, 13), (3, 14))' python3.13 python3.14 python3 python) || {
    echo "make: Python 3.11 to 3.14 is needed. On Debian, as root: apt-get install -y python3" >&2
    exit 2
  }
  requirements/system.sh demo "$python"
  if bring "$python"; then
    python=$(with_wheels)
  elif build_client "$python"; then
    built=(build/wheels/ur_rtde-*.whl)
  else
    echo "make: neither is to be had. Install Python 3.12, for instance by: uv python install 3.12" >&2
    exit 2
  fi
fi
requirements/system.sh demo "$python"
"$python" -m venv "$venv"
((${#built[@]} == 0)) || "$venv/bin/python" -m pip install $quietly --no-deps --no-index "${built[@]}"
