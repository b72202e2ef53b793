#!/bin/sh
# What the image holds, in one folder: a virtual environment with the realizer of this checkout.
#
#   docker/install.sh TARGET [EXTRAS]     as in: docker/install.sh /opt/realizer speech,render
#
# pip's own settings (PIP_INDEX_URL, PIP_NO_DEPS ...) hold. pip itself is not in TARGET. Where npm is missing,
# the build takes a Node of its own from PyPI to bundle the page.
set -eu

if [ $# -lt 1 ] || [ $# -gt 2 ]; then
    echo "usage: $0 TARGET [EXTRAS]" >&2
    exit 2
fi
target=$1
# What a service draws, says and keeps; no films, no speech by a neural network, no alignment.
extras=${2:-speech,render,fast,stomp,cluster,jwt}
source=$(dirname "$0")/..

wheels=$(mktemp -d)
trap 'rm -rf "$wheels"' EXIT
python3 -m pip wheel --quiet --no-cache-dir --no-deps --wheel-dir "$wheels" "$source"

python3 -m venv --without-pip "$target"
python3 -m pip --python "$target/bin/python3" install --quiet --no-cache-dir "$(echo "$wheels"/*.whl)[$extras]"
# Tests of other packages: an eighth of it all.
find "$target" -type d -name tests -prune -exec rm -rf {} +

# An image that lacks something is not made.
"$target/bin/realizer" --version
