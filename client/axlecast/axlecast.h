/* The C interface of axlecast for control processes: positions, sets of positions, permits and commands of a machine's devices.
 * docs/control_process.md describes it with an example. C11 and C++.
 *
 *   ax_settings settings;
 *   ax_settings_init(&settings);
 *   settings.machine = "press1";
 *   ax_error error;
 *   ax_connection *connection = ax_connect(&settings, &error);
 *   if (connection == NULL) ... error.text
 *   ax_axis *axis = ax_axis_open(connection, "axis1", NULL, &error);
 *   ... in the control loop:
 *   ax_position position;
 *   if (ax_axis_at(axis, ax_now_ns(), &position) == AX_OK) use(position.value);
 *   else hold(position.reason);
 *
 * Link axlecast-c (pkg-config) or axlecast::c (CMake).
 *
 * Threads: every function may be called from any thread, except that nothing may use a handle while it is being closed. A connection
 * has threads of its own: one receives positions; with commands and permits, one more for each. No function waits for the network or
 * for another thread, except where its comment states a time. No function throws or ends the process.
 *
 * Instants are ns on CLOCK_MONOTONIC of this host, unless stated otherwise. Positions are advisory: they are not signed.
 */
/* NOLINTBEGIN: the language is C. */
#ifndef AXLECAST_AXLECAST_H
#define AXLECAST_AXLECAST_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct ax_connection ax_connection;
typedef struct ax_axis ax_axis;
typedef struct ax_set ax_set;

/* How a call ended. ax_code_text returns it in words. */
typedef enum ax_code {
  AX_OK = 0,
  AX_NO_POSITION = 1, /* there is no position that may be used: ax_position.reason */
  AX_NOT_YET = 2,     /* no outcome within the time: the command is still followed */
  AX_ARGUMENT = 3,    /* an argument is null or out of range */
  AX_UNUSABLE = 4, /* a port, a key or a thread does not work, or the settings do not ask for it: ax_error.text */
  AX_NOT_SENT = 5, /* the system refused to send the message */
  AX_MEMORY = 6    /* out of memory */
} ax_code;

/* Returns a text that is never freed. */
const char* ax_code_text(ax_code code);

/* The cause and the fix, for a person. Every function that takes one accepts NULL. */
typedef struct ax_error {
  ax_code code;
  char text[256];
} ax_error;

/* CLOCK_MONOTONIC of this host. */
int64_t ax_now_ns(void);

/* -- connection ------------------------------------------------------------------------------------------------------------- */

/* Texts are copied by ax_connect. NULL is the same as "". */
typedef struct ax_settings {
  const char* data_url;         /* lcm: url of the machine's file */
  const char* command_url;      /* lcm: command_url */
  const char* prefix;           /* lcm: prefix */
  const char* machine;          /* its name; messages of other machines are ignored. "": those of all are taken */
  const char* bridge_key;       /* bridge: key: public, 64 hex digits. "": every status is believed */
  int commands;                 /* 1: this connection sends commands */
  const char* command_key_file; /* the key that signs them, a file of axlecast keygen; "": unsigned */
  const char* command_key_credential; /* or a systemd credential */
  int permits;                        /* 1: this connection issues permits */
  const char* permit_key_file;        /* the key of role control that signs them */
  const char* permit_key_credential;  /* or a systemd credential */
} ax_settings;

/* Sets the URLs of a machine on one host; no commands, no permits. */
void ax_settings_init(ax_settings* settings);

/* Returns NULL if a part that the settings ask for does not work. Takes up to 3 s where multicast does not work. */
ax_connection* ax_connect(const ax_settings* settings, ax_error* error);
/* Handles of this connection may be closed later; until then they answer with what was received. NULL is ignored. */
void ax_disconnect(ax_connection* connection);

/* An instant on the time base of the machine: within ns +- half_width_ns. Comparable only if base_id is equal. */
typedef struct ax_instant {
  int64_t base_id; /* 0: the instant is not known: reason */
  int64_t ns;
  int64_t half_width_ns;
  const char* reason; /* why it is not known; "" if it is. Never freed */
} ax_instant;

/* Converts an instant of this host. AX_NO_POSITION if it is not known. */
ax_code ax_on_base(const ax_connection* connection, int64_t mono_ns, ax_instant* instant);

/* -- positions -------------------------------------------------------------------------------------------------------------- */

/* 0 or less: the default, which follows the device's DEVICE message. */
typedef struct ax_axis_options {
  int64_t max_age_ns;           /* older readings are stale; default: max_age_us of the device */
  int64_t max_extrapolation_ns; /* after the newest reading; default: two periods of the device, at least 5 ms */
  int64_t max_gap_ns;           /* between two readings; default: three periods of the device, at least 50 ms */
  int64_t
      max_time_half_width_ns; /* readings of another host count if their instant is known to this; default: none of them */
} ax_axis_options;

/* Whether the newest reading may be used. ax_freshness_text returns it in words. */
typedef enum ax_freshness {
  AX_FRESH = 0,
  AX_STALE = 1,         /* the newest valid reading is too old */
  AX_NOT_VALID = 2,     /* the driver marks the newest reading as not valid */
  AX_NO_READING = 3,    /* no valid reading has arrived yet */
  AX_LIMIT_UNKNOWN = 4, /* no DEVICE message has arrived yet, which states the maximum age */
  AX_WRONG_CLOCK = 5,   /* the reading lies in the future */
  AX_OTHER_CLOCK = 6,   /* it is of another host, and max_time_half_width_ns is not set */
  AX_TIME_UNKNOWN = 7,  /* it is of another host, and its instant is not known well enough */
  AX_TWO_PUBLISHERS = 8 /* two drivers publish this device */
} ax_freshness;
const char* ax_freshness_text(ax_freshness freshness);

/* Bits of ax_position.flags and ax_set_axis.flags; docs/positions.md describes all of them. Ignore others. */
enum {
  AX_FLAG_VALID = 0x1,
  AX_FLAG_TURNS_VALID = 0x2,
  AX_FLAG_REFERENCED = 0x8,
  AX_FLAG_SPEED_VALID = 0x10,
  AX_FLAG_SIMULATED = 0x2000
};

/* A position at one instant. The numbers of a position that may not be used are NaN or 0. */
typedef struct ax_position {
  double value;               /* in the unit of the device */
  double counts;              /* absolute, after direction and datum */
  double timing_error_counts; /* how far it may be off because the instants of the readings are uncertain */
  double speed_rad_s;         /* of the newest reading; NaN: not known */
  int64_t mono_ns;            /* the instant that the position is for */
  int64_t age_ns;             /* of the newest valid reading, now; negative: none has arrived */
  ax_instant base;            /* the same instant on the time base, with the uncertainty of the reading */
  int32_t unit;               /* position_t UNIT_*: 0 count, 1 turn, 2 rad, 3 deg, 4 mm, 5 m, 6 um, 7 inch */
  int32_t flags;              /* AX_FLAG_* */
  int32_t datum_epoch;        /* counts of different epochs are not comparable */
  ax_freshness freshness;     /* of the newest reading, now */
  const char* reason;         /* why there is no position; "" if there is one. Never freed */
} ax_position;

/* `options`: NULL for the defaults. Returns NULL if the name is not that of a device. */
ax_axis* ax_axis_open(ax_connection* connection, const char* device, const ax_axis_options* options,
                      ax_error* error);
/* NULL is ignored. */
void ax_axis_close(ax_axis* axis);

/* The newest reading, at its own instant. AX_NO_POSITION if it is not fresh. */
ax_code ax_axis_latest(const ax_axis* axis, ax_position* position);
/* The position at an instant between two readings or shortly after the newest one. AX_NO_POSITION: position.reason. */
ax_code ax_axis_at(const ax_axis* axis, int64_t mono_ns, ax_position* position);

/* -- permits ---------------------------------------------------------------------------------------------------------------- */

/* Allows exactly these operations, until valid_ms (1..500) after this call. Call it in every cycle while the machine is in a state
 * that allows them: a few us, nothing is sent in this thread. Without further calls, the permit lapses. */
ax_code ax_axis_allow(ax_axis* axis, const char* const* operations, size_t n_operations, int32_t valid_ms);
/* Allows nothing any more; sends that in this thread, about 0.1 ms. */
ax_code ax_axis_withdraw(ax_axis* axis);

/* -- commands --------------------------------------------------------------------------------------------------------------- */

/* The id of a command. Store it, if you need the outcome after a restart of your program. */
typedef struct ax_id {
  uint8_t bytes[16];
} ax_id;
/* 32 hex digits and a NUL. */
void ax_id_text(const ax_id* id, char text[33]);
/* AX_ARGUMENT if the text is no id. */
ax_code ax_id_parse(const char* text, ax_id* id);

typedef struct ax_argument {
  const char* key;
  const char* value;
} ax_argument;

typedef struct ax_command {
  const char* operation;
  const ax_argument* arguments;
  size_t n_arguments;   /* at most 16 */
  int32_t valid_ms;     /* it may begin within this time, 1..3600000 */
  int32_t expect_epoch; /* refused if the device's datum_epoch differs; -1: any */
  const char* reason;   /* for the journal, at most 160 bytes */
} ax_command;

/* No arguments, valid for 5 s, any epoch. */
void ax_command_init(ax_command* command, const char* operation);

typedef enum ax_outcome {
  AX_DONE = 0,            /* and read back */
  AX_DONE_UNVERIFIED = 1, /* the device confirmed it, but allows no read-back */
  AX_PREPARED = 2,        /* of a command of another process: nothing was done */
  AX_REJECTED = 3,        /* nothing was done */
  AX_EXPIRED = 4,         /* nothing was done */
  AX_CANCELLED = 5,       /* nothing was done */
  AX_FAILED = 6,          /* it may have been done in part: look at the device */
  AX_INDETERMINATE = 7,   /* it is not known whether it was done: look at the device */
  AX_NOT_ACCEPTED = 8,    /* no bridge took it: nothing was done */
  AX_UNKNOWN = 9 /* no outcome is known: never the same as failed. Ask for the id later, do not send it again */
} ax_outcome;
const char* ax_outcome_text(ax_outcome outcome);

typedef struct ax_result {
  ax_outcome outcome;
  int under_way;       /* 1: it has not ended; the outcome is AX_UNKNOWN */
  int temporary;       /* 1: nothing was done, and the same command may be accepted later */
  float progress;      /* 0..1 */
  int32_t epoch_after; /* datum_epoch after it; -1 not known */
  char reason[32];     /* a word of docs/commands.md, "Reasons" */
  char text[256];      /* what happened, the measured value, what to do: for a person */
} ax_result;

/* Sends a command for this device and returns at once. Many may be under way. AX_OK: `id` is known; the outcome comes by
 * ax_axis_await, also that of a command that cannot be sent. */
ax_code ax_axis_send(ax_axis* axis, const ax_command* command, ax_id* id, ax_error* error);
/* Waits at most timeout_ms for the outcome; 0 looks at it and returns at once. AX_NOT_YET: result->under_way is 1. */
ax_code ax_axis_await(ax_axis* axis, const ax_id* id, int64_t timeout_ms, ax_result* result);
/* Asks for the command to be given up. It still ends in its one outcome. */
ax_code ax_axis_cancel(ax_axis* axis, const ax_id* id);
/* Asks the bridge for a command of any process, also of an earlier one. Waits at most timeout_ms. */
ax_code ax_axis_query(ax_axis* axis, const ax_id* id, int64_t timeout_ms, ax_result* result);

/* -- sets of positions ------------------------------------------------------------------------------------------------------ */

enum { AX_SET_AXES = 16 };

typedef enum ax_set_state {
  AX_SET_ALIGNED = 0,     /* every axis is good, and all were sampled within limit_ns */
  AX_SET_NOT_ALIGNED = 1, /* every axis is good, but they were sampled further apart */
  AX_SET_INCOMPLETE = 2   /* an axis is not good */
} ax_set_state;

typedef enum ax_set_axis_state {
  AX_SET_AXIS_GOOD = 0,
  AX_SET_AXIS_MISSING = 1,     /* no reading of this tick arrived in time */
  AX_SET_AXIS_NOT_VALID = 2,   /* the driver marks the reading as not valid */
  AX_SET_AXIS_TIME_UNKNOWN = 3 /* its instant on the base is not known */
} ax_set_axis_state;

typedef struct ax_set_axis {
  char device[32];
  ax_set_axis_state state;
  int64_t at_ns;         /* ns of the base, middle of the interval that holds the sampling instant */
  int64_t half_width_ns; /* -1: not known, and at_ns means nothing */
  int64_t counts;
  double value;
  double speed_rad_s;
  int32_t unit;
  int32_t flags;
  int32_t datum_epoch;
} ax_set_axis;

typedef struct ax_set_reading {
  ax_set_state state;
  int64_t tick;        /* number of the tick of the time base */
  int64_t tick_ns;     /* ns of the base */
  int64_t base_id;     /* 0: CLOCK_MONOTONIC of the one host that reads all axes */
  int64_t earliest_ns; /* ns of the base: all good axes were sampled between these two */
  int64_t latest_ns;
  int64_t limit_ns;
  int64_t since_arrival_ns; /* since this set arrived here: its age is greater */
  int64_t lost;             /* sets that were lost on their way, since the handle was opened */
  int32_t n_axes;
  ax_set_axis axes[AX_SET_AXES]; /* in the order of the machine's file */
} ax_set_reading;

/* A set of the machine's file. Returns NULL if the name is not that of a set. */
ax_set* ax_set_open(ax_connection* connection, const char* name, ax_error* error);
/* NULL is ignored. */
void ax_set_close(ax_set* set);
/* The newest set, whatever its state. AX_NO_POSITION: none has arrived. */
ax_code ax_set_read(const ax_set* set, ax_set_reading* reading);

#ifdef __cplusplus
}
#endif

#endif
/* NOLINTEND */
