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

// Reads the finite number at `key`. Returns false if it is missing or out of range.
bool ReadNumber(const Json& json, const char* key, double min, double max, double& value) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_number()) return false;
  value = found->get<double>();
  return value >= min && value <= max;
}

Result<PageRequest> ParseSubscribe(const Json& json) {
  SubscribeRequest request;
  const auto devices = json.find("devices");
  const auto is_text = [](const Json& device) { return device.is_string(); };
  if (devices == json.end() || !devices->is_array() || !std::all_of(devices->begin(), devices->end(), is_text)) {
    return Failure("subscribe: devices is not a list of names");
  }
  if (devices->size() > kMaxSubscribed) return Failure("subscribe: too many devices");
  request.devices = devices->get<std::vector<std::string>>();
  if (json.contains("history_s") && !ReadNumber(json, "history_s", 0, 1e6, request.history_s)) {
    return Failure("subscribe: history_s is not a number of seconds");
  }
  return request;
}

constexpr std::size_t kMaxQueuedFrames = 100;  // in addition to the frames of a start

}  // namespace

Result<PageRequest> ParsePageRequest(std::string_view text) {
  const Json json = ParseOutsideJson(text);
  if (!json.is_object()) return Failure("no JSON object");
  const auto type = json.find("type");
  if (type == json.end() || !type->is_string()) return Failure("an object without a type");
  const auto& name = type->get_ref<const std::string&>();
  double number = 0;
  if (name == "subscribe") return ParseSubscribe(json);
  if (name == "play" || name == "pause") return PlayRequest{name == "play"};
  if (name == "seek") {
    if (ReadNumber(json, "utime", 0, static_cast<double>(kFarthestUtime), number))
      return SeekRequest{std::llround(number)};
    return Failure("seek: utime is not a time in us");
  }
  if (name == "speed") {
    if (ReadNumber(json, "factor", kSlowestPlay, kFastestPlay, number)) return SpeedRequest{number};
    return Failure("speed: factor is not a number from 0.01 to 100");
  }
  if (IsFleetType(name)) {
    const Result<FleetRequest> request = ParseFleetRequest(json);
    if (!request) return Failure(request.error());
    return *request;
  }
  return Failure("unknown type: this server accepts no commands");
}

void ClientStream::Start(WebModel& model, WebTimestamp now, bool reset) {
  queued_.clear();
  if (reset) queued_.push_back(ResetFrame());
  layout_ = model.layout();
  queued_.push_back(model.Hello());
  queued_.push_back(model.State(now));
  state_sent_ = now.mono;
  for (std::string& frame : model.Past(now.utime)) queued_.push_back(std::move(frame));
  next_event_ = model.events_end();
  for (auto place = places_.begin(); place != places_.end();) {
    const auto device = model.IndexOf(place->first);
    if (device) {
      place->second = {.device = *device, .row = FirstRow(model, *device, history_s_, now)};
      ++place;
    } else {
      place = places_.erase(place);
    }
  }
}

Result<> ClientStream::Subscribe(const WebModel& model, const SubscribeRequest& request, WebTimestamp now) {
  std::map<std::string, Place> places;
  Result<> done;
  history_s_ = request.history_s;
  for (const std::string& name : request.devices) {
    const auto device = model.IndexOf(name);
    if (!device) {
      done = Failure("subscribe: unknown device: " + name.substr(0, 40));
    } else if (const auto known = places_.find(name); known != places_.end()) {
      places.insert(*known);
    } else {
      places[name] = {.device = *device, .row = FirstRow(model, *device, history_s_, now)};
    }
  }
  places_ = std::move(places);
  return done;
}

void ClientStream::Queue(std::string frame) {
  if (queued_.size() < kMaxQueuedFrames) queued_.push_back(std::move(frame));
}

std::optional<std::string> ClientStream::NextQueued() {
  if (queued_.empty()) return std::nullopt;
  std::string frame = std::move(queued_.front());
  queued_.pop_front();
  return frame;
}

std::optional<std::string> ClientStream::Next(WebModel& model, WebTimestamp now) {
  if (auto frame = NextQueued()) return frame;
  if (layout_ != model.layout()) {
    layout_ = model.layout();
    return model.Hello();
  }
  if (next_event_ < model.events_end()) return model.event(next_event_++);
  if (now.mono - state_sent_ >= kStatePeriod || now.mono < state_sent_) {
    state_sent_ = now.mono;
    const std::string& state = model.State(now);
    // While a log is paused, the state does not change.
    const std::size_t hash = std::hash<std::string>()(state);
    if (std::exchange(state_hash_, hash) != hash) return state;
  }
  return NextSamples(model, now);
}

std::optional<std::string> ClientStream::NextSamples(const WebModel& model, WebTimestamp now) {
  const MonoNs period = places_.size() > kManyDevices ? 2 * kSamplesPeriod : kSamplesPeriod;
  // Round-robin: begins after the device whose samples were sent last.
  const auto ready = [&](const auto& entry) { return HasSamples(model, entry.second, now.mono - period); };
  const auto after = places_.upper_bound(last_device_);
  auto next = std::find_if(after, places_.end(), ready);
  if (next == places_.end()) {
    next = std::find_if(places_.begin(), after, ready);
    if (next == after) return std::nullopt;
  }
  last_device_ = next->first;
  return TakeSamples(model, next->first, next->second, now.mono);
}

bool ClientStream::HasSamples(const WebModel& model, const Place& place, MonoNs due) {
  const SampleHistory* history = model.samples(place.device);
  return history != nullptr && std::max(place.row, history->begin()) < history->end() &&
         (place.past || place.sent <= due);
}

std::string ClientStream::TakeSamples(const WebModel& model, const std::string& device, Place& place, MonoNs now) {
  const SampleHistory& history = *model.samples(place.device);
  std::uint64_t begin = std::max(place.row, history.begin());
  if (!place.past && history.end() - begin > kMaxWaiting) begin = history.end() - kMaxWaiting;
  place.dropped += begin - place.row;
  place.row = std::min(begin + kMaxInFrame, history.end());
  place.past = place.past && place.row < history.end();
  place.sent = now;
  return SamplesFrame(device, model.columns(place.device), history, begin, place.row, place.dropped);
}

std::uint64_t ClientStream::FirstRow(const WebModel& model, std::size_t device, double history_s,
                                     WebTimestamp now) {
  const SampleHistory* history = model.samples(device);
  if (history == nullptr) return 0;
  if (history_s == 0) return history->end();
  return history->Find(now.utime - std::llround(history_s * 1e6));
}

}  // namespace axlecast
