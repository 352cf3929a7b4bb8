#include "client/axlecast/permit_issuer.h"

#include <poll.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <deque>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include "client/axlecast/time_base.h"
#include "client/command/permit_slot.h"
#include "client/command/signed_messages.h"
#include "core/base/result.h"
#include "platform/net/lcm_port.h"
#include "platform/os/descriptor.h"
#include "platform/os/process.h"
#include "platform/os/secret_file.h"
#include "platform/os/system_clock.h"

namespace axlecast {

struct PermitIssuer::State {
  struct Slot : PermitSlot {
    using PermitSlot::PermitSlot;
    std::atomic<std::int64_t> seq = 0;  // of PERMIT/<device>
    Slot* next = nullptr;
  };

  State(const ClientSettings& settings, const PermitOptions& options)
      : time(options.time), port(settings.command_url, settings.prefix), origin(NewOrigin(settings.machine)) {
    SecretFiles secrets;
    Result<ClientKeys> loaded = LoadClientKeys(settings, secrets);
    if (loaded) keys = std::move(*loaded);
    if (!loaded) usable = Failure(loaded.error());
    if (!port.problem().empty()) usable = Failure(port.problem());
    if (!wake.valid()) usable = Failure("no eventfd: too many files are open");
  }
  ~State() { Stop(); }

  void Start();
  void Stop();
  void Run();
  [[nodiscard]] bool usable_now() const { return usable && running; }
  [[nodiscard]] PermitInstant Now() const;
  [[nodiscard]] Slot* Find(const std::string& device) const;
  Slot* Add(const std::string& device);
  bool Send(Slot& slot, const PermitRequest& request);

  const SystemClock clock;
  const TimeBase* const time;
  LcmPort port;
  const WakeEvent wake;
  Result<> usable;
  ClientKeys keys;
  const Origin origin;
  std::atomic<std::int64_t> issue = 0;  // the last
  std::atomic<Slot*> first = nullptr;
  std::mutex adding;  // of the next
  std::deque<Slot> slots;
  std::atomic<std::int64_t> sent = 0;
  std::atomic<std::int64_t> failed = 0;
  std::atomic<std::int64_t> expired = 0;
  std::atomic<bool> running = false;
  std::atomic<bool> stopping = false;
  std::thread thread;
};

void PermitIssuer::State::Start() {
  if (!usable) return;
  running = true;
  try {
    thread = std::thread([this] { Run(); });
  } catch (const std::system_error& error) {
    usable = Failure(std::string("no thread: ") + error.what());
  }
}

void PermitIssuer::State::Stop() {
  stopping = true;
  wake.Set();
  if (thread.joinable()) thread.join();
}

void PermitIssuer::State::Run() {
  MonoNs next = kNever;
  std::array<pollfd, 1> files{pollfd{wake.FileDescriptor(), POLLIN, 0}};
  while (PollUntil(files, next, clock) >= 0 && !stopping) {
    wake.Take();
    next = kNever;
    for (Slot* slot = first; slot != nullptr; slot = slot->next) {
      const PermitSlot::Step step = slot->Next(clock.Now());
      if (step.send != nullptr) static_cast<void>(Send(*slot, *step.send));
      next = std::min(next, step.next);
    }
  }
  running = false;
}

PermitInstant PermitIssuer::State::Now() const {
  PermitInstant now{clock.Now(), clock.UtcMicroseconds(), {}};
  if (time == nullptr) return now;
  if (const TimeBase::Instant at = time->OnBase(origin.clock_id, now.mono, now.mono)) {
    now.base = {at.base_id, at.ns, at.half_width_ns};
  }
  return now;
}

PermitIssuer::State::Slot* PermitIssuer::State::Find(const std::string& device) const {
  Slot* slot = first;
  while (slot != nullptr && slot->device() != device) slot = slot->next;
  return slot;
}

// The thread follows `next` without the lock.
PermitIssuer::State::Slot* PermitIssuer::State::Add(const std::string& device) {
  const std::lock_guard lock(adding);
  if (Slot* slot = Find(device)) return slot;
  Slot& slot = slots.emplace_back(device);
  slot.next = first;
  first = &slot;
  return &slot;
}

bool PermitIssuer::State::Send(Slot& slot, const PermitRequest& request) {
  permit_body_t body{};
  body.valid_ms = RemainingMs(request, clock.Now());
  if (body.valid_ms < 1) {
    ++expired;
    return false;
  }
  body.device = slot.device();
  body.issuer_boot_id = origin.boot_id;
  body.issue = request.issue;
  body.issued_utime = request.called.utime;
  body.clock_id = origin.clock_id;
  body.issued_mono_ns = request.called.mono;
  body.base_id = request.called.base.base_id;
  body.issued_base_ns = request.called.base.base_ns;
  body.issued_half_width_ns = request.called.base.half_width_ns;
  body.operations = request.operations;
  permit_t permit = MakePermit(std::move(body), keys.own.get());
  permit.utime = clock.UtcMicroseconds();
  permit.mono_ns = clock.Now();
  origin.Set(permit);
  if (slot.IsWithdrawn(request)) return false;
  permit.seq = slot.seq++;
  const std::int64_t unsent = port.unsent();
  const bool done = Publish(port, "PERMIT/" + slot.device(), permit) && port.unsent() == unsent;
  ++(done ? sent : failed);
  return done;
}

PermitIssuer::PermitIssuer(const ClientSettings& settings, const PermitOptions& options)
    : state_(std::make_unique<State>(settings, options)) {
  state_->Start();
}
PermitIssuer::~PermitIssuer() = default;
PermitIssuer::PermitIssuer(PermitIssuer&& other) noexcept = default;
PermitIssuer& PermitIssuer::operator=(PermitIssuer&& other) noexcept = default;

Result<> PermitIssuer::state() const {
  if (!state_) return Failure("this issuer was moved from");
  if (state_->usable && !state_->running) return Failure("the thread that sends permits has failed: start again");
  return state_->usable;
}

bool PermitIssuer::Allow(const std::string& device, const std::vector<std::string>& operations,
                         std::int32_t valid_ms) {
  if (!state_ || !state_->usable_now() || valid_ms < 1 || valid_ms > kMaxValidMs) return false;
  const PermitInstant now = state_->Now();
  State::Slot* slot = state_->Find(device);
  if (slot == nullptr) {
    if (!FitsPermit(device, operations)) return false;
    slot = state_->Add(device);
  }
  const PermitSlot::Asked asked = slot->Allow(operations, valid_ms, now, state_->issue);
  if (asked == PermitSlot::Asked::kWake) state_->wake.Set();
  return asked != PermitSlot::Asked::kRefused;
}

bool PermitIssuer::Withdraw(const std::string& device) {
  if (!state_ || !state_->usable) return false;
  State::Slot* slot = state_->Find(device);
  if (slot == nullptr) return true;
  const std::optional<PermitRequest> request = slot->Withdraw(state_->Now(), state_->issue);
  return !request || state_->Send(*slot, *request);
}

PermitIssuer::Totals PermitIssuer::totals() const {
  return state_ ? Totals{state_->sent, state_->failed, state_->expired} : Totals{};
}

}  // namespace axlecast
