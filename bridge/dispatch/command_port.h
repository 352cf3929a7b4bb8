#pragma once

#include <axlecast/command_body_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <axlecast/command_t.hpp>
#include <axlecast/driver_order_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "core/command/keys.h"
#include "core/config/machine_config.h"
#include "core/messages/message.h"
#include "core/messages/origin.h"

namespace axlecast {

// The state of the driver of one bus, from DRIVER_STATUS.
class DriverLink {
 public:
  static constexpr MonoNs kAbsentAfter = 3 * kSecond;  // since its last message; a driver sends HELLO once a second

  // Sets the devices of the bus. Call it first. Other devices in a message are ignored.
  void Expect(const std::vector<DeviceConfig>& devices);

  // Returns false if the message is from a boot that was replaced, or from one that has not sent HELLO yet.
  [[nodiscard]] bool On(const driver_status_t& status, MonoNs now);

  [[nodiscard]] bool IsPresent(MonoNs now) const { return IsRunning() && now - last_seen_ <= kAbsentAfter; }
  // Returns true if the driver sent GOODBYE, or sent nothing for kAbsentAfter. A driver that was not received yet counts
  // as absent only after this time.
  [[nodiscard]] bool IsAbsent(MonoNs now) const { return gone_ || now - last_seen_ > kAbsentAfter; }
  void ListenFrom(MonoNs now) { last_seen_ = now; }
  // Returns true if a driver was received, and it has not sent GOODBYE.
  [[nodiscard]] bool IsRunning() const { return boot_id_ != 0 && !gone_; }
  [[nodiscard]] std::int64_t boot_id() const { return boot_id_; }
  // Returns true if the device was ONLINE or DEGRADED in the last HELLO.
  [[nodiscard]] bool IsAnswering(const std::string& device) const;
  [[nodiscard]] std::size_t devices() const { return states_.size(); }

 private:
  static constexpr std::size_t kRemembered = 64;  // replaced boots

  void Replace(std::int64_t boot_id);

  std::int64_t boot_id_ = 0;  // 0: none received yet
  bool gone_ = false;
  MonoNs last_seen_ = 0;
  std::map<std::string, std::int8_t> states_;  // of the bus's devices, all of them
  std::deque<std::int64_t> replaced_;
};

// Notices a second bridge on the command port, by the boot id in COMMAND_STATUS. A bridge asks around before it
// serves, so that the later of two gives way; should two serve in spite of that, neither takes up anything new.
class DuplicateBridgeDetector {
 public:
  static constexpr MonoNs kListen = 300 * kMillisecond;  // after the start, before it serves
  static constexpr MonoNs kForget = 10 * kSecond;        // after the other's last word

  DuplicateBridgeDetector(std::int64_t boot_id, MonoNs now)
      : boot_id_(boot_id), serves_from_(now + kListen), next_probe_(now) {}

  void OnOther(std::int64_t boot_id, MonoNs now);
  // A question (MODE_QUERY) that any bridge answers; while listening, every 100 ms.
  [[nodiscard]] std::optional<command_t> Probe(MonoNs now);

  [[nodiscard]] bool IsListening(MonoNs now) const { return now < serves_from_; }
  // Returns the boot id of another bridge that has sent a message within kForget.
  [[nodiscard]] std::optional<std::int64_t> Other(MonoNs now) const;

 private:
  const std::int64_t boot_id_;
  const MonoNs serves_from_;
  MonoNs next_probe_;
  std::int64_t other_ = 0;
  MonoNs last_seen_ = 0;
};

// Publishes all messages of the bridge on the command port, with header, bridge epoch and signature.
class CommandPort {
 public:
  // `key` null: unsigned. Orders begin above `epoch`.
  CommandPort(MessageSink& sink, const Origin& origin, const SigningKey* key, std::int64_t epoch)
      : sink_(sink), origin_(origin), key_(key), epoch_(epoch) {}

  void PublishStatus(command_status_t status, Timestamp now);
  // To the driver of `bus`, with the next bridge epoch, which it returns.
  std::int64_t SendToDriver(const std::string& bus, driver_order_t order, Timestamp now);
  void PublishQuery(command_t question, Timestamp now);

  // Raises the epoch above one that a driver has received. An epoch that no bridge can have reached is ignored.
  void RaiseEpoch(std::int64_t epoch) {
    constexpr std::int64_t kHighest = std::int64_t{1} << 62;
    if (epoch > epoch_ && epoch < kHighest) epoch_ = epoch;
  }
  [[nodiscard]] std::int64_t epoch() const { return epoch_; }
  [[nodiscard]] std::int64_t boot_id() const { return origin_.boot_id; }

 private:
  template <typename Message>
  void Fill(Message& message, const std::string& channel, Timestamp now);

  MessageSink& sink_;
  const Origin origin_;
  const SigningKey* const key_;
  std::int64_t epoch_;
  std::map<std::string, std::int64_t> seq_;  // by channel
};

// Of a command that was just read; STATE_UNKNOWN. `digest`: of its body, 0 for a question.
[[nodiscard]] command_status_t StatusOf(const command_body_t& body, std::int64_t digest);

// The final status of one that is refused: EXPIRED when its time was over, else REJECTED.
[[nodiscard]] command_status_t Refused(command_status_t status, const Error& refusal, Timestamp now);

}  // namespace axlecast
