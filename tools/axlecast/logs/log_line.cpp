#include "tools/axlecast/logs/log_line.h"

#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"
#include "tools/log/log_event.h"
#include "tools/log/log_seal.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

// Whether the event's content could be shown for what it is.
bool AddContent(const LogEvent& event, Json& line) {
  if (event.channel == kSealChannel) {
    const auto seal = ParseSeal(event.data);
    if (seal) line.update({{"bytes", seal->bytes}, {"events", seal->events}, {"crc32c", seal->crc32c}});
    return seal.has_value();
  }
  if (IsLogChannel(event.channel)) {
    line["text"] = std::string(event.data.begin(), event.data.end());
    return true;
  }
  std::string type;
  const auto message = DecodeToJson(event.data, &type);
  if (!message) return false;
  line["type"] = type;
  line.update(*message);
  return true;
}

}  // namespace

std::string EventLine(const LogEvent& event, bool raw) {
  Json line = {{"number", event.number}, {"received_utime", event.utime}, {"channel", event.channel}};
  if (raw || !AddContent(event, line)) {
    line["size"] = event.data.size();
    line["data"] = HexDigits(event.data);
  }
  return JsonLine(line) + '\n';
}

}  // namespace axlecast
