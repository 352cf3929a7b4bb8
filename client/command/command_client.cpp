#include <poll.h>
#include <sodium.h>

#include <algorithm>
#include <array>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <set>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "client/axlecast/command_client.h"
#include "client/command/command_session.h"
#include "client/command/signed_messages.h"
#include "core/base/result.h"
#include "core/messages/enum_names.h"
#include "platform/net/lcm_port.h"
#include "platform/os/descriptor.h"
#include "platform/os/process.h"
#include "platform/os/secret_file.h"
#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

using Kind = CommandSessions::Kind;

constexpr std::int64_t kLongestWaitMs = 366LL * 86'400'000;
constexpr const char* kNoClient = "this client was moved from";

// What comes of a wait that ended before the command did.
CommandResult NotYet(CommandResult result) {
  result.under_way = true;
  if (result.answered && result.status.is_final != 0) return result;  // its finding is still to come
  const std::string stands =
      result.answered ? "it is " + std::string(StateName(result.status.state)) + " still" : "no status came yet";
  result.problem =
      stands + ": it may be done until its validity ends; ask for this id later, and do not send it again before";
  return result;
}

CommandResult WithProblem(const CommandId& id, const std::string& problem) {
  CommandResult result;
  result.id = id;
  result.problem = problem;
  return result;
}

}  // namespace

struct CommandClient::State {
  State(const ClientSettings& settings, ClientKeys keys)
      : port(settings.command_url, settings.prefix, settings.machine),
        sessions(clock, port, NewOrigin(settings.machine), std::move(keys)) {}

  Result<> Start();
  void Stop();
  void Run();
  bool Listen(MonoNs until);
  std::vector<command_status_t> TakeIn();
  CommandResult Wait(const CommandSessions::Key& key, std::int64_t timeout_ms);
  std::optional<CommandResult> Ended(const CommandSessions::Key& key) const;

  const SystemClock clock;
  LcmPort port;
  const WakeEvent wake;
  std::thread thread;
  std::vector<std::vector<std::uint8_t>> arrived;  // of the thread

  std::mutex mutex;  // of what follows
  std::condition_variable changed;
  CommandSessions sessions;
  std::multiset<MonoNs> deadlines;  // of those who wait
  StatusCallback callback;
  Result<> usable;
  bool stopping = false;
};

Result<> CommandClient::State::Start() {
  if (!port.problem().empty()) return Failure(port.problem());
  if (!wake.valid()) return Failure("no eventfd: too many files are open");
  const bool subscribed = port.Subscribe("COMMAND_STATUS", [this](const std::string&, Bytes message) {
    arrived.emplace_back(message.begin(), message.end());
  });
  if (!subscribed) return Failure("cannot subscribe to COMMAND_STATUS");
  try {
    thread = std::thread([this] { Run(); });
  } catch (const std::system_error& error) {
    return Failure(std::string("no thread: ") + error.what());
  }
  return {};
}

void CommandClient::State::Stop() {
  {
    const std::lock_guard lock(mutex);
    stopping = true;
  }
  wake.Set();
  if (thread.joinable()) thread.join();
}

void CommandClient::State::Run() {
  MonoNs next = 0;
  while (Listen(next)) {
    std::unique_lock lock(mutex);
    const std::vector<command_status_t> news = TakeIn();
    next = sessions.Poll();
    // The waiting calls that are woken below remove their own deadlines.
    const auto deadline = deadlines.upper_bound(clock.Now());
    if (deadline != deadlines.end()) next = std::min(next, *deadline);
    changed.notify_all();
    if (stopping) return;
    const StatusCallback report = news.empty() ? StatusCallback() : callback;
    lock.unlock();
    if (!report) continue;
    for (const command_status_t& status : news) report(status);
  }
  const std::lock_guard lock(mutex);
  usable = Failure("the command port failed");
  changed.notify_all();
}

// Waits for messages, a call of another thread, or `until`. False when the port failed.
bool CommandClient::State::Listen(MonoNs until) {
  std::array<pollfd, 2> files{pollfd{port.FileDescriptor(), POLLIN, 0}, pollfd{wake.FileDescriptor(), POLLIN, 0}};
  if (PollUntil(files, until, clock) < 0) return false;
  if (files[1].revents != 0) wake.Take();
  return files[0].revents == 0 || port.Handle(0);
}

std::vector<command_status_t> CommandClient::State::TakeIn() {
  std::vector<command_status_t> news;
  for (const auto& message : arrived) {
    sessions.OnStatus(message, [&news](const command_status_t& status) { news.push_back(status); });
  }
  arrived.clear();
  return news;
}

// Returns the result of a wait that has ended; nothing if the wait must continue.
std::optional<CommandResult> CommandClient::State::Ended(const CommandSessions::Key& key) const {
  const CommandSession* session = sessions.Find(key);
  if (session == nullptr) {
    return WithProblem(key.second, "this client does not know the id (any more): Query asks the bridge");
  }
  if (session->done()) return session->result();
  if (usable) return std::nullopt;
  CommandResult result = session->result();
  result.problem = usable.error().text + ": ask for this id later";
  return result;
}

CommandResult CommandClient::State::Wait(const CommandSessions::Key& key, std::int64_t timeout_ms) {
  const bool own_thread = std::this_thread::get_id() == thread.get_id();  // it would wait for itself
  const std::int64_t wait_ms = own_thread ? 0 : std::clamp<std::int64_t>(timeout_ms, 0, kLongestWaitMs);
  std::unique_lock lock(mutex);
  const MonoNs deadline = clock.Now() + wait_ms * kMillisecond;
  const auto mine = deadlines.insert(deadline);
  wake.Set();
  std::optional<CommandResult> result = Ended(key);
  while (!result) {
    if (clock.Now() >= deadline) {
      result = NotYet(sessions.Find(key)->result());
      result->problem += NetworkNote(port.received());
      break;
    }
    changed.wait(lock);
    result = Ended(key);
  }
  deadlines.erase(mine);
  return *result;
}

CommandClient::CommandClient(const ClientSettings& settings) {
  SecretFiles secrets;
  Result<ClientKeys> keys = LoadClientKeys(settings, secrets);
  state_ = std::make_unique<State>(settings, keys ? std::move(*keys) : ClientKeys{});
  // If the thread runs, only the thread writes `usable`.
  if (const Result<> started = keys ? state_->Start() : Result<>(Failure(keys.error())); !started) {
    state_->usable = started;
  }
}

CommandClient::~CommandClient() {
  if (state_) state_->Stop();
}

CommandClient::CommandClient(CommandClient&& other) noexcept = default;

CommandClient& CommandClient::operator=(CommandClient&& other) noexcept {
  if (this == &other) return *this;
  if (state_) state_->Stop();
  state_ = std::move(other.state_);
  return *this;
}

Result<> CommandClient::state() const {
  if (!state_) return Failure(kNoClient);
  const std::lock_guard lock(state_->mutex);
  return state_->usable;
}

CommandId CommandClient::Send(const CommandRequest& request) {
  const CommandId id = RandomId();
  if (!state_) return id;
  const std::lock_guard lock(state_->mutex);
  if (state_->usable) {
    state_->sessions.Send(id, request);
  } else {
    state_->sessions.Refuse(id, state_->usable.error().text + ": nothing was sent");
  }
  state_->wake.Set();
  return id;
}

void CommandClient::OnStatus(StatusCallback callback) {
  if (!state_) return;
  const std::lock_guard lock(state_->mutex);
  state_->callback = std::move(callback);
}

CommandResult CommandClient::Await(const CommandId& id, std::int64_t timeout_ms) {
  return state_ ? state_->Wait({Kind::kCommand, id}, timeout_ms) : WithProblem(id, kNoClient);
}

void CommandClient::Cancel(const CommandId& id) {
  if (!state_) return;
  const std::lock_guard lock(state_->mutex);
  state_->sessions.Cancel(id);
  state_->wake.Set();
}

CommandResult CommandClient::Query(const CommandId& id, std::int64_t timeout_ms) {
  if (!state_) return WithProblem(id, kNoClient);
  {
    const std::lock_guard lock(state_->mutex);
    if (!state_->usable) return WithProblem(id, state_->usable.error().text);
    state_->sessions.Query(id, RandomId());
    state_->wake.Set();
  }
  return state_->Wait({Kind::kQuery, id}, timeout_ms);
}

}  // namespace axlecast
