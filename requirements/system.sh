#!/usr/bin/env bash
# system.sh demo|test|client [PYTHON]: what the machine itself must have, for `make`. On Debian it installs what is
# missing, and says what, as root or by sudo; elsewhere it names what is missing and ends.
#   demo    a Python that makes virtual environments
#   test    and all that the tests use
#   client  what builds the arm's client from its sources
set -euo pipefail
purpose=$1
python=${2:-python3}

missing=()
need() {  # PACKAGE TEST…: the package is missing where the test fails
  local package=$1
  shift
  "$@" >/dev/null 2>&1 || missing+=("$package")
}
found() { compgen -G "$1"; }
installed() { command -v "$1"; }
makes_environments() { "$python" -c 'import ensurepip'; }
of_debian() { dpkg -s "$1" | grep -q '^Status: install ok'; }

needs_demo() {
  need "python$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')-venv" makes_environments
}

needs_test() {
  need git installed git
  need gcc installed gcc  # the firmware's core, compiled for this machine
  need libc6-dev found '/usr/include/stdio.h'
  need gcc-arm-none-eabi installed arm-none-eabi-gcc
  need libnewlib-arm-none-eabi found '/usr/*/arm-none-eabi/*/*.specs'
  need poppler-utils installed pdftotext  # reads the certificate's PDF back, and its signature
  need xmlsec1 installed xmlsec1  # and another's view of the digital certificate's signature
  need softhsm2 installed softhsm2-util  # a token for keys to sign with
  need procps installed ps
  need postgresql found '/usr/lib/postgresql/*/bin/initdb'  # a history that rigs share
  need chromium installed chromium  # shows the operator's page
  need chromium-driver installed chromedriver  # and tests it
  if installed dpkg >/dev/null; then
    for package in libpangoft2-1.0-0 libharfbuzz-subset0 fonts-liberation fonts-dejavu-core; do  # make the PDF
      need "$package" of_debian "$package"
    done
  fi
}

needs_client() {
  need cmake installed cmake
  need g++ installed g++
  need make installed make
  need python3-dev found "$("$python" -c 'import sysconfig; print(sysconfig.get_path("include"))')/Python.h"
  need libboost-thread-dev found '/usr/include/boost/thread.hpp'
  need libboost-program-options-dev found '/usr/include/boost/program_options.hpp'
  need libboost-system-dev found '/usr/include/boost/system/error_code.hpp'
  need pybind11-dev found '/usr/include/pybind11/pybind11.h'
}

case $purpose in
  demo) needs_demo ;;
  test) needs_test ;;
  client) needs_client ;;
  *) echo "system.sh: there is no purpose $purpose" >&2; exit 2 ;;
esac
((${#missing[@]})) || exit 0

install="apt-get install -y --no-install-recommends ${missing[*]}"
if ! installed apt-get >/dev/null; then
  echo "make: this machine lacks, by Debian's names: ${missing[*]}. Install them and run again" >&2
  exit 2
elif ((EUID == 0)); then
  as_root=()
elif installed sudo >/dev/null; then
  as_root=(sudo)
else
  echo "make: this machine lacks ${missing[*]}. As root: apt-get update && $install" >&2
  exit 2
fi
echo "make: installing ${missing[*]}" >&2
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive $install -qq >/dev/null
