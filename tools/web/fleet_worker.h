#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "platform/net/web_server.h"
#include "tools/web/fleet_request.h"

namespace axlecast {

// Has the questions of all browsers answered on a thread of its own, one after the other: a slow database delays no live
// data. Browsers take turns, so that many questions of one do not delay those of another.
class FleetWorker {
 public:
  // Questions of one browser that wait, are answered, or whose answer was not taken yet.
  static constexpr std::size_t kMaxOpen = 12;

  // `answer` returns the frame; it is called on the worker's thread. `stop` must make it return soon.
  FleetWorker(std::function<std::string(const FleetRequest&)> answer, std::function<void()> stop);
  ~FleetWorker();
  FleetWorker(const FleetWorker&) = delete;
  FleetWorker& operator=(const FleetWorker&) = delete;

  // The following functions are for the server's thread and do not wait for an answer.

  // Returns false if the browser has too many open questions.
  [[nodiscard]] bool Ask(WebConnection connection, FleetRequest request);
  // Returns the next answer for this browser.
  [[nodiscard]] std::optional<std::string> Take(WebConnection connection);
  // Drops the questions and answers of a browser that is gone.
  void Forget(WebConnection connection);

 private:
  struct Browser {
    std::deque<FleetRequest> questions;
    bool in_work = false;
    std::deque<std::string> answers;
  };

  void Run();
  [[nodiscard]] bool HasQuestion() const;
  [[nodiscard]] WebConnection NextBrowser() const;

  const std::function<std::string(const FleetRequest&)> answer_;
  const std::function<void()> stop_;
  std::mutex mutex_;
  std::condition_variable asked_;
  std::map<WebConnection, Browser> browsers_;
  WebConnection last_ = 0;  // whose question was answered last
  bool ends_ = false;
  std::thread thread_;  // last: it uses all of the others
};

}  // namespace axlecast
