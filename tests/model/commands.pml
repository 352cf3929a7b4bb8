/*
 * The command protocol: clients, bridge, journal, driver, device and network of one device, as docs/commands.md
 * describes it and as the product executes it. tests/model/explore.py explores it with spin. docs/proof.md states the result.
 *
 * Parameters (-D):
 *   COMMANDS=1..2              commands of different ids to the same device
 *   BRIDGE_RESTARTS=n          kills of the bridge, each followed by a start with the same journal
 *   DRIVER_RESTARTS=n          kills of the driver, each followed by a start
 * Planted faults (-D), each of which must give a counter-example:
 *   NO_EPOCH                   the driver takes an order whose epoch is not above the newest one
 *   NO_FENCING                 the driver takes orders of a bridge that a newer bridge has replaced
 *   CANCEL_ENDS_RECOVERED      a cancel ends a command of an earlier bridge that waits in the queue (a former defect)
 *   NO_MEMORY                  the driver does not store ids: a repeated order is executed again
 *   NO_BOOT_ID                 the driver takes orders for an earlier boot
 *   NO_RECOVERY                a bridge does not end what an earlier one accepted and never sent
 * For single searches (-D), see explore.py:
 *   CYCLES                     the loss of an order is a step that the search for cycles can see
 *   KEEP                       states are not merged, and repeated orders are not left out (tidy)
 *   LATE_HELLO                 the bridge may take a late HELLO of a replaced boot at any time. Progress is not judged then:
 *                              such a run need not end
 *   BREADTH                    for a search in breadth, which finds a shortest counter-example
 * TRACE: the model follows the events of a real run, which traces.py writes (trace.pml).
 *
 * What the model abstracts, and why no behaviour is lost by it:
 *   time       No clocks. Every timeout may occur at any time: validity, 5 s of silence, 20 s of an outcome check.
 *   epochs     An epoch is only compared. flight[] therefore holds the orders in the sequence of their epochs, and only those
 *              that are above the newest epoch of the driver. All others can no longer act.
 *   loss       An order may be lost, or may arrive at any later time, in any sequence.
 *   doubling   The second copy of an order is not above the newest epoch. It is only answered.
 *   statuses   A status of a driver may arrive at any time after its state was reached, as often as it likes. The bridge only
 *              acts on a final state and on UNKNOWN, so ROUTED and RUNNING are not modelled. UNKNOWN is modelled if its epoch
 *              covers all orders of the bridge (device_queue.cpp, OnUnknown). The bridge ignores it otherwise.
 *   repeats    A repeated order about a command that the driver has stored is only answered. It is not modelled.
 *   journal    A write and the step that follows it are one step where a kill between them cannot be distinguished from a
 *              lost message. Routed and the first order to the driver are two steps.
 *   FENCED     The driver answers a replaced bridge with REJECTED. The new bridge has the same order answered UNKNOWN, and
 *              concludes the same.
 * What is left out:
 *   A journal that fails, stalls or is rolled back (dispatcher_stall_test, journal_guard_test); urgent, read-only and
 *   prepared commands; signatures, permits and interlocks; several devices on a bus; more than 4,096 ids at a driver; a clean
 *   stop of a driver (it reports what a kill leaves open); a device that does a part and then fails.
 *   Two bridges with one journal, which its lock prevents. With a copy of the journal on another host they are possible. The
 *   model therefore has a replaced bridge that is alive and sends orders. Not modelled are its statuses to clients, and one of
 *   which this boot of the driver has received no order: the driver cannot know that it was replaced (EpochFence).
 */

#ifndef COMMANDS
#define COMMANDS 2
#endif
#ifndef BRIDGE_RESTARTS
#define BRIDGE_RESTARTS 2
#endif
#ifndef DRIVER_RESTARTS
#define DRIVER_RESTARTS 2
#endif

#define NOBODY COMMANDS
#define OTHER(c) (COMMANDS - 1 - (c))

/* ---- the journal: bridge/store/durable_store.h. It outlives the bridge. ---- */

/* States of a command. From REJECTED on it has its outcome; of INDETERMINATE ones, from EFFECT_SEEN on, its finding, too. */
#define NONE 0             /* not in the journal */
#define ACCEPTED 1         /* Accepted was written */
#define LEFT_ACCEPTED 2    /* as ACCEPTED, by an earlier bridge */
#define ROUTED 3           /* Routed was written, for driver[c] */
#define SILENT 4           /* INDETERMINATE, the driver did not answer (REASON_DRIVER_SILENT) */
#define LOST 5             /* INDETERMINATE, the driver restarted (REASON_DRIVER_RESTARTED) */
#define REJECTED 6
#define EXPIRED 7
#define CANCELLED 8
#define FAILED 9
#define SUCCEEDED 10
#define EFFECT_SEEN 11     /* findings after SILENT or LOST */
#define NO_EFFECT_SEEN 12
#define CANNOT_TELL 13
#define OVER 14            /* has its outcome, or was never accepted, and can no longer act */

byte journal[COMMANDS];
byte driver[COMMANDS];     /* the boot of the driver to which it was routed; 0: none */

#define NOTHING_DONE(o) ((o >= REJECTED && o <= FAILED) || o == NO_EFFECT_SEEN)
#define INDETERMINATE(o) (o == SILENT || o == LOST)
#define SETTLED(o) (o == NONE || o >= REJECTED)

/* ---- what a boot of the bridge holds in memory: bridge/dispatch/device_queue.h ---- */

#define IDLE 0
#define RECOVERED 1        /* of an earlier bridge; waits at the head of the queue (PushRecovered) */
#define READY 2            /* Routed is in the journal; not sent yet (JournalState::kReady) */
#define SENT 3             /* current_, orders were sent */
#define ASKED 4            /* current_, recovered: it is only queried */
#define CHECKED 5          /* ended INDETERMINATE; its outcome check is current (outcome_check.h) */

byte bridge_boot = 1;
byte link;                 /* DriverLink: the boot of the driver whose HELLO arrived last; 0: none */
byte current = NOBODY;     /* one command of the device at a time */
byte phase;
bool cancel_asked;         /* of current */
bool unknown;              /* STATE_UNKNOWN about current, with an epoch that covers its orders, is on its way */
byte look;                 /* answer of the outcome check's read: 0 none, 1 reads otherwise, 2 reads as after */
bool late[COMMANDS];       /* begin_by is over */

/* ---- the driver: drivers/runtime/command/driver_command_server.h. Its table is gone with its boot. ---- */

#define UNKNOWN 0          /* not in the table of driver[c] */
#define WAITING 1          /* STATE_ROUTED in the driver */
#define RUNNING 2          /* taken; nothing was sent to the device yet */
#define TOUCHED 3          /* the device has had its effect */
#define DEAD 4             /* that boot has ended without a final state */
                           /* REJECTED to SUCCEEDED: as above; what that boot has published remains on the network */
byte driver_boot = 1;
byte table[COMMANDS];
byte behind = NOBODY;      /* the command that waits behind the other one */

#define FINAL(s) (s >= REJECTED)
#define OPEN(s) (s == WAITING || s == RUNNING || s == TOUCHED)

/* ---- devices outlive all processes ---- */

byte effects[COMMANDS];
byte note = NOBODY;        /* the command that had its effect last: what a read sees */

/* ---- clients: client/command/command_session.h ---- */

byte meant_for[COMMANDS];  /* the boot of the bridge in the body, which never changes; 0: not made yet */

/* ---- the network to the driver ---- */

#define EXECUTE 1
#define QUERY 2
#define CANCEL 3
#define ORDER(kind, c) (kind + 4 * (c))
#define KIND(o) ((o) & 3)
#define ABOUT(o) (((o) >> 2) & 1)
#define OLD 8              /* sent by an earlier bridge */
#define CAPACITY 5

byte flight[CAPACITY];     /* by increasing epoch, all above the driver's newest epoch; 0: end */
byte flying;
bool received;             /* this boot of the driver has received an order of this boot of the bridge */
byte replaced = NOBODY;    /* a replaced bridge is alive and repeats this command, with epochs that it learns from the driver */

/* Scratch of one step: no part of a state. A search in breadth does not know `hidden`. */
#ifdef BREADTH
byte i, j, k, o, arrived, which;
#else
hidden byte i, j, k, o, arrived, which;
#endif

/* Orders to execute command c are of consequence. A driver that has stored the command only answers them. */
#if defined(KEEP) || defined(NO_MEMORY) || defined(NO_BOOT_ID)
#define MATTERS(c) true
#else
#define MATTERS(c) (table[c] == UNKNOWN)
#endif
/* The driver executes an order for command c. */
#ifdef NO_MEMORY
#define EXECUTES(c) true
#else
#define EXECUTES(c) (table[c] == UNKNOWN)
#endif

#ifdef TRACE
#include "trace.pml"
#define IN_SEQUENCE(c) true
#else
#define EVENT(k, c, a) true
#define NEXT skip
/* The commands are equal: the first one is made first. */
#define IN_SEQUENCE(c) (c == 0 || meant_for[OTHER(c)] != 0)
#endif

/* Puts an order into the network; its epoch is above all earlier ones (command_port.cpp, SendToDriver). */
inline send(kind, c) {
  flight[flying % CAPACITY] = ORDER(kind, c);
  flying++
}

inline remove(i) {
  k = i;
  do
  :: k < flying - 1 -> flight[k] = flight[k + 1]; k++
  :: else -> break
  od;
  flying--;
  flight[flying % CAPACITY] = 0
}

inline clear_flight() {
  do
  :: flying > 0 -> flying--; flight[flying % CAPACITY] = 0
  :: else -> break
  od;
  i = 0
}

/* ---- what must hold ---- */

#define AGREES(o, e) (e <= 1 && (!(o == SUCCEEDED || o == EFFECT_SEEN) || e == 1) && (!NOTHING_DONE(o) || e == 0))

/* Removes what can have no further consequence, so that states which only differ in it are one: orders about a command that the
   driver has; queries and cancels about one that has its outcome (they could only be lost); and all of a command that has its
   outcome and can no longer act. */
inline tidy() {
  i = 0;
  do
  :: i < flying ->
     j = ABOUT(flight[i]);
     if
     :: (KIND(flight[i]) == EXECUTE && MATTERS(j)) || (table[j] == UNKNOWN && !SETTLED(journal[j])) ||
        (KIND(flight[i]) == CANCEL && (table[j] == WAITING || table[j] == RUNNING)) -> i++
     :: else -> remove(i)
     fi
  :: else -> break
  od;
  if
  :: replaced != NOBODY && table[(replaced == NOBODY -> 0 : replaced)] != UNKNOWN -> replaced = NOBODY
  :: else
  fi;
#if !defined(TRACE) && !defined(KEEP)
  j = 0;
  do
  :: j < COMMANDS ->
     o = 0;    /* 1: it can still act */
     i = 0;
     do
     :: i < flying -> o = (ABOUT(flight[i]) == j -> 1 : o); i++
     :: else -> break
     od;
     if
     :: (journal[j] >= REJECTED && !OPEN(table[j]) && replaced != j && o == 0) ||
        (journal[j] == NONE && meant_for[j] != 0 && meant_for[j] < bridge_boot) ->
        journal[j] = OVER; table[j] = DEAD; driver[j] = 0; effects[j] = 0; meant_for[j] = 1;
        note = (note == j -> NOBODY : note)
     :: else
     fi;
     j++
  :: else -> break
  od;
#endif
  i = 0
}

/* The one outcome, or the one finding: it is written, then published (dispatcher.cpp, Conclude). */
inline conclude(c, o) {
  assert(!SETTLED(journal[c]) || journal[c] == NONE);
  assert(!INDETERMINATE(journal[c]) || o >= EFFECT_SEEN);
  assert(AGREES(o, effects[c]));
  journal[c] = o;
  late[c] = false;
  if
  :: current == c && !INDETERMINATE(o) ->
     current = NOBODY; phase = IDLE; cancel_asked = false; unknown = false; look = 0
  :: current == c && INDETERMINATE(o) ->
     phase = CHECKED; cancel_asked = false; look = 0
  :: else
  fi;
  tidy()
}

/* ---- the client of command c: client/command/command_session.cpp. It repeats its body until a status answers it, or it
   dies: its body may arrive at any time, or never. ---- */

proctype Client(byte c) {
end:
  do
  /* Learn: an answer to its query, which may be late, names a boot of the bridge. */
  :: atomic { meant_for[c] == 0 && IN_SEQUENCE(c) ->
       meant_for[c] = 1;
       do
       :: meant_for[c] < bridge_boot -> meant_for[c]++
       :: break
       od;
       d_step { tidy() } }
  od
}

/* ---- the bridge and command c ---- */

proctype Bridge(byte c) {
end:
  do
  /* dispatcher.cpp, Execute and Accept: a body of this boot, which is not known. One of an earlier boot is refused without
     an entry in the journal (STALE_BRIDGE), which no client takes for an outcome. */
  :: d_step { meant_for[c] == bridge_boot && journal[c] == NONE && EVENT(E_ACCEPTED, c, 0) ->
       NEXT; journal[c] = ACCEPTED }
  /* CheckBusy: driver absent, queue full, another bridge. */
  :: d_step { meant_for[c] == bridge_boot && journal[c] == NONE && EVENT(E_OUTCOME, c, REJECTED) ->
       NEXT; journal[c] = ACCEPTED; conclude(c, REJECTED) }

  /* device_queue.cpp, RouteNext and BeforeRoute: nothing is current, a driver is known. */
  :: d_step { journal[c] == ACCEPTED && current == NOBODY && link != 0 && EVENT(E_ROUTED, c, link) ->
       NEXT; journal[c] = ROUTED; driver[c] = link; current = c; phase = READY;
       if
       :: link == driver_boot -> table[c] = UNKNOWN
       :: else -> table[c] = DEAD
       fi }
  /* Route: the first order. */
  :: d_step { current == c && phase == READY && link == driver[c] && flying < CAPACITY && EVENT(E_SENT, c, 0) ->
       NEXT; phase = SENT;
       if
       :: table[c] == UNKNOWN -> send(EXECUTE, c)
       :: else
       fi }
  /* RouteNext: the driver restarted before this was sent to it. */
  :: d_step { current == c && phase == READY && link != driver[c] && EVENT(E_OUTCOME, c, REJECTED) ->
       NEXT; conclude(c, REJECTED) }

  /* The validity ends: admission.cpp, begin_by. A recovered command has none. */
  :: d_step { !late[c] && (journal[c] == ACCEPTED || (current == c && (phase == READY || phase == SENT))) ->
       late[c] = true }
  /* DropWaiting: too late; the driver is absent. Cancel of a waiting command. */
  :: d_step { (journal[c] == ACCEPTED || (current == c && phase == READY)) && late[c] && EVENT(E_OUTCOME, c, EXPIRED) ->
       NEXT; conclude(c, EXPIRED) }
  :: d_step { (journal[c] == ACCEPTED || (current == c && phase == READY)) && EVENT(E_OUTCOME, c, REJECTED) ->
       NEXT; conclude(c, REJECTED) }
  :: d_step { (journal[c] == ACCEPTED || (current == c && phase == READY)) && EVENT(E_OUTCOME, c, CANCELLED) ->
       NEXT; conclude(c, CANCELLED) }

  /* SendDue: repeats until it is acknowledged; queries a recovered or overdue command; asks to cancel. Each
     order has a new epoch. */
  :: d_step { current == c && phase == SENT && !late[c] && !cancel_asked && MATTERS(c) && flying < CAPACITY &&
              (flying == 0 || flight[(flying > 0 -> flying - 1 : 0)] != ORDER(EXECUTE, c)) ->
       send(EXECUTE, c) }
  :: d_step { current == c && ((phase == SENT && late[c] && !cancel_asked) || (phase == ASKED && !cancel_asked) ||
              (phase == CHECKED && journal[c] == SILENT && link == driver[c])) &&
              table[c] == UNKNOWN && !unknown && flying < CAPACITY &&
              (flying == 0 || flight[(flying > 0 -> flying - 1 : 0)] != ORDER(QUERY, c)) ->
       send(QUERY, c) }
  :: d_step { current == c && (phase == SENT || phase == ASKED) && cancel_asked && table[c] <= RUNNING &&
              flying < CAPACITY && (flying == 0 || flight[(flying > 0 -> flying - 1 : 0)] != ORDER(CANCEL, c)) ->
       send(CANCEL, c) }

  /* DeviceQueue::Cancel of a routed command, by its client. */
  :: d_step { current == c && (phase == SENT || phase == ASKED) && !cancel_asked ->
       cancel_asked = true }
#ifdef CANCEL_ENDS_RECOVERED
  :: d_step { current == c && phase == RECOVERED && EVENT(E_OUTCOME, c, CANCELLED) ->
       NEXT; conclude(c, CANCELLED) }
#else
  :: d_step { current == c && phase == RECOVERED && !cancel_asked ->
       cancel_asked = true }
#endif
  /* RouteNext of a recovered command. */
  :: d_step { current == c && phase == RECOVERED -> phase = ASKED }

  /* DeviceQueue::OnStatus: a final state of the driver that has it. */
  :: d_step { current == c && (phase == SENT || phase == ASKED) && link == driver[c] && FINAL(table[c]) &&
              EVENT(E_OUTCOME, c, table[c]) ->
       NEXT; conclude(c, table[c]) }
  /* OnUnknown: nothing up to the epoch of the answer was or will be executed. */
  :: d_step { current == c && unknown && link == driver[c] && phase == ASKED && EVENT(E_OUTCOME, c, REJECTED) ->
       NEXT; conclude(c, REJECTED) }
  :: d_step { current == c && unknown && link == driver[c] && phase == SENT && late[c] && EVENT(E_OUTCOME, c, EXPIRED) ->
       NEXT; conclude(c, EXPIRED) }
  /* Follow: another boot of the driver; 5 s of silence. */
  :: d_step { current == c && (phase == SENT || (phase == ASKED && link != 0)) && link != driver[c] &&
              EVENT(E_OUTCOME, c, LOST) ->
       NEXT; conclude(c, LOST) }
  :: d_step { current == c && (phase == SENT || phase == ASKED) && EVENT(E_OUTCOME, c, LOST) ->
       NEXT; conclude(c, SILENT) }

  /* outcome_check.cpp, FindingOfOutcome: a silent driver reports after all. */
  :: d_step { current == c && journal[c] == SILENT && link == driver[c] && table[c] == SUCCEEDED &&
              EVENT(E_FINDING, c, EFFECT_SEEN) ->
       NEXT; conclude(c, EFFECT_SEEN) }
  :: d_step { current == c && journal[c] == SILENT && link == driver[c] &&
              (unknown || table[c] == REJECTED || table[c] == EXPIRED || table[c] == CANCELLED) &&
              EVENT(E_FINDING, c, NO_EFFECT_SEEN) ->
       NEXT; conclude(c, NO_EFFECT_SEEN) }
  /* FindingOfChanges: another boot of the driver has read the device. */
  :: d_step { current == c && phase == CHECKED && look == 2 && EVENT(E_FINDING, c, EFFECT_SEEN) ->
       NEXT; conclude(c, EFFECT_SEEN) }
  :: d_step { current == c && phase == CHECKED && look == 1 && EVENT(E_FINDING, c, NO_EFFECT_SEEN) ->
       NEXT; conclude(c, NO_EFFECT_SEEN) }
  /* It was in vain for 20 s, or what was read proves nothing. */
  :: d_step { current == c && phase == CHECKED && EVENT(E_FINDING, c, CANNOT_TELL) ->
       NEXT; conclude(c, CANNOT_TELL) }

#ifndef NO_RECOVERY
  /* dispatcher.cpp, Recover: what an earlier bridge accepted and never sent. */
  :: d_step { journal[c] == LEFT_ACCEPTED && EVENT(E_OUTCOME, c, REJECTED) -> NEXT; conclude(c, REJECTED) }
#endif
#ifdef TRACE
  /* Published are only the outcome in the journal, and EXPIRED of a body that came too late to be accepted. */
  :: d_step { journal[c] >= REJECTED && journal[c] <= SUCCEEDED && EVENT(E_PUBLISHED, c, journal[c]) -> NEXT }
  :: d_step { (INDETERMINATE(journal[c]) || journal[c] >= EFFECT_SEEN) && EVENT(E_PUBLISHED, c, LOST) -> NEXT }
  :: d_step { journal[c] == NONE && meant_for[c] == bridge_boot && EVENT(E_PUBLISHED, c, EXPIRED) -> NEXT }
#endif
  od
}

/* ---- DriverLink (bridge/dispatch/command_port.cpp): a HELLO of a newer boot. A bridge that has just started may take a late
   HELLO of an earlier boot. ---- */

proctype Link() {
end:
  do
  :: d_step { link < driver_boot -> link++; look = 0 }
#ifdef LATE_HELLO
  /* A late HELLO of a replaced boot is taken if its successor has been silent for 3 s. */
  :: d_step { link > 1 -> link--; look = 0 }
#endif
  od
}

/* ---- the driver and command c: driver_command_server.cpp ---- */

inline begin(c) {
  table[c] = WAITING;
  if
  :: COMMANDS > 1 && OPEN(table[OTHER(c)]) -> behind = c
  :: else
  fi;
  tidy()
}

/* An order of the present bridge was taken: EpochFence has replaced every earlier bridge. */
inline taken_by_newest() {
  received = true;
#ifndef NO_FENCING
  replaced = NOBODY
#endif
}

inline finish(c, s) {
  table[c] = s;
  behind = NOBODY;
  tidy()
}

proctype Driver(byte c) {
end:
  do
  /* Take: one at a time, in the order of arrival. Its validity may be over (IsOver). */
  :: d_step { table[c] == WAITING && !(behind == c && OPEN(table[OTHER(c)])) && EVENT(E_TAKEN, c, 0) ->
       NEXT; table[c] = RUNNING; behind = (behind == c -> NOBODY : behind) }
  :: d_step { table[c] == WAITING && EVENT(E_REPORTED, c, EXPIRED) -> NEXT; finish(c, EXPIRED) }
  /* An interlock, or the device refuses; it does not answer; it does as it was told. */
  :: d_step { (table[c] == WAITING || table[c] == RUNNING) && EVENT(E_REPORTED, c, REJECTED) -> NEXT; finish(c, REJECTED) }
  :: d_step { table[c] == RUNNING && EVENT(E_REPORTED, c, FAILED) -> NEXT; finish(c, FAILED) }
  :: d_step { table[c] == RUNNING && EVENT(E_EFFECT, c, 0) ->
       NEXT; table[c] = TOUCHED; effects[c]++; note = c;
       assert(effects[c] <= 1);
       assert(journal[c] == ROUTED || INDETERMINATE(journal[c]) || journal[c] == CANNOT_TELL);
       tidy() }
  :: d_step { table[c] == TOUCHED && EVENT(E_REPORTED, c, SUCCEEDED) -> NEXT; finish(c, SUCCEEDED) }
  /* The read of an outcome check (RouteNext). It is an order like others: it waits for what the device executes, and its epoch
     makes all orders before it old. A driver that was silent is queried instead. */
  :: d_step { current == c && phase == CHECKED && look == 0 && link == driver_boot && !OPEN(table[OTHER(c)]) &&
              (link != driver[c] || (journal[c] == LOST && !OPEN(table[c]))) ->
       look = (note == c -> 2 : 1);
       taken_by_newest();
#ifndef NO_EPOCH
       clear_flight();
#endif
       tidy() }
  od
}

/* ---- EpochFence (command_authority.cpp) and Admit (driver_command_server.cpp): the order at place p of flight[] arrives
   before all others. Its epoch is then the newest, and all orders before it are old. ---- */

proctype Network(byte p) {
end:
  do
  :: d_step { p < flying && (KIND(flight[p]) != EXECUTE || EVENT(E_BEGUN, ABOUT(flight[p]), 0)) &&
              (KIND(flight[p]) != CANCEL || EVENT(E_REPORTED, ABOUT(flight[p]), CANCELLED)) ->
       arrived = flight[p];
       if
       :: KIND(arrived) != QUERY -> NEXT
       :: else
       fi;
       remove(p);
       i = p;
       do
       :: i > 0 ->
          i--;
#ifdef NO_EPOCH
          if
          :: !(arrived & OLD) && (flight[i] & OLD) -> remove(i)   /* fenced */
          :: else
          fi
#else
          remove(i)
#endif
       :: else -> break
       od;
       if
       :: !(arrived & OLD) -> taken_by_newest()
       :: else
       fi;
       if
       :: KIND(arrived) == EXECUTE && EXECUTES(ABOUT(arrived)) -> begin(ABOUT(arrived))
       :: KIND(arrived) == EXECUTE && !EXECUTES(ABOUT(arrived)) -> tidy()
       :: KIND(arrived) == QUERY ->
          if
          :: !(arrived & OLD) && current == ABOUT(arrived) && phase >= SENT -> unknown = true
          :: else
          fi;
          tidy()
       :: else -> finish(ABOUT(arrived), CANCELLED)
       fi }
  od
}

/* Any order may be lost. */
proctype Loss() {
end:
  do
  :: atomic { flying > 0 ->
       which = 0;
       do
       :: which < flying - 1 -> which++
       :: break
       od;
       d_step { remove(which); tidy() } }
#ifdef CYCLES
     ;
progress_lost:
     skip
#endif
  od
}

/* An order of the replaced bridge, newer than all others. The driver takes it until it has an order of the present bridge. */
proctype ReplacedBridge() {
end:
  do
  :: d_step { replaced != NOBODY -> i = replaced; replaced = NOBODY; arrived = i; begin(arrived) }
  od
}

/* ---- kill -9, at any moment. What happens between a kill and the start may as well happen before or after both. ---- */

proctype Kills() {
end:
  do
  :: atomic { bridge_boot <= BRIDGE_RESTARTS && EVENT(E_BRIDGE_KILLED, 0, 0) ->
       NEXT;
       if
#ifndef TRACE
       :: phase == SENT && !late[current] && !cancel_asked && received && driver[current] == driver_boot &&
          table[current] == UNKNOWN -> replaced = current
#endif
       :: true
       fi;
       d_step {
         bridge_boot++;
         received = false; link = 0; cancel_asked = false; unknown = false; look = 0;
         if
         :: phase == READY || phase == SENT || phase == ASKED -> phase = RECOVERED
         :: else
         fi;
         i = 0;
         do
         :: i < flying -> flight[i] = flight[i] | OLD; i++
         :: else -> break
         od;
         i = 0;
         do
         :: i < COMMANDS ->
            late[i] = false;
            if
            :: journal[i] == ACCEPTED -> journal[i] = LEFT_ACCEPTED
            :: else
            fi;
            i++
         :: else -> break
         od;
         tidy() } }
  :: d_step { driver_boot <= DRIVER_RESTARTS && EVENT(E_DRIVER_KILLED, 0, 0) ->
       NEXT;
       i = 0;
       do
       :: i < COMMANDS ->
          if
#ifdef NO_BOOT_ID
          :: true -> table[i] = UNKNOWN
#else
          :: driver[i] == driver_boot && table[i] < DEAD -> table[i] = DEAD
#endif
          :: else
          fi;
          i++
       :: else -> break
       od;
       driver_boot++;
       behind = NOBODY; replaced = NOBODY; received = false;
#ifndef NO_BOOT_ID
       clear_flight();
#endif
       tidy() }
  od
}

/* ---- progress: when nothing is left to happen, every accepted command has its outcome, and an INDETERMINATE one its finding.
   That nothing is left to happen after a while is shown by the search for cycles: see explore.py. ---- */

proctype Progress() {
end:
  timeout -> assert(SETTLED(journal[0]) && SETTLED(journal[COMMANDS - 1]))
}

init {
  atomic {
#ifdef TRACE
    c_code { LoadTrace(); };
#endif
    i = 0;
    do
    :: i < COMMANDS -> run Client(i); run Bridge(i); run Driver(i); i++
    :: else -> break
    od;
    i = 0;
    do
    :: i < CAPACITY -> run Network(i); i++
    :: else -> break
    od;
    run Loss();
    run Link();
#ifdef TRACE
    run End();
#else
    run ReplacedBridge();
    run Progress();
#endif
    run Kills()
  }
}
