#!/bin/sh
# isolated.sh COMMAND...: runs it with mounts, processes and a network of its own, multicast on lo; nothing of it stays.
set -eu
# In a chroot / is no mount point: there each shared mount is made private by itself. What stays shared would let mounts of
# the command out to the host.
exec unshare --mount --net --pid --fork --kill-child --propagation unchanged --mount-proc sh -c '
  # Of mounts on top of each other the last one counts: nothing reaches those below it.
  shared() {
    awk "{ is[\$5] = 0; for (i = 7; \$i != \"-\"; ++i) if (\$i ~ /^shared:/) is[\$5] = 1 }
         END { for (place in is) if (is[place]) print place }" /proc/self/mountinfo
  }
  mount --make-rprivate / 2>/dev/null || shared | while read -r place; do mount --make-private "$(printf %b "$place")"; done
  left=$(shared)
  if [ -n "$left" ]; then
    echo "isolated.sh: these mounts are shared with the host and cannot be made private:" $left >&2
    exit 1
  fi
  ip link set lo up multicast on && ip route add 224.0.0.0/4 dev lo && exec "$@"' sh "$@"
