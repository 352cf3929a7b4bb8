#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "tools/fleet/channel_choice.h"
#include "tools/fleet/detail.h"
#include "tools/fleet/rows.h"
#include "tools/log/log_event.h"

namespace axlecast {

// OddRow::cause
inline constexpr const char* kOddMalformed = "malformed";      // no message of the channel's type
inline constexpr const char* kOddTime = "time out of range";   // utime is outside UtimeRange
inline constexpr const char* kOddMachine = "another machine";  // it states the id of another machine

// Composes the rows of one log: its events go in, in their order, and the rows of each batch come out.
//
// The rows of a batch are complete: seconds, minutes and runs of numbers end with it, and the database adds those of the next batch to
// them. Nothing is missing there, whatever becomes of the log afterwards.
//
// The composer keeps a little state from event to event: the alarms that are present, the last health row of each channel, the newest
// numbers, and recent commands and trips. It is a function of the log alone, so it is not stored: a composer that continues a log is primed with
// the events of the last kPrimeUs before the ledger's position; one that begins a log, with the end of the log before (of the same recorder,
// also of an earlier process), if that log exists. After a batch failed or the ledger moved, make a new composer.
// Should a state be missing (the log before was deleted), rows of an alarm, a command or a trip may be composed again; they are
// equal in the unique columns that rows.h states, and the database ignores them.
//
// Two composers never give one message twice if each log has one: ChannelChooser.
//
// No I/O, no clock. One thread. Any bytes may come in.
class RowComposer {
 public:
  // Reception times before the ledger's position from which events are to be primed with.
  static constexpr std::int64_t kPrimeUs = 12'000'000;

  // `log`: name of the log within `recorder.logs`. Without a log of that name in `facts`, no message is taken.
  // Without `facts` about a device its unit_per_count is unknown.
  RowComposer(LogFacts facts, std::string log, DetailRules detail, UtimeRange range);
  ~RowComposer();
  RowComposer(RowComposer&&) noexcept;
  RowComposer& operator=(RowComposer&&) noexcept;

  // Takes over the range of times for the next events: it moves with the server's clock.
  void SetRange(UtimeRange range);

  // Updates the state by an event that is in the database already. Gives no row and counts nothing.
  void Prime(const LogEvent& event);
  // Adds an event to the batch. Call EndStretch behind its seal.
  void Add(const LogEvent& event);
  // Ends a stretch: the records for `raw` since the last call become one row.
  void EndStretch();
  // Returns the rows of all events since the last call: ends the stretch, and every chunk, second, minute and run.
  [[nodiscard]] BatchRows Take();

 private:
  class Work;
  std::unique_ptr<Work> work_;
};

}  // namespace axlecast
