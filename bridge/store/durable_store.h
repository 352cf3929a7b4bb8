#pragma once

#include <axlecast/argument_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/base/result.h"
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
  std::string void_reason = {};   // as given to DatumVoided
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

// The reason in the history of a datum that a change of the encoder made void.
inline constexpr const char* kExchangedReason = "the encoder was exchanged";

// No datum is in force any more. The history stays, with `why`. The position is dropped too: it was counted from the
// same origin.
struct DatumVoided {
  std::int64_t utime = 0;
  std::string why;
};
// Added to the number of writes. A negative number corrects writes that were counted and not made.
struct WritesAdded {
  std::int64_t writes = 0;
  std::int64_t utime = 0;
};
struct ReferenceChanged {
  bool lost = false;
};
struct IdentityChanged {
  std::string identity;
};
// Another encoder from now on: no writes, no datum, no position, the reference not lost.
struct EncoderExchanged {
  std::string identity;
  std::int64_t utime = 0;
};
struct AlarmMarkEnded {
  AlarmMark::Kind kind = AlarmMark::Kind::kAcknowledged;
  std::string alarm;
};
// A change of what is kept of a device. A DatumRecord sets the datum, an AlarmMark replaces the mark of its kind and alarm.
using DeviceChange = std::variant<DatumRecord, DatumVoided, WritesAdded, ReferenceChanged, IdentityChanged,
                                  EncoderExchanged, AlarmMark, AlarmMarkEnded>;

// Returns false if the change leaves the record as it is, so that nothing needs to be written.
[[nodiscard]] inline bool Alters(const DeviceChange& change, const AxisRecord& record) {
  if (const auto* reference = std::get_if<ReferenceChanged>(&change))
    return reference->lost != record.reference_lost;
  if (const auto* identity = std::get_if<IdentityChanged>(&change)) return identity->identity != record.identity;
  return true;
}

// Returns true if the position of the device is dropped by the change.
[[nodiscard]] inline bool DropsPosition(const DeviceChange& change) {
  return std::holds_alternative<DatumVoided>(change) || std::holds_alternative<EncoderExchanged>(change);
}

// Durable records of devices and of their alarms.
class DeviceRecords {
 public:
  virtual ~DeviceRecords() = default;

  // Makes a change. Returns false if it could not be made durable: do nothing that depends on it.
  [[nodiscard]] virtual bool Apply(const std::string& device, const DeviceChange& change) = 0;
  // Keeps a position. Positions are written together, at most once a second. The newest may be missing after a crash.
  virtual void KeepPosition(const std::string& device, const LastPosition& position) = 0;
  virtual void Note(const AxisEvent& event) = 0;

  [[nodiscard]] virtual AxisRecord Find(const std::string& device) const = 0;
  // Returns all datums, also those that were voided, newest first.
  [[nodiscard]] virtual std::vector<DatumRecord> Datums(const std::string& device) const = 0;
  // Returns the marks in the order of their alarms.
  [[nodiscard]] virtual std::vector<AlarmMark> Marks(const std::string& device) const = 0;
};

// The bridge's memory that outlives it: commands, devices and alarms, in one place so that a crash leaves them agreeing.
class DurableStore : public DeviceRecords {
 public:
  using DeviceRecords::Find;

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

  // While an id is stored, a command with this id is answered with its outcome and not executed again.
  [[nodiscard]] virtual std::optional<command_status_t> Find(const CommandId& id) const = 0;

  // Returns the commands that an earlier bridge left without outcome, or INDETERMINATE without finding; oldest first.
  [[nodiscard]] virtual std::vector<OpenCommand> Open() const = 0;
  // Reserves `count` numbers above all that were ever reserved, and returns the first; 0 if that fails.
  [[nodiscard]] virtual std::int64_t ReserveEpochs(std::int64_t at_least, std::int64_t count) = 0;
  // Call it at least every 100 ms: writes what waits, and retries what failed.
  virtual void Tick(Timestamp now) = 0;
  // Returns true if everything that was written can be read: an id that is not found was never stored.
  [[nodiscard]] virtual bool readable() const = 0;
  // Fails while nothing can be made durable: the error is the cause and the fix.
  [[nodiscard]] virtual Result<> state() const = 0;
};

}  // namespace axlecast
