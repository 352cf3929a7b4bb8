#!/bin/sh
# uplot/fetch.sh FOLDER: installs uPlot from npm into FOLDER, as package-lock.json pins it by its hash, and copies its files
# there: uPlot.esm.js, uPlot.min.css and LICENSE. Fetches nothing when that version is in FOLDER already.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$1/npm"
cmp -s "$here/package-lock.json" "$1/npm/installed.json" && exit 0
cp "$here/package.json" "$here/package-lock.json" "$1/npm"
npm ci --prefix "$1/npm" --ignore-scripts --no-audit --no-fund --fetch-retries=1 --fetch-timeout=30000
module=$1/npm/node_modules/uplot
cp "$module/dist/uPlot.esm.js" "$module/dist/uPlot.min.css" "$module/LICENSE" "$1"
cp "$here/package-lock.json" "$1/npm/installed.json"
