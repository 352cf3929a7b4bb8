#pragma once

#include <string>
#include <vector>

#include "bridge/store/alarm_store.h"
#include "bridge/store/database.h"

namespace axlecast {

// The table `alarm_marks`. What answers bool belongs into a transaction.
namespace sqlite_alarms {

[[nodiscard]] bool Set(Database& database, const std::string& device, const AlarmMark& mark);
[[nodiscard]] bool End(Database& database, const std::string& device, AlarmMark::Kind kind,
                       const std::string& alarm);
[[nodiscard]] std::vector<AlarmMark> Of(Database& database, const std::string& device);

}  // namespace sqlite_alarms
}  // namespace axlecast
