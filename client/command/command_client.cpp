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

  void Start(Result<> keys);
  Result<> Subscribe();
  void Stop();
  void Run();
  void RunWithoutPort();
  bool Listen(MonoNs until);
  MonoNs Advance(std::vector<CommandResult>& news);
  void Report(std::unique_lock<std::mutex>& lock, const std::vector<CommandResult>& news) const;
  CommandResult Wait(const CommandSessions::Key& key, std::int64_t timeout_ms);
  std::optional<CommandResult> Ended(const CommandSessions::Key& key) const;

  const SystemClock clock;
  LcmPort port;
  const WakeEvent wake;
  std::thread thread;
  std::vector<std::vector<std::uint8_t>> arrived;  // of the thread

  std::mutex mutex;                 // of what follows
  std::condition_variable changed;  // a command changed
  std::condition_variable asked;    // without a port: a command was refused, or `stopping`
  CommandSessions sessions;
  std::multiset<MonoNs> deadlines;  // of those who wait
  StatusCallback callback;
  Result<> usable;
  bool stopping = false;
};

// If the thread runs, only the thread writes `usable`.
void CommandClient::State::Start(Result<> keys) {
  usable = keys.and_then([this] { return Subscribe(); });
  try {
    thread = std::thread([this] { usable ? Run() : RunWithoutPort(); });
  } catch (const std::system_error& error) {
    usable = Failure(std::string("no thread: ") + error.what());
  }
}

Result<> CommandClient::State::Subscribe() {
  if (!port.problem().empty()) return Failure(port.problem());
  if (!wake.valid()) return Failure("no eventfd: too many files are open");
  const bool subscribed = port.Subscribe("COMMAND_STATUS", [this](const std::string&, Bytes message) {
    arrived.emplace_back(message.begin(), message.end());
  });
  if (!subscribed) return Failure("cannot subscribe to COMMAND_STATUS");
  return {};
}

void CommandClient::State::Stop() {
  {
    const std::lock_guard lock(mutex);
    stopping = true;
  }
  wake.Set();
  asked.notify_all();
  if (thread.joinable()) thread.join();
}

void CommandClient::State::Run() {
  MonoNs next = 0;
  std::vector<CommandResult> news;
  while (Listen(next)) {
    std::unique_lock lock(mutex);
    next = Advance(news);
    // The waiting calls that are woken below remove their own deadlines.
    const auto deadline = deadlines.upper_bound(clock.Now());
    if (deadline != deadlines.end()) next = std::min(next, *deadline);
    if (stopping) return;
    Report(lock, news);
  }
  {
    const std::lock_guard lock(mutex);
    usable = Failure("the command port failed");
    sessions.EndAll(usable.error().text);
  }
  RunWithoutPort();
}

// Reports the end of what was under way when the port failed, and of what is refused since then.
void CommandClient::State::RunWithoutPort() {
  std::vector<CommandResult> news;
  while (true) {
    std::unique_lock lock(mutex);
    asked.wait(lock, [&] {
      Advance(news);
      return stopping || !news.empty();
    });
    if (stopping) return;
    Report(lock, news);
  }
}

// Passes received statuses to the commands and sends what is due. Returns when that is due again. The mutex is locked.
MonoNs CommandClient::State::Advance(std::vector<CommandResult>& news) {
  news.clear();
  const auto report = [&news](const CommandResult& result) { news.push_back(result); };
  for (const auto& message : arrived) sessions.OnStatus(message, report);
  arrived.clear();
  const MonoNs next = sessions.Poll(report);
  changed.notify_all();
  return next;
}

// Calls back without the lock, so that the callback may use the client.
void CommandClient::State::Report(std::unique_lock<std::mutex>& lock,
                                  const std::vector<CommandResult>& news) const {
  const StatusCallback report = news.empty() ? StatusCallback() : callback;
  lock.unlock();
  if (!report) return;
  for (const CommandResult& result : news) report(result);
}

// Waits for messages, a call of another thread, or `until`. False when the port failed.
bool CommandClient::State::Listen(MonoNs until) {
  std::array<pollfd, 2> files{pollfd{port.FileDescriptor(), POLLIN, 0}, pollfd{wake.FileDescriptor(), POLLIN, 0}};
  if (PollUntil(files, until, clock) < 0) return false;
  if (files[1].revents != 0) wake.Take();
  return files[0].revents == 0 || port.Handle(0);
}

// Returns the result of a wait that has ended; nothing if the wait must continue.
std::optional<CommandResult> CommandClient::State::Ended(const CommandSessions::Key& key) const {
  const CommandSession* session = sessions.Find(key);
  if (session == nullptr) {
    return WithProblem(key.second, "this client does not know the id (any more): Query asks the bridge");
  }
  if (!session->done()) return std::nullopt;
  return session->result();
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
  state_->Start(keys ? Result<>() : Failure(keys.error()));
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
    state_->sessions.Refuse(id, request, state_->usable.error().text + ": nothing was sent");
    state_->asked.notify_all();
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
