#include "tools/mqtt/mqtt_status.h"

#include <algorithm>

#include "core/alarm/alarm_codes.h"
#include "core/messages/json/field.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

std::int64_t Shed(const OutboxCounts& counts, RetentionClass keeping) {
  return counts.shed[static_cast<std::size_t>(keeping)];
}

}  // namespace

Json MqttStatusJson(const char* state, std::int64_t boot_id) {
  return {{"state", state}, {"boot_id", IdField(boot_id)}};
}

Json MqttStatusJson(const char* state, std::int64_t boot_id, std::int64_t utime, const MqttStatus& status) {
  Json json = MqttStatusJson(state, boot_id);
  json.update({{"utime", utime},
               {"version", AXLECAST_VERSION},
               {"connections", status.broker.connections},
               {"received", status.feed.received},
               {"published", status.feed.published},
               {"delivered", status.outbox.taken},
               {"waiting", status.outbox.messages},
               {"waiting_bytes", status.outbox.bytes},
               {"replaced", status.outbox.replaced},
               {"shed_samples", Shed(status.outbox, RetentionClass::kSamples)},
               {"shed_events", Shed(status.outbox, RetentionClass::kEvents)},
               {"shed_states", Shed(status.outbox, RetentionClass::kNewest)},
               {"refused", status.outbox.refused},
               {"too_long", status.feed.too_long},
               {"lost_before", status.feed.lost},
               {"foreign", status.feed.foreign}});
  return json;
}

std::string MqttStatusLine(const MqttStatus& status) {
  std::string text = status.broker.connected ? "connected, " : "not connected, ";
  text += std::to_string(status.outbox.taken) + " messages delivered, " + std::to_string(status.outbox.messages) +
          " wait";
  const auto add = [&text](std::int64_t count, const char* of) {
    if (count > 0) text += "; " + std::to_string(count) + ' ' + of;
  };
  add(Shed(status.outbox, RetentionClass::kSamples), "samples shed");
  add(Shed(status.outbox, RetentionClass::kEvents), "events shed");
  add(Shed(status.outbox, RetentionClass::kNewest), "states shed");
  add(status.outbox.refused, "refused by the broker");
  add(status.feed.too_long, "too long");
  add(status.feed.lost, "lost on LCM");
  return text;
}

const alarm_t& MqttAlarms::Make(const MqttStatus& status, MonoNs now, std::int64_t utime) {
  using namespace mqtt_alarms;
  const std::int64_t refused = status.outbox.refused;
  const std::int64_t shed = status.outbox.Lost() - refused;
  alarms_.Set(kBrokerAway, !status.broker.connected && now - std::max(start_, status.broker.since) >= kAway, utime);
  alarms_.Set(kMessagesShed, shed > shed_before_, utime, shed > 0);
  alarms_.Set(kMessagesRefused, refused > refused_before_, utime, refused > 0);
  shed_before_ = shed;
  refused_before_ = refused;
  return alarms_.Make({now, utime});
}

}  // namespace axlecast
