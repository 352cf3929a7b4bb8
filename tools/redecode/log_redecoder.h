#pragma once

#include <array>
#include <axlecast/device_info_t.hpp>
#include <axlecast/wire_t.hpp>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/result.h"
#include "core/base/secret.h"
#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "core/config/ticks.h"
#include "core/messages/message.h"
#include "core/time/base_clock.h"
#include "drivers/runtime/axis/device_publisher.h"
#include "drivers/runtime/bus/wire_log.h"
#include "tools/log/log_event.h"

namespace axlecast {

// Compares recorded readings (position_t, motor_health_t) with the same readings decoded again. They are matched by channel and
// sampling time. All fields are compared, except FLAG_REDECODED, `seq`, because a recording may begin in the middle, and `tick`, which is
// calculated from the instant of the request. The readings of
// each side must come in the order of their times.
class RecordingDiff {
 public:
  void OnRecorded(const std::string& channel, Bytes message) { Add(channel, message, kRecorded); }
  void OnRedecoded(const std::string& channel, Bytes message) { Add(channel, message, kRedecoded); }
  // Counts the readings that no reading of the other side matches.
  void Finish();

  struct Field {
    std::string name;
    nlohmann::ordered_json recorded;
    nlohmann::ordered_json redecoded;
  };
  struct Difference {
    MonoNs mono_ns = 0;
    std::vector<Field> fields;
  };
  struct Tally {
    std::int64_t equal = 0;
    std::int64_t differing = 0;
    std::int64_t only_recorded = 0;
    std::int64_t only_redecoded = 0;
    std::vector<Difference> first;  // of those that differ, at most kShown

    [[nodiscard]] bool same() const { return differing + only_recorded + only_redecoded == 0; }
  };
  static constexpr std::size_t kShown = 5;
  [[nodiscard]] const std::map<std::string, Tally>& tallies() const { return tallies_; }  // by channel
  [[nodiscard]] bool same() const;

 private:
  enum Side { kRecorded, kRedecoded };
  struct Reading {
    MonoNs mono_ns = 0;
    std::vector<std::uint8_t> message;  // without the fields that must differ
  };
  using Waiting = std::array<std::deque<Reading>, 2>;

  void Add(const std::string& channel, Bytes message, Side side);
  static void Match(Waiting& waiting, Tally& tally);
  static void Compare(const Reading& recorded, const Reading& redecoded, Tally& tally);

  std::map<std::string, Waiting> waiting_;
  std::map<std::string, Tally> tallies_;
};

// Decodes one bus again from its WIRE recording, with the code of its driver: new devices receive each record with its recorded
// timestamps. If the recording is complete from the start of the driver, it gives the same readings. Where messages are missing,
// or if the recording begins later, this is noted as a gap, and the devices receive "link down" and "link up". WIRE contains no
// commands to the driver: a datum that was set is taken from DEVICE/<device>.
class BusRedecoder {
 public:
  // Both must outlive this object. Its messages have FLAG_REDECODED and the boot id of the recorded driver. `has_time_base`: of the machine.
  BusRedecoder(const BusConfig& bus, bool has_time_base, MessageSink& sink)
      : bus_(bus), ticks_(TicksOf(bus)), has_time_base_(has_time_base), sink_(sink) {}

  void On(const wire_t& message);
  // Applies the datum of a device, from this message on. Ignores devices of other buses.
  void OnDeviceInfo(const device_info_t& info);
  // Receives TIME of any host: the ticks of the bus are those of the time base, by the claims of its own host.
  void OnTime(Bytes message) {
    if (base_) base_->OnTime(message);
  }
  // Publishes what waits for a time after the end of the recording.
  void Finish();

  // A place at which the recording is incomplete.
  struct Gap {
    std::int64_t utime = 0;     // us, UNIX time of the first message after the gap
    std::int64_t messages = 0;  // missing WIRE messages; 0: only records are missing
    std::int64_t records = 0;   // that the driver could not record
    bool operator==(const Gap&) const = default;
  };
  [[nodiscard]] const std::vector<Gap>& gaps() const { return gaps_; }
  [[nodiscard]] std::int64_t messages() const { return messages_; }
  [[nodiscard]] std::int64_t events() const { return events_; }
  // Returns the number of messages and records that no driver can have written.
  [[nodiscard]] std::int64_t unreadable() const { return unreadable_ + reader_.unreadable(); }
  [[nodiscard]] MonoNs recorded() const { return recorded_; }  // time that the recording covers, without gaps

 private:
  // No login is needed: the recording contains what was sent to a device.
  class NoSecrets final : public SecretSource {
   public:
    [[nodiscard]] Result<Secret> Read(const SecretPlace&) override { return Secret(); }
  };
  struct Unit {
    std::unique_ptr<DevicePublisher> channel;
    std::unique_ptr<Device> device;
    std::int64_t datum_utime = 0;  // of the datum in the last DEVICE message; 0: of the file, or no datum
  };

  void Start(const wire_t& message);
  void CheckNumbers(const wire_t& message);
  void Interrupt(const wire_t& message, std::int64_t messages, std::int64_t records);
  [[nodiscard]] std::int64_t TickOf(MonoNs sent) const;
  void Deliver(const Event& event);
  void TickUntil(MonoNs now);

  const BusConfig& bus_;
  const Ticks ticks_;
  const bool has_time_base_;
  MessageSink& sink_;
  std::optional<BaseClock> base_;  // of the present boot id
  NoSecrets secrets_;
  Timebase time_;
  WireReader reader_;
  std::vector<Unit> units_;  // of the present boot id
  std::optional<std::int64_t> boot_id_;
  std::int64_t next_seq_ = 0;
  std::int64_t dropped_ = 0;
  MonoNs now_ = 0;
  MonoNs next_tick_ = 0;
  std::vector<Gap> gaps_;
  std::int64_t messages_ = 0;
  std::int64_t events_ = 0;
  std::int64_t unreadable_ = 0;
  MonoNs recorded_ = 0;
};

// Decodes a log again: each bus whose capture the log contains. Compares the readings with those in the log.
class LogRedecoder final : private MessageSink {
 public:
  // Receives the messages of the devices in order, with the time of the WIRE message from which they were decoded.
  using Output = std::function<void(const LogEvent& event)>;

  // `machine` must outlive this object. `only_bus`: name of a bus of the machine; empty: all buses.
  LogRedecoder(const MachineConfig& machine, std::string_view only_bus, Output output)
      : machine_(machine), only_bus_(only_bus), output_(std::move(output)) {}

  void On(const LogEvent& event);
  void Finish();

  // Returns the buses whose capture the log contains, by name.
  [[nodiscard]] const std::map<std::string, std::unique_ptr<BusRedecoder>>& buses() const { return buses_; }
  [[nodiscard]] const RecordingDiff& diff() const { return diff_; }
  [[nodiscard]] std::int64_t malformed() const {
    return malformed_;
  }  // messages on WIRE channels that are no wire_t

 private:
  void Publish(const std::string& channel, Bytes message) override;
  void OnWire(std::string_view bus, Bytes message);
  [[nodiscard]] bool IsSelected(const BusConfig* bus) const;
  [[nodiscard]] bool IsCaptured(std::string_view device) const;

  const MachineConfig& machine_;
  const std::string only_bus_;
  Output output_;
  std::map<std::string, std::unique_ptr<BusRedecoder>> buses_;
  RecordingDiff diff_;
  std::int64_t utime_ = 0;
  std::int64_t malformed_ = 0;
};

// Return the result: what was read of each bus, and the gaps of its capture. With `diff`, they add the comparison of the
// readings with those in the log.
[[nodiscard]] nlohmann::ordered_json ToJson(const LogRedecoder& redecoder, bool diff);
[[nodiscard]] std::string ToText(const LogRedecoder& redecoder, bool diff);

}  // namespace axlecast
