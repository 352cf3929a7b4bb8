#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/device/operation.h"

namespace axlecast {

// A datum as the bridge gives it back to a driver, and who set it.
struct DatumRecord {
  std::int64_t number = 0;  // 1, 2, ... in the order of their setting; given by the store
  std::int64_t counts = 0;  // after direction; they read 0
  std::int64_t utime = 0;   // us, UNIX time at which it was established
  std::string identity =
      {};                  // of the encoder that it belongs to, as driver_device_t.identity; empty: it tells none
  std::string value = {};  // what the position was made to read, with its unit; empty unknown
  std::string who = {};    // name of the key; "unsigned"
  CommandId command{};     // that set it
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
  std::string identity = {};  // as its driver said last; empty never
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

  // More, or fewer where they were counted beforehand and not made.
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

}  // namespace axlecast
