#include "tools/web/client_stream.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

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

constexpr std::size_t kMaxSaid = 100;  // beyond what a start tells

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

void ClientStream::Start(WebModel& scene, WebTimestamp now, bool reset) {
  said_.clear();
  if (reset) said_.push_back(ResetFrame());
  layout_ = scene.layout();
  said_.push_back(scene.Hello());
  said_.push_back(scene.State(now));
  state_sent_ = now.mono;
  for (std::string& frame : scene.Past(now.utime)) said_.push_back(std::move(frame));
  next_event_ = scene.events_end();
  for (auto place = places_.begin(); place != places_.end();) {
    const auto device = scene.IndexOf(place->first);
    if (device) {
      place->second = {.device = *device, .row = FirstRow(scene, *device, history_s_, now)};
      ++place;
    } else {
      place = places_.erase(place);
    }
  }
}

std::string ClientStream::Subscribe(const WebModel& scene, const SubscribeRequest& request, WebTimestamp now) {
  std::map<std::string, Place> places;
  std::string problem;
  history_s_ = request.history_s;
  for (const std::string& name : request.devices) {
    const auto device = scene.IndexOf(name);
    if (!device) {
      problem = "subscribe: there is no device of such a name: " + name.substr(0, 40);
    } else if (const auto known = places_.find(name); known != places_.end()) {
      places.insert(*known);
    } else {
      places[name] = {.device = *device, .row = FirstRow(scene, *device, history_s_, now)};
    }
  }
  places_ = std::move(places);
  return problem;
}

void ClientStream::Say(std::string frame) {
  if (said_.size() < kMaxSaid) said_.push_back(std::move(frame));
}

std::optional<std::string> ClientStream::NextSaid() {
  if (said_.empty()) return std::nullopt;
  std::string frame = std::move(said_.front());
  said_.pop_front();
  return frame;
}

std::optional<std::string> ClientStream::Next(WebModel& scene, WebTimestamp now) {
  if (auto frame = NextSaid()) return frame;
  if (layout_ != scene.layout()) {
    layout_ = scene.layout();
    return scene.Hello();
  }
  if (next_event_ < scene.events_end()) return scene.event(next_event_++);
  if (now.mono - state_sent_ >= kStatePeriod || now.mono < state_sent_) {
    state_sent_ = now.mono;
    const std::string& state = scene.State(now);
    // Of a log that stands still it is the same again and again.
    const std::size_t hash = std::hash<std::string>()(state);
    if (std::exchange(state_hash_, hash) != hash) return state;
  }
  return NextSamples(scene, now);
}

std::optional<std::string> ClientStream::NextSamples(const WebModel& scene, WebTimestamp now) {
  const MonoNs period = places_.size() > kManyDevices ? 2 * kSamplesPeriod : kSamplesPeriod;
  // Each in its turn: the ones behind the one that had it last, then those before it.
  const auto ready = [&](const auto& entry) { return HasSamples(scene, entry.second, now.mono - period); };
  const auto after = places_.upper_bound(last_device_);
  auto next = std::find_if(after, places_.end(), ready);
  if (next == places_.end()) {
    next = std::find_if(places_.begin(), after, ready);
    if (next == after) return std::nullopt;
  }
  last_device_ = next->first;
  return TakeSamples(scene, next->first, next->second, now.mono);
}

bool ClientStream::HasSamples(const WebModel& scene, const Place& place, MonoNs due) {
  const SampleHistory* history = scene.samples(place.device);
  return history != nullptr && std::max(place.row, history->begin()) < history->end() &&
         (place.past || place.sent <= due);
}

std::string ClientStream::TakeSamples(const WebModel& scene, const std::string& device, Place& place, MonoNs now) {
  const SampleHistory& history = *scene.samples(place.device);
  std::uint64_t begin = std::max(place.row, history.begin());
  if (!place.past && history.end() - begin > kMaxWaiting) begin = history.end() - kMaxWaiting;
  place.dropped += begin - place.row;
  place.row = std::min(begin + kMaxInFrame, history.end());
  place.past = place.past && place.row < history.end();
  place.sent = now;
  return SamplesFrame(device, scene.columns(place.device), history, begin, place.row, place.dropped);
}

std::uint64_t ClientStream::FirstRow(const WebModel& scene, std::size_t device, double history_s,
                                     WebTimestamp now) {
  const SampleHistory* history = scene.samples(device);
  if (history == nullptr) return 0;
  if (history_s == 0) return history->end();
  return history->Find(now.utime - std::llround(history_s * 1e6));
}

}  // namespace axlecast
