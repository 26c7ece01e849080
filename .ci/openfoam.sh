#!/usr/bin/env bash
# Installs Debian's OpenFOAM unless simpleFoam is there already. Needs root; says what to do where it cannot.
set -euo pipefail
if command -v simpleFoam >/dev/null; then
  echo "OpenFOAM is installed: $(command -v simpleFoam)"
  exit 0
fi
if ! command -v apt-get >/dev/null; then
  echo "This system has no apt-get. Install OpenFOAM v1912 or newer from openfoam.com, then: towtank doctor" >&2
  exit 1
fi
if [ "$(id -u)" -ne 0 ]; then
  echo "Installing OpenFOAM needs root. Run: sudo make openfoam" >&2
  exit 1
fi
export DEBIAN_FRONTEND=noninteractive
apt-get update
apt-get install -y --no-install-recommends openfoam
