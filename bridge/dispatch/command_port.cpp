#include "bridge/dispatch/command_port.h"

#include <algorithm>
#include <axlecast/driver_command_t.hpp>
#include <utility>

#include "core/base/text.h"

namespace axlecast {

using S = command_status_t;

template <typename Message>
void CommandPort::Fill(Message& message, const std::string& channel, Timestamp now) {
  message.utime = now.utime;
  message.mono_ns = now.mono;
  message.boot_id = boot_id_;
  message.seq = seq_[channel]++;
}

void CommandPort::PublishStatus(command_status_t status, Timestamp now) {
  Fill(status, "COMMAND_STATUS", now);
  if (key_ != nullptr) SignMessage(*key_, Domain::kStatus, status);
  Publish(sink_, "COMMAND_STATUS", status);
}

std::int64_t CommandPort::SendToDriver(const std::string& bus, driver_order_t order, Timestamp now) {
  order.bridge_boot_id = boot_id_;
  order.bridge_epoch = ++epoch_;
  order.n_arguments = static_cast<std::int8_t>(order.arguments.size());
  driver_command_t envelope{};
  const std::string channel = "DRIVER_COMMAND/" + bus;
  Fill(envelope, channel, now);
  envelope.order = Encoded(order);
  envelope.order_size = static_cast<std::int16_t>(envelope.order.size());
  if (key_ != nullptr) {
    const Signature signature = key_->Sign(Domain::kOrder, envelope.order);
    std::copy(signature.begin(), signature.end(), std::begin(envelope.sig));
  }
  Publish(sink_, channel, envelope);
  return epoch_;
}

void CommandPort::PublishQuery(command_t question, Timestamp now) {
  Fill(question, "COMMAND", now);
  Publish(sink_, "COMMAND", question);
}

command_status_t StatusOf(const command_body_t& body, std::int64_t digest) {
  command_status_t status{};
  std::copy(std::begin(body.id), std::end(body.id), std::begin(status.id));
  status.body_digest = digest;
  status.device = CappedText(body.device, kNameBytes);
  status.operation = CappedText(body.operation, kNameBytes);
  status.epoch_after = -1;
  return status;
}

S Refused(S status, const Error& refusal, Timestamp now) {
  const bool late = refusal.reason == S::REASON_DEADLINE;
  status.state = late ? S::STATE_EXPIRED : S::STATE_REJECTED;
  status.is_final = 1;
  status.reason_code = refusal.reason;
  status.text = CappedText(refusal.text, kTextBytes);
  status.finished_utime = now.utime;
  return status;
}

}  // namespace axlecast
