#include "tools/axlecast/logs/live_traffic_detector.h"

#include "core/base/text.h"
#include "core/messages/json/message_json.h"
#include "platform/net/lcm_port.h"
#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

constexpr MonoNs kListen = 1'200 * kMillisecond;
constexpr int kSliceMs = 50;
constexpr std::size_t kNamed = 6;

bool IsOfMachine(Bytes message) {
  std::string type;
  return DecodeToJson(message, &type).has_value() && type != "recorder_health_t";
}

}  // namespace

void LiveChannels::On(const std::string& channel, Bytes message) {
  if (channels_.size() >= kMaxChannels || channels_.contains(channel)) return;
  if (IsOfMachine(message)) channels_.insert(channel);
}

std::string LiveChannels::Text() const {
  std::string text;
  std::size_t named = 0;
  for (const std::string& channel : channels_) {
    if (++named > kNamed) return text + " and " + std::to_string(channels_.size() - kNamed) + " more";
    text += (named > 1 ? ", " : "") + Printable(channel);
  }
  return text;
}

std::optional<std::string> HearLiveMachine(const std::string& url, std::string& problem) {
  LcmPort port(url, "");
  LiveChannels channels;
  const auto handler = [&channels](const std::string& channel, Bytes message) { channels.On(channel, message); };
  problem = port.problem();
  if (problem.empty() && !port.Subscribe(".*", handler)) problem = "cannot subscribe on " + url;
  if (!problem.empty()) return std::nullopt;
  const SystemClock clock;
  for (const MonoNs end = clock.Now() + kListen; clock.Now() < end;) {
    if (!port.Handle(kSliceMs)) {
      problem = "the LCM port failed";
      return std::nullopt;
    }
  }
  return channels.Text();
}

}  // namespace axlecast
