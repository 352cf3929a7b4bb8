#include "tools/mqtt/mqtt_alarms.h"

#include <algorithm>
#include <utility>

namespace axlecast {

MqttAlarms::MqttAlarms(std::string name, std::int64_t boot_id, MonoNs start) : start_(start) {
  message_.boot_id = boot_id;
  message_.seq = -1;
  message_.device = std::move(name);
}

const alarm_t& MqttAlarms::Make(const MqttStatus& status, MonoNs now, std::int64_t utime) {
  using namespace mqtt_alarms;
  const auto set = [&](const AlarmSpec& alarm, bool present, bool lasts) {
    const AlarmState gone = lasts ? AlarmState::kDriverLatched : AlarmState::kAbsent;
    book_.Set(alarm, present ? AlarmState::kLive : gone, utime);
  };
  const std::int64_t refused = status.outbox.refused;
  const std::int64_t shed = status.outbox.Lost() - refused;
  set(kBrokerAway, !status.broker.connected && now - std::max(start_, status.broker.since) >= kAway, false);
  set(kMessagesShed, shed > shed_before_, shed > 0);
  set(kMessagesRefused, refused > refused_before_, refused > 0);
  shed_before_ = shed;
  refused_before_ = refused;
  message_.utime = utime;
  message_.mono_ns = now;
  book_.Write(message_, utime);
  ++message_.seq;
  return message_;
}

}  // namespace axlecast
