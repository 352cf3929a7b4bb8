#pragma once

#include <axlecast/device_info_t.hpp>
#include <axlecast/wire_t.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/base/result.h"
#include "core/base/secret.h"
#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "core/messages/message.h"
#include "drivers/runtime/axis/device_publisher.h"
#include "drivers/runtime/bus/wire_log.h"

namespace axlecast {

// One bus decoded again from its WIRE recording, by the code that drives it: each record is handed to fresh devices
// with its recorded instants. Whole from the driver's start on, a recording gives the same positions; where messages
// are missing, or it begins in the middle, that is noted as a gap, and the devices are told that the line was down.
// What was ordered of the driver is no part of WIRE: a datum that was set follows from DEVICE/<device>.
class BusRedecoder {
 public:
  // Both outlive it. Messages carry FLAG_REDECODED and the recorded driver's boot id.
  BusRedecoder(const BusConfig& bus, MessageSink& sink);

  void On(const wire_t& message);
  // The recorded driver tells of a device's datum: it holds from here on. A device of another bus is none.
  void OnDeviceInfo(const device_info_t& info);
  // Publishes what waits for a time that the recording does not reach.
  void Finish();

  // Where the recording is not whole.
  struct Gap {
    std::int64_t utime = 0;     // us, UNIX time where it goes on
    std::int64_t messages = 0;  // WIRE messages missing; 0: only records, by the driver's own count
    std::int64_t records = 0;   // that the driver could not record
    bool operator==(const Gap&) const = default;
  };
  [[nodiscard]] const std::vector<Gap>& gaps() const { return gaps_; }
  [[nodiscard]] std::int64_t messages() const { return messages_; }
  [[nodiscard]] std::int64_t events() const { return events_; }
  // Messages and records that fit nothing.
  [[nodiscard]] std::int64_t unreadable() const { return unreadable_ + reader_.unreadable(); }
  [[nodiscard]] MonoNs recorded() const { return recorded_; }  // time that the recording covers, without gaps

 private:
  // There is nothing to log in to: what was sent to a device stands in the recording.
  class NoSecrets final : public SecretSource {
   public:
    [[nodiscard]] Result<Secret> Read(const SecretPlace&) override { return Secret(); }
  };
  struct Unit {
    std::unique_ptr<DevicePublisher> channel;
    std::unique_ptr<Device> device;
    std::int64_t datum_utime = 0;  // of the datum that was last told; 0: the file's, or none
  };

  void Start(const wire_t& message);
  void FollowNumbers(const wire_t& message);
  void Interrupt(const wire_t& message, std::int64_t messages, std::int64_t records);
  void Deliver(const Event& event);
  void TickUntil(MonoNs now);

  const BusConfig& bus_;
  MessageSink& sink_;
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

}  // namespace axlecast
