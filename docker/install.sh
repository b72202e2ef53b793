#!/bin/sh
# Installs the realizer of this checkout in a virtual environment, the content of the image.
#
#   docker/install.sh TARGET [EXTRAS]     as in: docker/install.sh /opt/realizer speech,render
#
# Settings of pip (PIP_INDEX_URL, PIP_NO_DEPS ...) apply. TARGET has no pip. Without npm, the build takes Node
# from PyPI to bundle the page.
set -eu

if [ $# -lt 1 ] || [ $# -gt 2 ]; then
    echo "usage: $0 TARGET [EXTRAS]" >&2
    exit 2
fi
target=$1
# For drawing, speech and journals; without films, neural speech and alignment.
extras=${2:-speech,render,fast,stomp,cluster,jwt}
source=$(dirname "$0")/..

wheels=$(mktemp -d)
trap 'rm -rf "$wheels"' EXIT
python3 -m pip wheel --quiet --no-cache-dir --no-deps --wheel-dir "$wheels" "$source"

python3 -m venv --without-pip "$target"
python3 -m pip --python "$target/bin/python3" install --quiet --no-cache-dir "$(echo "$wheels"/*.whl)[$extras]"
# Tests of other packages are an eighth of the size.
find "$target" -type d -name tests -prune -exec rm -rf {} +

# Fail here if something is missing.
"$target/bin/realizer" --version
