#include "drivers/saa_modbus/late_guard.h"

namespace axlecast::saa_modbus {

LateGuard::Choice LateGuard::Next(MonoNs now) const {
  const int usual = settings_.registers;
  const Choice choice{.registers = usual, .not_before = BlockedUntil(usual)};
  if (now >= choice.not_before || settings_.bits > kOneRegisterBits) return choice;
  const Choice other{.registers = 3 - usual, .not_before = BlockedUntil(3 - usual)};
  return other.not_before < choice.not_before ? other : choice;
}

void LateGuard::On(const Answer& answer, MonoNs end) {
  if (answer.asked.function != kReadPosition || answer.asked.registers == 0 || !answer.unanswered) return;
  blocked_until_.at(answer.asked.registers - 1U) = end + settings_.late;
}

}  // namespace axlecast::saa_modbus
