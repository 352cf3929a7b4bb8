#!/bin/sh
# install_npm_reader.sh SOURCE FOLDER: read.mjs of SOURCE and the public packages that it needs into FOLDER, as
# SOURCE/package-lock.json pins them (with the hash of every package); nothing is fetched if they are there already.
set -eu
mkdir -p "$2"
cp "$1/read.mjs" "$1/package.json" "$2"
cmp -s "$1/package-lock.json" "$2/installed.json" && exit 0
cp "$1/package-lock.json" "$2"
if ! npm ci --prefix "$2" --ignore-scripts --no-audit --no-fund --fetch-retries=1 --fetch-timeout=60000; then
  echo "npm could not install the packages of $1 from $(npm config get registry): is it reachable from here?" >&2
  exit 1
fi
cp "$1/package-lock.json" "$2/installed.json"
