#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"
#include "platform/net/web_server.h"
#include "tools/foxglove/foxglove_feed.h"
#include "tools/foxglove/foxglove_viewer.h"
#include "tools/web/web_access.h"

namespace axlecast {

// The parts of the application. All must outlive it.
struct FoxgloveParts {
  const Clock* clock = nullptr;
  WebAccess* access = nullptr;
  const LcmDefinitions* definitions = nullptr;
  std::string name;                  // of the machine
  std::string session_id;            // of this process
  std::vector<std::string> origins;  // of pages that may connect, such as https://app.foxglove.dev
  std::size_t max_viewers = 16;
  std::function<bool()> tick;            // processes received messages; false ends the application
  std::function<std::string()> problem;  // why it does not work, or empty
};

// Serves viewers of the Foxglove protocol. They receive only: no request reaches a device.
class FoxgloveApp final : public WebServices {
 public:
  static constexpr int kMaxRequests =
      10'000;  // of one viewer, in a second: it subscribes to each channel by a request
  static constexpr std::size_t kLongestRequest = 1U << 20;
  [[nodiscard]] static std::vector<std::string> Subprotocols() {
    return {"foxglove.sdk.v1", "foxglove.websocket.v1"};
  }

  explicit FoxgloveApp(FoxgloveParts parts) : parts_(std::move(parts)), feed_(*parts_.definitions) {}

  // Passes an LCM message to the viewers. `utime`: us, UNIX time of its arrival. A message whose type has a field utime has its own.
  void OnMessage(const std::string& channel, Bytes message, std::int64_t utime);
  // Returns the messages that viewers were too slow for, of all viewers since the start.
  [[nodiscard]] std::int64_t dropped() const;
  [[nodiscard]] std::size_t viewers() const { return viewers_.size(); }

  [[nodiscard]] WebAnswer OnRequest(const WebRequest& request) override;
  [[nodiscard]] int OnUpgrade(const WebRequest& request) override;
  void OnOpen(WebConnection connection) override;
  void OnFrame(WebConnection connection, std::string_view text) override;
  [[nodiscard]] WebFrame NextFrame(WebConnection connection) override;
  void OnClose(WebConnection connection) override;
  [[nodiscard]] bool OnTick() override;

 private:
  struct Viewer {
    FoxgloveViewer frames;
    MonoNs window = 0;  // start of the second in which its requests are counted
    int requests = 0;
    bool too_many = false;
  };

  void Announce(const FoxgloveFeed::News& news);
  void Execute(Viewer& viewer, const FoxgloveRequest& request) const;
  [[nodiscard]] bool IsAllowedOrigin(const WebRequest& request) const;

  FoxgloveParts parts_;
  FoxgloveFeed feed_;
  std::map<WebConnection, Viewer> viewers_;
  std::int64_t dropped_before_ = 0;  // of viewers that have left
};

}  // namespace axlecast
