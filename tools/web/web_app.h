#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/result.h"
#include "core/base/time.h"
#include "platform/net/web_server.h"
#include "tools/web/client_stream.h"
#include "tools/web/fleet_worker.h"
#include "tools/web/log_player.h"
#include "tools/web/page_files.h"
#include "tools/web/web_access.h"
#include "tools/web/web_model.h"

namespace axlecast {

// The parts of the application. All must outlive it.
struct WebSiteParts {
  const Clock* clock = nullptr;
  WebAccess* access = nullptr;
  std::span<const PageFile> files;
  std::size_t max_clients = 16;
  WebModel* live =
      nullptr;  // without machine: of a fleet alone; for a log, `open_log` returns a player for each browser instead
  std::function<std::unique_ptr<LogPlayer>()> open_log;
  FleetWorker* fleet = nullptr;          // null: no fleet database
  std::function<bool()> tick;            // processes received messages; false ends the application
  std::function<std::string()> problem;  // why it does not work, or empty
  std::function<std::string()> metrics;  // null: no metrics
};

// Serves the page's files, its WebSockets, metrics and health. No request reaches a device.
class WebApp final : public WebServices {
 public:
  // Maximum frames per second from one browser.
  static constexpr int kMaxFrames = 50;

  explicit WebApp(WebSiteParts parts) : parts_(std::move(parts)) {}

  // Returns the headers of every answer.
  [[nodiscard]] static std::vector<std::pair<std::string, std::string>> SecurityHeaders();

  [[nodiscard]] WebAnswer OnRequest(const WebRequest& request) override;
  [[nodiscard]] int OnUpgrade(const WebRequest& request) override;
  void OnOpen(WebConnection connection) override;
  void OnFrame(WebConnection connection, std::string_view text) override;
  [[nodiscard]] WebFrame NextFrame(WebConnection connection) override;
  void OnClose(WebConnection connection) override;
  [[nodiscard]] bool OnTick() override;

 private:
  // One browser.
  struct Client {
    ClientStream feed;
    std::unique_ptr<LogPlayer> player;  // of a log
    WebPlayback playback;               // as last sent
    MonoNs playback_sent = 0;
    MonoNs window = 0;  // start of the second in which its frames are counted
    int frames = 0;
    bool too_many = false;
    bool answer_is_next = false;  // of the fleet
  };

  [[nodiscard]] WebAnswer Get(const WebRequest& request) const;
  [[nodiscard]] WebAnswer SignIn(const WebRequest& request);
  [[nodiscard]] WebAnswer File(std::string_view name, const WebRequest& request) const;
  [[nodiscard]] WebAnswer SignInPage() const;
  [[nodiscard]] WebAnswer Metrics(const WebRequest& request) const;
  [[nodiscard]] const PageFile* Find(std::string_view name) const;
  [[nodiscard]] WebModel& ModelOf(Client& client) const {
    return client.player ? client.player->model() : *parts_.live;
  }
  [[nodiscard]] WebTimestamp NowOf(const Client& client) const;
  [[nodiscard]] bool TakesFrame(Client& client) const;
  [[nodiscard]] bool PlaybackIsDue(Client& client) const;
  [[nodiscard]] Result<> Execute(Client& client, const PageRequest& request) const;
  [[nodiscard]] std::optional<std::string> TakeAnswer(WebConnection connection) const;
  [[nodiscard]] Result<> AskFleet(WebConnection connection, const FleetRequest& request) const;

  WebSiteParts parts_;
  std::map<WebConnection, Client> clients_;
};

}  // namespace axlecast
