/* Prints the positions of one machine's axes: print_position [URL [PREFIX]]
 *
 * The whole of what a consumer in C needs: liblcm, and position_t of `lcm-gen -c`:
 *
 *   mkdir types
 *   lcm-gen -c --c-cpath types --c-hpath types /usr/share/axlecast/lcmtypes/position_t.lcm
 *   gcc -std=c11 -Itypes print_position.c types/axlecast_position_t.c -llcm -o print_position
 *
 * A control process uses axlecast/axlecast.h instead, which also checks the clock, interpolates and sends commands: control_process.c
 */
#include <lcm/lcm.h>

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "axlecast_position_t.h"

enum { MAX_AXES = 256, MAX_CHANNEL = 64, SILENCE_MS = 1000 };
static const int64_t MAX_AGE_US = 500000;

typedef struct {
  char channel[MAX_CHANNEL];
  int64_t boot_id;
  int64_t last_seq;
} axis_t;

typedef struct {
  const char* prefix;
  axis_t axes[MAX_AXES];
  int n_axes;
  uint64_t lost; /* messages of all axes, by the gaps in seq */
} consumer_t;

/* Returns the axis of a channel; NULL if there are too many. */
static axis_t* axis_of(consumer_t* consumer, const char* channel) {
  for (int i = 0; i < consumer->n_axes; ++i)
    if (strcmp(consumer->axes[i].channel, channel) == 0) return &consumer->axes[i];
  if (consumer->n_axes == MAX_AXES || strlen(channel) >= MAX_CHANNEL) return NULL;
  axis_t* axis = &consumer->axes[consumer->n_axes++];
  memset(axis, 0, sizeof *axis);
  strcpy(axis->channel, channel);
  return axis;
}

/* Counts what is missing before this message. A driver that was restarted has another boot_id, and counts from 0 again. A message that
 * comes late stays lost. */
static void count_lost(consumer_t* consumer, const char* channel, const axlecast_position_t* position) {
  axis_t* axis = axis_of(consumer, channel);
  if (axis == NULL) return;
  if (axis->boot_id == position->boot_id) {
    if (position->seq <= axis->last_seq) return;
    consumer->lost += (uint64_t)position->seq - (uint64_t)axis->last_seq - 1;
  }
  axis->boot_id = position->boot_id;
  axis->last_seq = position->seq;
}

static void on_position(const lcm_recv_buf_t* buffer, const char* channel, const axlecast_position_t* position,
                        void* user) {
  consumer_t* consumer = (consumer_t*)user;
  const size_t skipped = strlen(consumer->prefix);
  if (strncmp(channel, consumer->prefix, skipped) != 0 || strncmp(channel + skipped, "POSITION/", 9) != 0) return;
  count_lost(consumer, channel, position);
  /* Both are UNIX time: of this host, and of the driver's host. Their clocks must agree better than MAX_AGE_US. */
  const int64_t received = buffer->recv_utime;
  const int is_fresh = position->utime >= received - MAX_AGE_US && position->utime <= received + MAX_AGE_US;
  printf("%s ", channel + skipped);
  if ((position->flags & AXLECAST_POSITION_T_FLAG_VALID) == 0)
    printf("not valid");
  else if (!is_fresh)
    printf("too old");
  else
    printf("%.3f", position->value);
  printf(" %" PRIu64 " lost\n", consumer->lost);
  (void)fflush(stdout);
}

int main(int argc, char** argv) {
  static consumer_t consumer;
  consumer.prefix = argc > 2 ? argv[2] : "";
  lcm_t* lcm = lcm_create(argc > 1 ? argv[1] : "udpm://239.255.76.67:7667?ttl=0");
  if (lcm == NULL) {
    fprintf(stderr, "LCM does not start: is there a multicast route? (ip route add 224.0.0.0/4 dev lo)\n");
    return 1;
  }
  axlecast_position_t_subscribe(lcm, ".*POSITION/.*", &on_position, &consumer);
  for (;;) {
    const int handled = lcm_handle_timeout(lcm, SILENCE_MS);
    if (handled < 0) break;
    if (handled == 0) printf("no position for %d ms\n", SILENCE_MS);
    (void)fflush(stdout);
  }
  lcm_destroy(lcm);
  return 1;
}
