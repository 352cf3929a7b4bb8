#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "platform/net/web_server.h"
#include "tools/web/web_access.h"

namespace axlecast {

// Serves /metrics and /healthz of a program that has no page, without a token. Everything else is refused, also every WebSocket.
class MetricsSite final : public WebServices {
 public:
  // `metrics` is called on the server's thread. `access` outlives it.
  MetricsSite(const WebAccess& access, std::function<std::string()> metrics)
      : access_(access), metrics_(std::move(metrics)) {}

  // Ends the server at its next tick. May be called from any thread.
  void End() { ended_ = true; }

  [[nodiscard]] WebAnswer OnRequest(const WebRequest& request) override;
  [[nodiscard]] int OnUpgrade(const WebRequest& /*request*/) override { return 404; }
  void OnOpen(WebConnection /*connection*/) override {}
  void OnFrame(WebConnection /*connection*/, std::string_view /*text*/) override {}
  [[nodiscard]] WebFrame NextFrame(WebConnection /*connection*/) override { return {}; }
  void OnClose(WebConnection /*connection*/) override {}
  [[nodiscard]] bool OnTick() override { return !ended_; }

 private:
  const WebAccess& access_;
  std::function<std::string()> metrics_;
  std::atomic<bool> ended_ = false;
};

}  // namespace axlecast
