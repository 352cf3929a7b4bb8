#pragma once

#include <axlecast/argument_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "core/device/operation.h"

namespace axlecast {

// A command as it was accepted or refused.
struct CommandRecord {
  command_status_t status{};
  std::vector<argument_t> arguments = {};
  std::string reason = {};          // the client's, <= 160 bytes
  std::string who = {};             // name of the key that signed; "unsigned"
  std::int64_t key_id = 0;          // 0 unsigned
  std::int64_t bridge_boot_id = 0;  // of the bridge that took it up
  std::int64_t utime = 0;           // us, UNIX time of its acceptance
  std::int64_t begin_by_utime = 0;  // us, UNIX time until which it may begin
};

// A command that was accepted and has no outcome yet.
struct OpenCommand {
  CommandRecord record = {};    // its status as noted last; driver_boot_id 0: it was never sent
  std::int64_t sent_epoch = 0;  // highest bridge epoch with which it was sent
};

// The stored commands. While an id is stored, a command with this id is answered with its outcome and not executed again.
class Journal {
 public:
  virtual ~Journal() = default;

  // Stores a command before anything is done for it. Returns false if it cannot be stored: then do not execute it.
  [[nodiscard]] virtual bool Accepted(const CommandRecord& record, Timestamp now) = 0;
  // Stores that it is about to be sent to a driver (status.driver_boot_id) with bridge epochs up to `epoch`. Returns false
  // if it must not be sent.
  [[nodiscard]] virtual bool Routed(const command_status_t& status, std::int64_t epoch, Timestamp now) = 0;
  // Stores a change of its state, progress, text or changes. The newest may be missing after a crash.
  virtual void Step(const command_status_t& status, Timestamp now) = 0;
  // Stores the outcome before it is published, and again when a finding is added. If it cannot be written, it is kept in
  // memory and written as soon as possible.
  virtual void Outcome(const command_status_t& status, Timestamp now) = 0;

  [[nodiscard]] virtual std::optional<command_status_t> Find(const CommandId& id) const = 0;
};

// A datum as the bridge gives it back to a driver, and who set it.
struct DatumRecord {
  std::int64_t number = 0;    // 1, 2, ... in the order of their setting; given by the store
  std::int64_t counts = 0;    // after direction; they read 0
  std::int64_t utime = 0;     // us, UNIX time at which it was established
  std::string identity = {};  // of the encoder that it belongs to, as driver_device_t.identity; empty: not reported
  std::string value = {};     // what the position was made to read, with its unit; empty unknown
  std::string who = {};       // name of the key; "unsigned"
  CommandId command{};        // that set it
  std::string reason = {};
  std::int64_t voided_utime = 0;  // us, UNIX time; 0: it was not made void
  std::string void_reason = {};   // as given to VoidDatum
};

// Where a shaft was when it was seen last.
struct LastPosition {
  std::int64_t counts = 0;  // after direction, before the datum
  std::int64_t utime = 0;   // us, UNIX time of the reading
};

// What the bridge knows of one device beyond the life of any process.
struct AxisRecord {
  std::string identity = {};  // as its driver reported last; empty never
  bool reference_lost = false;
  std::int64_t writes = 0;       // of its limited memory, at most
  std::int64_t since_utime = 0;  // us, UNIX time from which `writes` counts: the first command, or the exchange
  std::optional<LastPosition> position = {};
  std::optional<DatumRecord> datum = {};  // in force; none: never set, or the device's own origin was moved since
};

// Something that happened to a device without anybody's command.
struct AxisEvent {
  std::int64_t utime = 0;
  std::string device = {};  // empty: the bridge itself
  std::string kind = {};    // "moved_while_away", "encoder_exchanged", "reference_lost", "datum_restored", ...
  std::string text = {};    // with the figures, for a person
};

// Durable memory of devices. False where a change could not be made durable: nothing that depends on it may be done.
class AxisStore {
 public:
  virtual ~AxisStore() = default;

  [[nodiscard]] virtual AxisRecord Find(const std::string& device) const = 0;

  [[nodiscard]] virtual bool SetDatum(const std::string& device, const DatumRecord& datum) = 0;
  // None is in force any more; the history stays, with `why`. The position is forgotten too: it was counted from the
  // same origin.
  [[nodiscard]] virtual bool VoidDatum(const std::string& device, std::int64_t utime, const std::string& why) = 0;
  // Newest first, those that were voided too.
  [[nodiscard]] virtual std::vector<DatumRecord> Datums(const std::string& device) const = 0;

  // Adds to the number of writes. A negative number corrects writes that were counted and not made.
  [[nodiscard]] virtual bool AddWrites(const std::string& device, std::int64_t writes, std::int64_t utime) = 0;
  [[nodiscard]] virtual bool SetReferenceLost(const std::string& device, bool lost) = 0;
  [[nodiscard]] virtual bool SetIdentity(const std::string& device, const std::string& identity) = 0;
  // Another encoder from now on: no writes, no datum, no position, the reference not lost.
  [[nodiscard]] virtual bool Exchange(const std::string& device, const std::string& identity,
                                      std::int64_t utime) = 0;
  // Positions, at most once a second and all together: what was kept last may be missing after a crash.
  virtual void KeepPosition(const std::string& device, const LastPosition& position) = 0;

  virtual void Note(const AxisEvent& event) = 0;
};

// An acknowledgement or a shelving of an alarm, kept until it ends.
struct AlarmMark {
  enum class Kind : std::uint8_t { kAcknowledged, kShelved };

  Kind kind = Kind::kAcknowledged;
  std::string alarm;             // its name
  std::int64_t utime = 0;        // us, UNIX time
  std::int64_t until_utime = 0;  // kShelved
  std::string up_to = {};        // kShelved: the severity that it hides at most
  std::string who = {};          // name of the key; "unsigned"
  std::string reason = {};
  CommandId command{};
  std::int64_t driver_boot_id = 0;  // that knows of it
  std::int64_t known_utime = 0;     // since when, us of that driver's UNIX time
};

// Durable memory of them: one of a kind for each alarm of a device. False where it could not be made durable.
class AlarmStore {
 public:
  virtual ~AlarmStore() = default;

  // In the place of the one that there is.
  [[nodiscard]] virtual bool SetMark(const std::string& device, const AlarmMark& mark) = 0;
  [[nodiscard]] virtual bool EndMark(const std::string& device, AlarmMark::Kind kind, const std::string& alarm) = 0;
  // In the order of their alarms.
  [[nodiscard]] virtual std::vector<AlarmMark> Marks(const std::string& device) const = 0;
};

// The bridge's memory that outlives it: commands, devices and alarms, in one place so that a crash leaves them agreeing.
class DurableStore : public Journal, public AxisStore, public AlarmStore {
 public:
  using AxisStore::Find;
  using Journal::Find;

  // Those that an earlier bridge left without outcome, or INDETERMINATE without finding; oldest first.
  [[nodiscard]] virtual std::vector<OpenCommand> Open() const = 0;
  // A number above every one that was ever reserved; the next `count` from it are the caller's. 0: it cannot.
  [[nodiscard]] virtual std::int64_t ReserveEpochs(std::int64_t at_least, std::int64_t count) = 0;
  // At least every 100 ms: writes what waits, tries again what failed.
  virtual void Tick(Timestamp now) = 0;
  // What was written before can be read: an id that is not found is not there.
  [[nodiscard]] virtual bool readable() const = 0;
  // Why nothing can be made durable at present, and what would help; empty when all is well.
  [[nodiscard]] virtual std::string problem() const = 0;
};

}  // namespace axlecast
