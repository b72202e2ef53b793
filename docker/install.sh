#!/bin/sh
# Installs the realizer of this checkout in a virtual environment, the content of the image.
#
#   docker/install.sh TARGET [EXTRAS]     as in: docker/install.sh /opt/realizer speech,render
#   WHEEL=dist/NAME.whl docker/install.sh TARGET     a wheel that is there already
#
# Without EXTRAS, requirements.txt says the version and the hash of each package. Settings of pip (PIP_INDEX_URL,
# PIP_NO_DEPS ...) apply. TARGET has no pip. Without npm, the build of a wheel takes Node from PyPI for the page.
set -eu

if [ $# -lt 1 ] || [ $# -gt 2 ]; then
    echo "usage: $0 TARGET [EXTRAS]" >&2
    exit 2
fi
target=$1
here=$(dirname "$0")
# For drawing, speech and journals; without films, neural speech and alignment.
extras=${2:-speech,render,fast,stomp,cluster,jwt}

wheel=${WHEEL:-}
if [ -z "$wheel" ]; then
    built=$(mktemp -d)
    trap 'rm -rf "$built"' EXIT
    python3 -m pip wheel --quiet --no-cache-dir --no-deps --wheel-dir "$built" "$here/.."
    wheel=$(echo "$built"/*.whl)
fi

install() {
    python3 -m pip --python "$target/bin/python3" install --quiet --no-cache-dir "$@"
}
python3 -m venv --without-pip "$target"
if [ -z "${2:-}" ]; then
    install --require-hashes --requirement "$here/requirements.txt"
    install --no-deps "$wheel"
    python3 -m pip --python "$target/bin/python3" check
else
    install "${wheel}[$extras]"
fi
# Tests of other packages are an eighth of the size.
find "$target" -type d -name tests -prune -exec rm -rf {} +

# Fail here if something is missing.
"$target/bin/realizer" --version
