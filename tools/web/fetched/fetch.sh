#!/bin/sh
# fetched/fetch.sh FOLDER: what the page has from npm, as package-lock.json pins it (with the hash of every package), flat
# into FOLDER: uPlot.esm.js, uPlot.min.css, inter.woff2 and licences.txt. Nothing is fetched when it stands there already.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$1/npm"
cmp -s "$here/package-lock.json" "$1/npm/installed.json" && exit 0
cp "$here/package.json" "$here/package-lock.json" "$1/npm"
if ! npm ci --prefix "$1/npm" --ignore-scripts --no-audit --no-fund --fetch-retries=1 --fetch-timeout=60000; then
  echo "npm could not install uPlot and Inter from $(npm config get registry): is it reachable from here?" >&2
  exit 1
fi
modules=$1/npm/node_modules
cp "$modules/uplot/dist/uPlot.esm.js" "$modules/uplot/dist/uPlot.min.css" "$1"
cp "$modules/@fontsource-variable/inter/files/inter-latin-wght-normal.woff2" "$1/inter.woff2"
{
  printf 'axlecast shows its page with uPlot and the font Inter.\n\n== uPlot\n\n'
  cat "$modules/uplot/LICENSE"
  printf '\n== Inter\n\n'
  cat "$modules/@fontsource-variable/inter/LICENSE"
} >"$1/licences.txt"
cp "$here/package-lock.json" "$1/npm/installed.json"
