#include "bridge/dispatch/command_port.h"

#include <algorithm>
#include <axlecast/device_info_t.hpp>
#include <axlecast/driver_command_t.hpp>
#include <cstring>

#include "core/base/text.h"

namespace axlecast {
namespace {

constexpr MonoNs kProbePeriod = 100 * kMillisecond;

}  // namespace

void DriverLink::Expect(const std::vector<DeviceConfig>& devices) {
  for (const DeviceConfig& device : devices) states_[device.name] = device_info_t::STATE_STARTING;
}

bool DriverLink::On(const driver_status_t& status, MonoNs now) {
  if (status.boot_id == 0) return false;
  if (status.boot_id != boot_id_) {
    if (status.kind != driver_status_t::KIND_HELLO) return false;
    // A message of a replaced boot is late; unless its successor is silent: then it was the successor that failed.
    const bool replaced = std::find(replaced_.begin(), replaced_.end(), status.boot_id) != replaced_.end();
    if (replaced && IsPresent(now)) return false;
    Replace(status.boot_id);
  }
  // A message in transit after GOODBYE does not make the driver present again.
  if (gone_) return status.kind == driver_status_t::KIND_STATUS;
  last_seen_ = now;
  gone_ = status.kind == driver_status_t::KIND_GOODBYE;
  for (const driver_device_t& device : status.devices) {
    if (const auto known = states_.find(device.device); known != states_.end()) known->second = device.state;
  }
  return true;
}

bool DriverLink::IsAnswering(const std::string& device) const {
  const auto found = states_.find(device);
  return found != states_.end() &&
         (found->second == device_info_t::STATE_ONLINE || found->second == device_info_t::STATE_DEGRADED);
}

void DriverLink::Replace(std::int64_t boot_id) {
  std::erase(replaced_, boot_id);
  if (boot_id_ != 0) replaced_.push_back(boot_id_);
  if (replaced_.size() > kRemembered) replaced_.pop_front();
  boot_id_ = boot_id;
  gone_ = false;
  for (auto& [device, state] : states_) state = device_info_t::STATE_STARTING;
}

void DuplicateBridgeDetector::OnOther(std::int64_t boot_id, MonoNs now) {
  other_ = boot_id;
  last_seen_ = now;
}

std::optional<command_t> DuplicateBridgeDetector::Probe(MonoNs now) {
  if (!IsListening(now) || now < next_probe_) return std::nullopt;
  next_probe_ = now + kProbePeriod;
  command_body_t body{};
  std::memcpy(body.id, &boot_id_, sizeof boot_id_);  // an id that is nobody's command
  body.mode = command_body_t::MODE_QUERY;
  body.valid_ms = 1;
  body.expect_epoch = -1;
  command_t question{};
  question.body = Encoded(body);
  question.body_size = static_cast<std::int16_t>(question.body.size());
  return question;
}

std::optional<std::int64_t> DuplicateBridgeDetector::Other(MonoNs now) const {
  if (other_ == 0 || now - last_seen_ > kForget) return std::nullopt;
  return other_;
}

using S = command_status_t;

template <typename Message>
void CommandPort::Fill(Message& message, const std::string& channel, Timestamp now) {
  message.utime = now.utime;
  message.mono_ns = now.mono;
  origin_.Set(message);
  message.seq = seq_[channel]++;
}

void CommandPort::PublishStatus(command_status_t status, Timestamp now) {
  Fill(status, "COMMAND_STATUS", now);
  if (key_ != nullptr) SignMessage(*key_, Domain::kStatus, status);
  Publish(sink_, "COMMAND_STATUS", status);
}

std::int64_t CommandPort::SendToDriver(const std::string& bus, driver_order_t order, Timestamp now) {
  order.bridge_boot_id = origin_.boot_id;
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
