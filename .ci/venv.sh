#!/usr/bin/env bash
# Make a virtual environment: venv.sh PYTHON FOLDER. Debian ships python3 without ensurepip; the remedy is a package.
set -euo pipefail
python=$1
folder=$2

if ! command -v "$python" >/dev/null; then
  echo "$python not found. Install Python 3.11 or newer, or name it: make install PYTHON=/path/to/python3" >&2
  exit 1
fi
if ! "$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))'; then
  echo "$("$python" --version) is too old: 3.11 or newer is needed. Name another: make install PYTHON=python3.12" >&2
  exit 1
fi

has_pip() { "$folder/bin/python" -m pip --version >/dev/null 2>&1; }
make_venv() { "$python" -m venv "$folder" >/dev/null 2>&1 && has_pip; }

if [ -x "$folder/bin/python" ] && has_pip; then exit 0; fi
make_venv && exit 0

rm -rf "$folder"
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
  echo "python3-venv is missing; installing it with apt-get" >&2
  apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq python3-venv >&2 || true
  make_venv && exit 0
  rm -rf "$folder"
fi
if "$python" -m virtualenv --version >/dev/null 2>&1 && "$python" -m virtualenv --quiet "$folder" && has_pip; then
  exit 0
fi
echo "$python cannot make a virtual environment (ensurepip is missing). On Debian or Ubuntu, as root:" >&2
echo "    apt-get install python3-venv" >&2
echo "then repeat the make command." >&2
exit 1
