#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/base/time.h"
#include "tools/foxglove/foxglove_frames.h"

namespace axlecast {

// A frame to send.
struct FoxgloveFrame {
  std::string text;
  bool binary = false;
};

// One viewer: its subscriptions, and the frames that wait for it. A viewer that is slower than its messages loses the oldest ones, and
// nobody else's: the messages of rare channels (alarms, devices) are kept as long as there are others to drop. Time is an argument.
class FoxgloveViewer {
 public:
  static constexpr std::size_t kMaxWaiting = 8U << 20;  // bytes of messages
  static constexpr std::size_t kMaxTexts = 32U << 20;   // bytes of other frames: more than all channels need
  static constexpr std::size_t kMaxSubscriptions = 10'000;
  static constexpr MonoNs kReportEvery = kSecond;  // of what was dropped

  // Adds a frame of text: it is sent before the messages that wait, and never dropped.
  void Add(std::string text);

  // Subscribes, unless the number is in use. `known`: the channel is advertised.
  [[nodiscard]] Result<> Subscribe(FoxgloveSubscribe::One subscription, bool known);
  // Fails if there is no such subscription.
  [[nodiscard]] Result<> Unsubscribe(std::uint32_t subscription);
  // Ends the subscriptions of a channel that is not advertised any more.
  void Forget(std::uint32_t channel);
  [[nodiscard]] bool IsSubscribed(std::uint32_t channel) const { return subscriptions_.contains(channel); }

  // Adds a message for each subscription of its channel. `kept`: it is dropped only if no other message waits.
  void Add(std::uint32_t channel, std::uint64_t time_ns, const std::shared_ptr<const std::string>& payload,
           bool kept);

  // Returns the next frame; nothing if none waits. States what was dropped, at most once in kReportEvery.
  [[nodiscard]] std::optional<FoxgloveFrame> Next(MonoNs now);
  // Returns true if the viewer reads nothing, so that it should be closed.
  [[nodiscard]] bool is_stuck() const { return text_bytes_ > kMaxTexts; }
  [[nodiscard]] std::int64_t dropped() const { return dropped_; }

 private:
  struct Waiting {
    std::uint32_t subscription = 0;
    std::uint64_t time_ns = 0;
    std::shared_ptr<const std::string> payload;
    std::uint64_t order = 0;
  };

  void DropOldest();

  std::map<std::uint32_t, std::vector<std::uint32_t>> subscriptions_;  // by channel
  std::map<std::uint32_t, std::uint32_t> channels_;                    // by subscription
  std::deque<std::string> texts_;
  std::size_t text_bytes_ = 0;
  std::deque<Waiting> kept_;    // oldest first
  std::deque<Waiting> others_;  // oldest first
  std::uint64_t order_ = 0;
  std::size_t bytes_ = 0;  // of both
  std::int64_t dropped_ = 0;
  std::int64_t reported_ = 0;
  MonoNs next_report_ = 0;
};

}  // namespace axlecast
