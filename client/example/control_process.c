/* A control process in C: follows a position, zeroes the encoder with its own permit, and handles every outcome.
 *
 *   control_process MACHINE DEVICE [BRIDGE_KEY COMMAND_KEY_FILE PERMIT_KEY_FILE]
 *
 * BRIDGE_KEY is the bridge's public key, 64 hex digits. Without keys, the machine's file must allow unsigned commands.
 * Exit codes: 0 done, 1 a part does not work, 2 usage, 3 nothing was done, 4 look at the device, 6 not known.
 *
 * gcc -std=c11 control_process.c $(pkg-config --cflags --libs axlecast-c)
 */
#define _POSIX_C_SOURCE 200809L

#include <axlecast/axlecast.h>

#include <stdio.h>
#include <time.h>

static const int64_t MS = 1000000;

static void sleep_until(int64_t instant_ns) {
  struct timespec until;
  until.tv_sec = (time_t)(instant_ns / 1000000000);
  until.tv_nsec = (long)(instant_ns % 1000000000);
  (void)clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL);
}

/* A real control process would close its loop here. */
static void print_position(const ax_position* position) {
  printf("%.4f, %.1f ms old", position->value, (double)position->age_ns * 1e-6);
  if (position->base.base_id != 0)
    printf(", base %lld +- %lld ns", (long long)position->base.ns, (long long)position->base.half_width_ns);
  printf("\n");
}

/* The first position comes when the driver has sent DEVICE, once a second. Returns 0 if there is none in time. */
static int wait_for_position(const ax_axis* axis, int64_t timeout_ns) {
  ax_position position;
  int64_t next = ax_now_ns();
  const int64_t end = next + timeout_ns;
  while (ax_axis_latest(axis, &position) != AX_OK) {
    if (next > end) {
      fprintf(stderr, "no position: %s\n", position.reason);
      return 0;
    }
    sleep_until(next += MS);
  }
  return 1;
}

/* Follows the axis for `cycles` of 1 ms. Returns how many of them had a position. */
static int follow(const ax_axis* axis, int cycles) {
  int known = 0;
  int64_t next = ax_now_ns();
  const char* reason = "";
  for (int cycle = 0; cycle < cycles; ++cycle) {
    ax_position position;
    sleep_until(next += MS);
    if (ax_axis_at(axis, next, &position) == AX_OK) {
      if (++known == 1) print_position(&position);
    } else if (position.reason != reason) {
      reason = position.reason; /* hold: never use an old position */
      printf("no position: %s\n", reason);
    }
  }
  printf("positions in %d of %d cycles\n", known, cycles);
  return known;
}

/* Sends the command and allows it in each cycle, until it has ended. */
static int zero(ax_axis* axis) {
  const char* const operations[] = {"zero_single_turn"};
  ax_command command;
  ax_error error;
  ax_id id;
  ax_result result;
  char text[33];
  ax_command_init(&command, "zero_single_turn");
  command.reason = "control_process example";
  if (ax_axis_send(axis, &command, &id, &error) != AX_OK) {
    fprintf(stderr, "%s\n", error.text);
    return 1;
  }
  ax_id_text(&id, text);
  int64_t next = ax_now_ns();
  do {
    /* Only while the machine's state allows it: the drive is off, nothing moves the axis. */
    if (ax_axis_allow(axis, operations, 1, 200) != AX_OK) return 1;
    sleep_until(next += MS);
  } while (ax_axis_await(axis, &id, 0, &result) == AX_NOT_YET);
  (void)ax_axis_withdraw(axis);
  printf("%s: %s%s%s\n", text, ax_outcome_text(result.outcome), result.text[0] != '\0' ? ": " : "", result.text);
  switch (result.outcome) {
    case AX_DONE:
    case AX_DONE_UNVERIFIED:
    case AX_PREPARED:
      return 0;
    case AX_REJECTED:
    case AX_EXPIRED:
    case AX_CANCELLED:
    case AX_NOT_ACCEPTED:
      return 3;
    case AX_FAILED:
    case AX_INDETERMINATE:
      return 4;
    case AX_UNKNOWN:
      break;
  }
  return 6;
}

int main(int argc, char** argv) {
  ax_settings settings;
  ax_error error;
  if (argc != 3 && argc != 6) {
    fprintf(stderr, "usage: control_process MACHINE DEVICE [BRIDGE_KEY COMMAND_KEY_FILE PERMIT_KEY_FILE]\n");
    return 2;
  }
  ax_settings_init(&settings);
  settings.machine = argv[1];
  settings.commands = 1;
  settings.permits = 1;
  if (argc == 6) {
    settings.bridge_key = argv[3];
    settings.command_key_file = argv[4];
    settings.permit_key_file = argv[5];
  }
  ax_connection* connection = ax_connect(&settings, &error);
  if (connection == NULL) {
    fprintf(stderr, "%s\n", error.text);
    return 1;
  }
  ax_axis* axis = ax_axis_open(connection, argv[2], NULL, &error);
  int code = 1;
  if (axis == NULL) {
    fprintf(stderr, "%s\n", error.text);
  } else {
    if (wait_for_position(axis, 10000 * MS)) {
      (void)follow(axis, 1000);
      code = zero(axis);
      (void)follow(axis, 500);
    }
  }
  ax_axis_close(axis);
  ax_disconnect(connection);
  return code;
}
