#include "tools/mqtt/sparkplug/sparkplug_status.h"

namespace axlecast {

MqttStatus SparkplugStatus::ForAlarms() const {
  MqttStatus status{.feed = feed, .outbox = {}, .broker = broker};
  status.outbox.shed[static_cast<std::size_t>(RetentionClass::kSamples)] = log.dropped + log.unstored + log.damaged;
  return status;
}

nlohmann::ordered_json SparkplugStatusJson(const SparkplugStatus& status) {
  return {{"connections", status.broker.connections},
          {"births", status.edge.births},
          {"rebirths", status.edge.rebirths},
          {"ignored", status.edge.ignored},
          {"received", status.feed.received},
          {"stored", status.log.stored},
          {"live", status.edge.live},
          {"historical", status.edge.historical},
          {"caught_up", status.caught_up},
          {"outbox_bytes", status.log.bytes},
          {"dropped", status.log.dropped},
          {"unstored", status.log.unstored},
          {"damaged", status.log.damaged},
          {"unknown", status.unknown},
          {"lost_before", status.feed.lost},
          {"foreign", status.feed.foreign}};
}

std::string SparkplugStatusLine(const SparkplugStatus& status) {
  std::string text = status.born               ? status.caught_up ? "born" : "born, sends what waited"
                     : status.waits_for_host   ? "waits for the primary host"
                     : status.broker.connected ? "connected"
                                               : "not connected";
  text += ", " + std::to_string(status.edge.live) + " samples live, " + std::to_string(status.edge.historical) +
          " historical";
  const auto add = [&text](std::int64_t count, const char* of) {
    if (count > 0) text += "; " + std::to_string(count) + ' ' + of;
  };
  add(status.log.dropped, "dropped, because the outbox was full");
  add(status.log.unstored, "not stored, because the disk failed");
  add(status.log.damaged, "damaged stretches of the outbox");
  add(status.unknown, "of unknown devices");
  add(status.feed.lost, "lost on LCM");
  return text;
}

}  // namespace axlecast
