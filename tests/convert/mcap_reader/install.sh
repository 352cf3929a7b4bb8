#!/bin/sh
# mcap_reader/install.sh FOLDER: the public MCAP reader and read.mjs into FOLDER, as package-lock.json pins them (with the
# hash of every package); nothing is fetched if they are there already.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$1"
cp "$here/read.mjs" "$here/package.json" "$1"
cmp -s "$here/package-lock.json" "$1/installed.json" && exit 0
cp "$here/package-lock.json" "$1"
if ! npm ci --prefix "$1" --ignore-scripts --no-audit --no-fund --fetch-retries=1 --fetch-timeout=60000; then
  echo "npm could not install the MCAP reader from $(npm config get registry): is it reachable from here?" >&2
  exit 1
fi
cp "$here/package-lock.json" "$1/installed.json"
