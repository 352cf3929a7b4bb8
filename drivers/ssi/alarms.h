#pragma once

#include "core/device/device.h"
#include "drivers/ssi/codec.h"
#include "drivers/ssi/settings.h"

namespace axlecast::ssi {

// What is wrong with the line when transfer after transfer fails in the same way; null where that says nothing of it.
[[nodiscard]] const AlarmSpec* LineAlarm(WordError error);

// A status bit as an alarm. Its name is the configured one, and must outlive the alarm.
[[nodiscard]] AlarmSpec StatusAlarm(const StatusBit& bit, std::size_t index);

}  // namespace axlecast::ssi
