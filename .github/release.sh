#!/bin/sh
# Makes the files of a release: wheel, sdist, package for npm, SBOMs, checksums. CONTRIBUTING.md has the other steps.
#
#   .github/release.sh v0.3.0 [FOLDER]     FOLDER is made; default: dist
#
# Needs the extra `dev`, npm, and the package registries. FOLDER/image is what the container image contains.
set -eu
tag=${1:?usage: $0 TAG [FOLDER]}
target=${2:-dist}
cd "$(dirname "$0")/.."

fail() {
    echo "$*" >&2
    exit 1
}
version=$(sed -n 's/^__version__ = "\(.*\)"$/\1/p' realizer/__init__.py)
[ "$tag" = "v$version" ] || fail "tag: wanted v$version, as realizer/__init__.py has it, got $tag"
grep -qE "^## $version - 20[0-9]{2}-[01][0-9]-[0-3][0-9]$" CHANGELOG.md ||
    fail "CHANGELOG.md: wanted a heading '## $version - YEAR-MONTH-DAY'"
grep -q "^  \"version\": \"$version\",$" clients/javascript/package.json ||
    fail "clients/javascript/package.json: wanted the version $version"
[ ! -e "$target" ] || fail "$target: wanted a folder that is not there yet"
mkdir -p "$target"
target=$(realpath "$target")

python3 -m hatchling build -d "$target"
npm pack --silent --pack-destination "$target" ./clients/javascript

# A list of what is in the image, with licences, and one of what is in the page.
WHEEL=$(echo "$target"/*.whl) docker/install.sh "$target/image"
cyclonedx-py environment "$target/image/bin/python3" --output-reproducible --output-file "$target/sbom-image.json"
npm sbom --prefix realizer/server/web --package-lock-only --omit=dev --sbom-format cyclonedx >"$target/sbom-page.json"

cd "$target"
sha256sum -- *.whl *.tar.gz *.tgz *.json >SHA256SUMS
