#!/bin/sh
# Every C++ file as clang-format writes it, every script free of shell errors.
set -eu
cd "$(dirname "$0")/../.."
git ls-files --cached --others --exclude-standard '*.h' '*.cpp' | xargs clang-format-14 --dry-run --Werror
for script in tools/demo tools/test tools/campaign tools/packages.sh .ci/run; do bash -n "$script"; done
