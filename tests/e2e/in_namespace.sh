#!/bin/sh
# in_namespace.sh COMMAND...: runs it in a network of its own with multicast on lo, and ends whatever it leaves behind.
set -eu
user=""
[ "$(id -u)" -eq 0 ] || user="--user --map-root-user"
# shellcheck disable=SC2086 # options
# Propagation is left alone because in a chroot / is no mount point; /proc alone is made private.
exec unshare $user --net --pid --fork --kill-child --propagation unchanged --mount-proc sh -c '
  ip link set lo up multicast on && ip route add 224.0.0.0/4 dev lo && exec "$@"' sh "$@"
