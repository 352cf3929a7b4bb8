#include "bridge/dispatch/duplicate_bridge_detector.h"

#include <axlecast/command_body_t.hpp>
#include <cstring>

namespace axlecast {
namespace {

constexpr MonoNs kProbePeriod = 100 * kMillisecond;

}  // namespace

void DuplicateBridgeDetector::OnOther(std::int64_t boot_id, MonoNs now) {
  other_ = boot_id;
  heard_ = now;
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
  question.body.resize(static_cast<std::size_t>(body.getEncodedSize()));
  body.encode(question.body.data(), 0, static_cast<int>(question.body.size()));
  question.body_size = static_cast<std::int16_t>(question.body.size());
  return question;
}

std::optional<std::int64_t> DuplicateBridgeDetector::Other(MonoNs now) const {
  if (other_ == 0 || now - heard_ > kForget) return std::nullopt;
  return other_;
}

}  // namespace axlecast
