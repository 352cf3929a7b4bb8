#pragma once

#include <axlecast/position_set_t.hpp>
#include <axlecast/position_t.hpp>
#include <axlecast/time_quality_t.hpp>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/base/time.h"
#include "tests/time_guests/clock_log.h"
#include "tests/time_guests/shaft_looks.h"

namespace axlecast {

// One boot of a guest.
struct Guest {
  struct Message {
    MonoNs received = 0;  // ns, CLOCK_MONOTONIC of this guest
    time_quality_t time;
  };

  struct Set {
    MonoNs received = 0;
    position_set_t set;
  };
  struct Position {
    MonoNs received = 0;
    std::string device;
    position_t position;
  };

  // What chronyd in the guest claimed of its UNIX time, as chronyc prints it.
  struct UtcClaim {
    MonoNs mono = 0;              // ns, CLOCK_MONOTONIC of this guest, known to 10 ms
    std::int64_t half_width = 0;  // ns: UNIX time is that of the server within this
  };

  std::string name;  // of the boot: b-2
  std::string host;  // name in the machine file: b
  ClockLog clocks;
  Bounds ticks_ahead;               // its counter minus that of the host that runs the guests
  std::vector<Message> messages;    // that it received, in this order; also its own
  std::vector<Position> positions;  // of all guests, that it received, in this order
  std::vector<Set> sets;            // that it received
  std::vector<UtcClaim> utc_claims;
  std::map<std::string, ShaftLooks> shafts;  // its simulated axes
  std::int64_t clock_id = 0;                 // of its own messages
  std::int64_t own_base_id = 0;              // of its own messages if it is the root; else 0
};

// Something that the test did, at an instant of CLOCK_MONOTONIC of the host that runs the guests.
struct TestEvent {
  enum class Kind {
    kPhase,     // a part of the test begins; text: its name
    kWithdraw,  // the cause of the end of the claims
    kResume,    // this cause ends
    kBeyond,    // a limit on which the claims rest is exceeded from here on
    kWithin,    // to here
  };

  MonoNs at = 0;
  Kind kind = Kind::kPhase;
  std::string text;
};

struct GuestRun {
  ClockLog host;  // that runs the guests
  std::vector<Guest> guests;
  std::vector<TestEvent> events;

  // Returns the bounds of what the host's counter was when that of the guest was within `ticks`.
  [[nodiscard]] static Bounds OnHost(const Guest& guest, const Bounds& ticks) {
    return ticks.Minus(guest.ticks_ahead);
  }
  [[nodiscard]] static Bounds OnGuest(const Guest& guest, const Bounds& ticks) {
    return ticks.Plus(guest.ticks_ahead);
  }
  // Returns the name of the part of the test to which an instant of the host's CLOCK_MONOTONIC belongs.
  [[nodiscard]] std::string PhaseAt(MonoNs time) const;
  // Returns the guest whose clock is this base, or null.
  [[nodiscard]] const Guest* Root(std::int64_t base_id) const;
  // Returns what the base was at an instant of the host's counter.
  [[nodiscard]] std::optional<Bounds> BaseAt(std::int64_t base_id, const Bounds& host_ticks) const;
};

// Reads a line of `chronyc -c tracking` after the time since the boot in s: the claim is |correction| + dispersion + delay / 2. Returns nothing
// if chronyd was not synchronised.
[[nodiscard]] std::optional<Guest::UtcClaim> ParseTracking(const std::string& line);

// Sets clock_id and own_base_id of a guest from its messages.
void Identify(Guest& guest);

// Reads what tests/time_guests/run recorded in a folder: `events`, `host.page`, and of each boot of a guest a folder NAME-NUMBER
// with `page`, `pins`, `messages.log` and perhaps `chrony.csv` and `shafts`.
[[nodiscard]] Result<GuestRun> ReadGuestRun(const std::string& folder);

}  // namespace axlecast
