#include "tools/web/fleet_worker.h"

#include <algorithm>
#include <utility>

namespace axlecast {

FleetWorker::FleetWorker(std::function<std::string(const FleetRequest&)> answer, std::function<void()> stop)
    : answer_(std::move(answer)), stop_(std::move(stop)), thread_([this] { Run(); }) {}

FleetWorker::~FleetWorker() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  asked_.notify_one();
  stop_();
  thread_.join();
}

bool FleetWorker::Ask(WebConnection connection, FleetRequest request) {
  {
    const std::lock_guard lock(mutex_);
    Browser& browser = browsers_[connection];
    const std::size_t open = browser.questions.size() + browser.answers.size() + (browser.in_work ? 1 : 0);
    if (open >= kMaxOpen) return false;
    browser.questions.push_back(std::move(request));
  }
  asked_.notify_one();
  return true;
}

std::optional<std::string> FleetWorker::Take(WebConnection connection) {
  const std::lock_guard lock(mutex_);
  const auto found = browsers_.find(connection);
  if (found == browsers_.end() || found->second.answers.empty()) return std::nullopt;
  std::string frame = std::move(found->second.answers.front());
  found->second.answers.pop_front();
  return frame;
}

void FleetWorker::Forget(WebConnection connection) {
  const std::lock_guard lock(mutex_);
  browsers_.erase(connection);
}

bool FleetWorker::HasQuestion() const {
  return std::any_of(browsers_.begin(), browsers_.end(),
                     [](const auto& entry) { return !entry.second.questions.empty(); });
}

// Round-robin: begins behind the browser that was answered last.
WebConnection FleetWorker::NextBrowser() const {
  const auto waits = [](const auto& entry) { return !entry.second.questions.empty(); };
  const auto after = browsers_.upper_bound(last_);
  const auto next = std::find_if(after, browsers_.end(), waits);
  return next != browsers_.end() ? next->first : std::find_if(browsers_.begin(), after, waits)->first;
}

void FleetWorker::Run() {
  std::unique_lock lock(mutex_);
  while (true) {
    asked_.wait(lock, [this] { return ends_ || HasQuestion(); });
    if (ends_) return;
    last_ = NextBrowser();
    Browser& asks = browsers_[last_];
    const FleetRequest request = std::move(asks.questions.front());
    asks.questions.pop_front();
    asks.in_work = true;
    lock.unlock();
    std::string frame = answer_(request);
    lock.lock();
    // Connections are never numbered again, so that this is the browser that asked, if it is still there.
    const auto found = browsers_.find(last_);
    if (found == browsers_.end()) continue;
    found->second.in_work = false;
    found->second.answers.push_back(std::move(frame));
  }
}

}  // namespace axlecast
