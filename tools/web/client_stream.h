#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/base/time.h"
#include "tools/web/web_model.h"

namespace axlecast {

// What a page may ask for (docs/web_protocol.md). None of it reaches a device.
struct SubscribeRequest {
  std::vector<std::string> devices = {};
  double history_s = 0;
  bool operator==(const SubscribeRequest&) const = default;
};
struct SeekRequest {
  std::int64_t utime = 0;
  bool operator==(const SeekRequest&) const = default;
};
struct PlayRequest {
  bool play = true;  // false: pause
  bool operator==(const PlayRequest&) const = default;
};
struct SpeedRequest {
  double factor = 1;
  bool operator==(const SpeedRequest&) const = default;
};
struct BadRequest {
  std::string text;  // what is wrong with it
  bool operator==(const BadRequest&) const = default;
};
using PageRequest = std::variant<BadRequest, SubscribeRequest, SeekRequest, PlayRequest, SpeedRequest>;

inline constexpr std::size_t kMaxSubscribed = 512;
inline constexpr double kSlowestPlay = 0.01;
inline constexpr double kFastestPlay = 100;

[[nodiscard]] PageRequest ParsePageRequest(std::string_view text);

// What one browser is told, and when. Asked for a frame whenever the browser can take one; a browser that is slow is
// asked less often, and then gets the newest state and samples, but every alarm, trip and command. It holds places in the
// scene, not what waits there. Pure.
class ClientStream {
 public:
  static constexpr MonoNs kStatePeriod = 250 * kMillisecond;
  static constexpr MonoNs kSamplesPeriod = 50 * kMillisecond;  // of one device
  static constexpr std::size_t kManyDevices = 16;              // more than these come half as often
  static constexpr std::uint64_t kMaxWaiting = 1000;           // rows of samples; older ones are dropped
  static constexpr std::uint64_t kMaxInFrame = 2000;

  // The start of a connection; with `reset` after a seek: the subscription stays.
  void Start(WebModel& scene, WebTimestamp now, bool reset = false);

  // Samples of these from now on. What is wrong with it, or nothing.
  std::string Subscribe(const WebModel& scene, const SubscribeRequest& request, WebTimestamp now);

  // A frame that is not the scene's. Passed over where too many wait.
  void Say(std::string frame);

  // The next frame; nothing when there is none yet.
  [[nodiscard]] std::optional<std::string> Next(WebModel& scene, WebTimestamp now);
  // A frame of Say alone.
  [[nodiscard]] std::optional<std::string> NextSaid();

  // Something that may not be left out is gone: the connection must end.
  [[nodiscard]] bool fell_behind(const WebModel& scene) const { return next_event_ < scene.events_begin(); }

 private:
  struct Place {
    std::size_t device = 0;
    std::uint64_t row = 0;
    std::uint64_t dropped = 0;
    bool past = true;  // it is still told of the past that it asked for
    MonoNs sent = 0;
  };

  [[nodiscard]] std::optional<std::string> NextSamples(const WebModel& scene, WebTimestamp now);
  [[nodiscard]] static bool HasSamples(const WebModel& scene, const Place& place, MonoNs due);
  static std::string TakeSamples(const WebModel& scene, const std::string& device, Place& place, MonoNs now);
  static std::uint64_t FirstRow(const WebModel& scene, std::size_t device, double history_s, WebTimestamp now);

  std::deque<std::string> said_;
  std::uint64_t layout_ = 0;
  std::uint64_t next_event_ = 0;
  MonoNs state_sent_ = 0;
  std::size_t state_hash_ = 0;
  std::map<std::string, Place> places_;
  std::string last_device_;  // whose samples went last
  double history_s_ = 0;
};

}  // namespace axlecast
