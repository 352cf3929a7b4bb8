#include "tools/axlecast/common/on_base.h"

#include <axlecast/time_quality_t.hpp>
#include <optional>

#include "core/messages/json/field.h"
#include "core/messages/message.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

std::int64_t IdOf(const Json& digits) {
  return static_cast<std::int64_t>(std::stoull(digits.get<std::string>(), nullptr, 16));
}

}  // namespace

void OnBase::Take(Bytes message, MonoNs now) {
  const auto time = DecodeMessage<time_quality_t>(message);
  if (!time) return;
  const auto machine = IdField(time->machine_id).get<std::string>();
  if (bases_.size() >= kMaxMachines && !bases_.contains(machine)) return;
  bases_.try_emplace(machine, time->machine_id).first->second.OnTime(*time, now);
}

void OnBase::Add(Json& line, MonoNs now) const {
  if (!line.contains("machine_id") || !line.contains("clock_id") || !line.contains("mono_ns")) return;
  const auto base = bases_.find(line["machine_id"].get<std::string>());
  if (base == bases_.end()) return;
  const TimeBase::Instant at =
      base->second.OnBase(IdOf(line["clock_id"]), line["mono_ns"].get<std::int64_t>(), now);
  line["on_base"] = nullptr;
  if (at) line["on_base"] = {{"base_id", IdField(at.base_id)}, {"ns", at.ns}, {"half_width_ns", at.half_width_ns}};
}

}  // namespace axlecast
