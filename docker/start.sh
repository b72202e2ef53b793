#!/bin/sh
# Starts the realizer in a container: as `realizer`, but `serve` makes a token at its first start.
#
# The token is kept in the volume /run/realizer, which containers may share. None is made where REALIZER_TOKEN,
# REALIZER_JWT_KEY or REALIZER_INSECURE is set.
set -eu
folder=${TOKEN_FOLDER:-/run/realizer}
if [ "${1:-}" = serve ] && [ -z "${REALIZER_TOKEN+x}${REALIZER_JWT_KEY+x}${REALIZER_INSECURE+x}" ]; then
    if [ ! -f "$folder/token" ]; then
        new=$(mktemp "$folder/XXXXXX")
        python3 -c "import secrets; print(secrets.token_urlsafe(24))" >"$new"
        ln "$new" "$folder/token" 2>/dev/null || true # another container was faster
        rm "$new"
    fi
    REALIZER_TOKEN=$(cat "$folder/token")
    export REALIZER_TOKEN
    echo "clients must send the token in $folder/token" >&2
fi
exec realizer "$@"
