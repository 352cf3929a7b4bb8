#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/base/result.h"
#include "core/base/time.h"
#include "tools/web/fleet_request.h"
#include "tools/web/web_model.h"

namespace axlecast {

// The requests of a page (docs/web_protocol.md). No request reaches a device.
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
using PageRequest = std::variant<SubscribeRequest, SeekRequest, PlayRequest, SpeedRequest, FleetRequest>;

inline constexpr std::size_t kMaxSubscribed = 512;
inline constexpr double kSlowestPlay = 0.01;
inline constexpr double kFastestPlay = 100;

[[nodiscard]] Result<PageRequest> ParsePageRequest(std::string_view text);

// Selects the next frame for one browser. A slow browser takes fewer frames: it gets the newest state and samples, but
// every alarm, trip and command. It stores positions in the model, not the frames. Does no I/O.
class ClientStream {
 public:
  static constexpr MonoNs kStatePeriod = 250 * kMillisecond;
  static constexpr MonoNs kSamplesPeriod = 50 * kMillisecond;  // of one device
  static constexpr std::size_t kManyDevices = 16;              // more than these come half as often
  static constexpr std::uint64_t kMaxWaiting = 1000;           // rows of samples; older ones are dropped
  static constexpr std::uint64_t kMaxInFrame = 2000;

  // Starts a connection, or with `reset` continues after a seek with the same subscription.
  void Start(WebModel& model, WebTimestamp now, bool reset = false);

  // Subscribes to samples of these devices only. Unknown names are an error; the other devices are subscribed.
  [[nodiscard]] Result<> Subscribe(const WebModel& model, const SubscribeRequest& request, WebTimestamp now);

  // Queues a frame that is not from the model. It is dropped if too many are queued.
  void Queue(std::string frame);

  // Returns the next frame; nothing if no frame is due.
  [[nodiscard]] std::optional<std::string> Next(WebModel& model, WebTimestamp now);
  // Returns only a frame from Queue.
  [[nodiscard]] std::optional<std::string> NextQueued();

  // Returns true if an event was lost for this browser. The connection must then be closed.
  [[nodiscard]] bool fell_behind(const WebModel& model) const { return next_event_ < model.events_begin(); }

 private:
  struct Place {
    std::size_t device = 0;
    std::uint64_t row = 0;
    std::uint64_t dropped = 0;
    bool past = true;  // the requested history is not yet complete
    MonoNs sent = 0;
  };

  [[nodiscard]] std::optional<std::string> NextSamples(const WebModel& model, WebTimestamp now);
  [[nodiscard]] static bool HasSamples(const WebModel& model, const Place& place, MonoNs due);
  static std::string TakeSamples(const WebModel& model, const std::string& device, Place& place, MonoNs now);
  static std::uint64_t FirstRow(const WebModel& model, std::size_t device, double history_s, WebTimestamp now);

  std::deque<std::string> queued_;
  std::uint64_t layout_ = 0;
  std::uint64_t next_event_ = 0;
  MonoNs state_sent_ = 0;
  std::size_t state_hash_ = 0;
  std::map<std::string, Place> places_;
  std::string last_device_;  // whose samples were sent last
  double history_s_ = 0;
};

}  // namespace axlecast
