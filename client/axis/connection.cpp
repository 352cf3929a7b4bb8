#include "client/axis/connection.h"

#include <poll.h>

#include <algorithm>
#include <array>
#include <axlecast/time_quality_t.hpp>
#include <system_error>

namespace axlecast {
inline namespace control {
namespace {

ClientSettings SettingsFor(const ConnectionSettings& settings, const ConnectionSettings::Key& key) {
  ClientSettings client;
  client.command_url = settings.command_url;
  client.prefix = settings.prefix;
  client.machine = settings.machine;
  client.bridge_key = settings.bridge_key;
  client.key_file = key.file;
  client.key_credential = key.credential;
  return client;
}

}  // namespace

Connection::State::State(const ConnectionSettings& settings)
    : machine_id(settings.machine.empty() ? 0 : IdOfName(settings.machine)),
      port(settings.data_url, settings.prefix, settings.machine),
      time(machine_id) {
  if (settings.commands) commands.emplace(SettingsFor(settings, *settings.commands));
  if (settings.permits) permits.emplace(SettingsFor(settings, *settings.permits), PermitOptions{&time});
}

void Connection::State::Start() {
  const auto handler = [this](const std::string& channel, Bytes message) {
    const MonoNs now = clock.Now();
    const std::lock_guard lock(mutex);
    if (channel.starts_with("TIME/")) {
      if (const auto claim = DecodeMessage<time_quality_t>(message)) time.OnTime(*claim, now);
      return;
    }
    for (Receiver* receiver : receivers) receiver->On(channel, message, now);
  };
  if (!port.problem().empty()) {
    usable = Failure(port.problem());
  } else if (!wake.valid()) {
    usable = Failure("no eventfd: too many files are open");
  } else if (!port.Subscribe("(POSITION|DEVICE|POSITION_SET|TIME)/.*", handler)) {
    usable = Failure(port.problem().empty() ? "cannot subscribe to POSITION" : port.problem());
  } else {
    try {
      thread = std::thread([this] { Run(); });
    } catch (const std::system_error& error) {
      usable = Failure(std::string("no thread: ") + error.what());
    }
  }
}

void Connection::State::Stop() {
  stopping = true;
  wake.Set();
  if (thread.joinable()) thread.join();
}

void Connection::State::Run() {
  std::array<pollfd, 2> files{pollfd{port.FileDescriptor(), POLLIN, 0}, pollfd{wake.FileDescriptor(), POLLIN, 0}};
  while (PollUntil(files, kNever, clock) >= 0 && !stopping) {
    if (files[0].revents != 0 && !port.Handle(0)) break;
  }
  failed = !stopping;
}

void Connection::State::Add(Receiver& receiver) {
  const std::lock_guard lock(mutex);
  receivers.push_back(&receiver);
}

void Connection::State::Remove(Receiver& receiver) {
  const std::lock_guard lock(mutex);
  receivers.erase(std::remove(receivers.begin(), receivers.end(), &receiver), receivers.end());
}

Connection::Connection(const ConnectionSettings& settings) : state_(std::make_shared<State>(settings)) {
  state_->Start();
}

Connection::~Connection() { state_->Stop(); }

Result<> Connection::state() const {
  if (!state_->usable) return state_->usable;
  if (state_->failed) return Failure("the port of the positions failed: start again");
  if (state_->commands && !state_->commands->state()) return state_->commands->state();
  return state_->permits ? state_->permits->state() : Result<>();
}

std::int64_t Connection::Now() { return SystemClock().Now(); }

TimeBase::Instant Connection::OnBase(std::int64_t mono_ns) const {
  const std::lock_guard lock(state_->mutex);
  return state_->time.OnBase(OwnClockId(), mono_ns, state_->clock.Now());
}

CommandClient* Connection::commands() { return state_->commands ? &*state_->commands : nullptr; }

}  // namespace control
}  // namespace axlecast
