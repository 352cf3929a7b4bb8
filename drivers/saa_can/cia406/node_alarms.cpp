#include "drivers/saa_can/cia406/node_alarms.h"

#include <algorithm>
#include <utility>

#include "drivers/saa_can/cia406/objects.h"

namespace axlecast::saa_can::cia406 {
namespace {

std::uint16_t MaskOf(std::optional<std::uint32_t> supported) {
  return static_cast<std::uint16_t>(supported ? *supported | kStandardBits : 0xFFFFU);
}

}  // namespace

void NodeAlarms::Begin(const NodeFacts& facts, MonoNs now) {
  alarm_mask_ = MaskOf(facts.Get(kSupportedAlarms));
  warning_mask_ = MaskOf(facts.Get(kSupportedWarnings));
  OnAlarms(facts.Get(kAlarms).value_or(0), now);
  OnWarnings(facts.Get(kWarnings).value_or(0), now);
}

void NodeAlarms::OnAlarms(std::uint32_t bits, MonoNs now) {
  const auto heeded = static_cast<std::uint16_t>(bits & alarm_mask_);
  Report(Alarms(), std::exchange(alarms_, heeded), heeded, now);
}

void NodeAlarms::OnWarnings(std::uint32_t bits, MonoNs now) {
  const auto heeded = static_cast<std::uint16_t>(bits & warning_mask_);
  Report(Warnings(), std::exchange(warnings_, heeded), heeded, now);
}

void NodeAlarms::Report(std::span<const DiagnosticAlarm> table, std::uint16_t before, std::uint16_t now_set,
                        MonoNs now) {
  for (const DiagnosticAlarm& alarm : table) {
    const bool was = (before & alarm.bits) != 0;
    const bool is = (now_set & alarm.bits) != 0;
    if (was != is) output_.OnAlarm(alarm.spec, is ? AlarmState::kLive : AlarmState::kAbsent, now);
  }
}

void NodeAlarms::OnEmergency(const Emergency& emergency, MonoNs now) {
  last_ = emergency;
  if (emergency.IsReset()) return EndEmergencies(emergency.error_register, now);
  auto* const end = codes_.begin() + count_;
  if (std::find(codes_.begin(), end, emergency.code) != end) return;
  if (count_ == kMaxCodes) {
    if (!std::exchange(more_, true)) output_.OnAlarm(kMoreEmergencies, AlarmState::kLive, now);
    return;
  }
  codes_.at(count_++) = emergency.code;
  output_.OnAlarm(EmergencyAlarm(emergency.code), AlarmState::kLive, now);
}

// With 0000h and a register that is not 0, one error is gone and others are left (CiA 301 7.2.7.1).
void NodeAlarms::EndEmergencies(std::uint8_t error_register, MonoNs now) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    const std::uint16_t code = codes_.at(i);
    const std::uint8_t bit = RegisterBitOf(code);
    const bool stays = bit == 0 ? error_register != 0 : (error_register & bit) != 0;
    if (stays) {
      codes_.at(kept++) = code;
    } else {
      output_.OnAlarm(EmergencyAlarm(code), AlarmState::kAbsent, now);
    }
  }
  count_ = kept;
  if (error_register == 0 && std::exchange(more_, false)) {
    output_.OnAlarm(kMoreEmergencies, AlarmState::kAbsent, now);
  }
}

void NodeAlarms::OnBootUp(MonoNs now) {
  EndEmergencies(0, now);
  last_.reset();
}

}  // namespace axlecast::saa_can::cia406
