#!/bin/sh
# The committed reference equals what its sources give today.
#   tests/docs/reference.sh PYTHON TOP BIN
set -eu
made=$(mktemp -d)
trap 'rm -rf "$made"' EXIT
"$1" "$2/docs/reference/generate.py" "$3" --to "$made"
for page in messages configuration commands; do
  diff -u "$2/docs/reference/$page.md" "$made/$page.md" ||
    { echo "docs/reference/$page.md is not what its sources say: run docs/reference/generate.py $3"; exit 1; }
done
