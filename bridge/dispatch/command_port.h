#pragma once

#include <axlecast/command_body_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <axlecast/command_t.hpp>
#include <axlecast/driver_order_t.hpp>
#include <cstdint>
#include <map>
#include <string>

#include "core/base/time.h"
#include "core/command/operation_check.h"
#include "core/command/signature.h"
#include "core/messages/message.h"

namespace axlecast {

// Publishes all messages of the bridge on the command port, with header, bridge epoch and signature.
class CommandPort {
 public:
  // `key` null: unsigned. Orders begin above `epoch`.
  CommandPort(MessageSink& sink, std::int64_t boot_id, const SigningKey* key, std::int64_t epoch)
      : sink_(sink), boot_id_(boot_id), key_(key), epoch_(epoch) {}

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
  [[nodiscard]] std::int64_t boot_id() const { return boot_id_; }

 private:
  template <typename Message>
  void Fill(Message& message, const std::string& channel, Timestamp now);

  MessageSink& sink_;
  const std::int64_t boot_id_;
  const SigningKey* const key_;
  std::int64_t epoch_;
  std::map<std::string, std::int64_t> seq_;  // by channel
};

// Of a command that was just read; STATE_UNKNOWN. `digest`: of its body, 0 for a question.
[[nodiscard]] command_status_t StatusOf(const command_body_t& body, std::int64_t digest);

// The final status of one that is refused: EXPIRED when its time was over, else REJECTED.
[[nodiscard]] command_status_t Refused(command_status_t status, const Error& refusal, Timestamp now);

}  // namespace axlecast
