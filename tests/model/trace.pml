/*
 * Only for TRACE. The events of a real run (tests/command_simulation/command_trace.h) force the model through the same events.
 * A visible step of the model is possible only if it is the next event. All other steps are free. If the search reaches the end
 * of the trace, the real run is a run of the model. traces.py writes the numbers of the events into the file $TRACE.
 */

#define E_ACCEPTED 1       /* the journal has the acceptance */
#define E_ROUTED 2         /* ... that it is sent to this boot of the driver */
#define E_SENT 3           /* the bridge sends the first EXECUTE */
#define E_BEGUN 4          /* the driver has put it into its table */
#define E_TAKEN 5          /* ... and begins it */
#define E_EFFECT 6         /* on the device */
#define E_REPORTED 7       /* the driver has this final state */
#define E_OUTCOME 8        /* the journal has this outcome; LOST: INDETERMINATE */
#define E_FINDING 9        /* ... and this finding */
#define E_PUBLISHED 10     /* the bridge publishes this outcome */
#define E_BRIDGE_KILLED 11
#define E_DRIVER_KILLED 12
#define E_END 13

#define EVENTS 250

hidden byte kinds[EVENTS];
hidden byte commands[EVENTS];
hidden byte words[EVENTS];
byte at;                   /* the next event */

#define EVENT(k, c, a) (kinds[at] == k && commands[at] == c && words[at] == a)
#define NEXT at++; c_code { Reached(now.at); }

c_decl {
  static int length = 0;
  static int furthest = 0;
}

c_code {
  static void Print(void) { printf("reached %d of %d\n", furthest, length); }

  /* Ends the search at the end of the trace. */
  static void Reached(int event) {
    if (event > furthest) furthest = event;
    if (event == length) exit(0);
  }

  static void LoadTrace(void) {
    FILE* file = fopen(getenv("TRACE"), "r");
    int kind, command, word;
    if (file == NULL) exit(2);
    while (length < EVENTS - 1 && fscanf(file, "%d %d %d", &kind, &command, &word) == 3) {
      kinds[length] = kind;
      commands[length] = command;
      words[length] = word;
      ++length;
    }
    fclose(file);
    atexit(Print);
    Reached(0);
  }
}

proctype End() {
end:
  d_step { EVENT(E_END, 0, 0) -> NEXT }
}
