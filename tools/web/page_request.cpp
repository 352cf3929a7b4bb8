#include "tools/web/page_request.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/messages/json/field.h"
#include "tools/log/log_merge.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

// The finite number that stands at `key`, within the range.
bool ReadNumber(const Json& json, const char* key, double min, double max, double& value) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_number()) return false;
  value = found->get<double>();
  return value >= min && value <= max;
}

PageRequest ParseSubscribe(const Json& json) {
  SubscribeRequest request;
  const auto devices = json.find("devices");
  if (devices == json.end() || !devices->is_array()) return BadRequest{"subscribe: devices is no list of names"};
  if (devices->size() > kMaxSubscribed) return BadRequest{"subscribe: too many devices"};
  for (const Json& device : *devices) {
    if (!device.is_string()) return BadRequest{"subscribe: devices is no list of names"};
    request.devices.push_back(device.get<std::string>());
  }
  if (json.contains("history_s") && !ReadNumber(json, "history_s", 0, 1e6, request.history_s)) {
    return BadRequest{"subscribe: history_s is no number of seconds"};
  }
  return request;
}

PageRequest ParseSeek(const Json& json) {
  double utime = 0;
  if (!ReadNumber(json, "utime", 0, static_cast<double>(kFarthestUtime), utime)) {
    return BadRequest{"seek: utime is no time in us"};
  }
  return SeekRequest{std::llround(utime)};
}

PageRequest ParseSpeed(const Json& json) {
  SpeedRequest request;
  if (ReadNumber(json, "factor", kSlowestPlay, kFastestPlay, request.factor)) return request;
  return BadRequest{"speed: factor is no number from 0.01 to 100"};
}

}  // namespace

PageRequest ParsePageRequest(std::string_view text) {
  const Json json = ParseOutsideJson(text);
  if (!json.is_object()) return BadRequest{"no JSON object"};
  const auto type = json.find("type");
  if (type == json.end() || !type->is_string()) return BadRequest{"an object without a type"};
  const auto& name = type->get_ref<const std::string&>();
  if (name == "subscribe") return ParseSubscribe(json);
  if (name == "seek") return ParseSeek(json);
  if (name == "play") return PlayRequest{true};
  if (name == "pause") return PlayRequest{false};
  if (name == "speed") return ParseSpeed(json);
  return BadRequest{"a type that there is not: this page only shows"};
}

}  // namespace axlecast
