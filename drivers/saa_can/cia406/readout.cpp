#include "drivers/saa_can/cia406/readout.h"

#include <axlecast/command_status_t.hpp>

#include "core/device/operation.h"

namespace axlecast::saa_can::cia406 {

std::optional<SdoRequest> Readout::Wants(MonoNs) const {
  if (values_.size() == objects_.size()) return std::nullopt;
  return SdoRequest{.object = objects_[values_.size()], .write = {}};
}

std::optional<Outcome> Readout::OnResult(const SdoResult& result) {
  if (result.request.object != objects_[values_.size()] || result.request.write) return std::nullopt;
  const MonoNs now = result.received.last;
  if (result.kind == SdoResult::Kind::kTimedOut) return OnTime(now);
  values_.push_back(result.kind == SdoResult::Kind::kValue ? std::optional(result.value) : std::nullopt);
  if (values_.size() < objects_.size()) return std::nullopt;
  return Show(values_, now);
}

std::optional<Outcome> Readout::OnTime(MonoNs now) {
  if (now < deadline_) return std::nullopt;
  return Final(CommandState::kFailed, command_status_t::REASON_NO_REPLY, "the encoder did not answer in time");
}

Outcome Readout::OnLinkLost() const {
  return Final(CommandState::kFailed, command_status_t::REASON_NO_REPLY, "the link was lost before all was read");
}

}  // namespace axlecast::saa_can::cia406
