#include "client/axlecast/permit_issuer.h"

#include <map>
#include <mutex>
#include <utility>

#include "client/command/signed_messages.h"
#include "core/base/result.h"
#include "platform/net/lcm_port.h"
#include "platform/os/process.h"
#include "platform/os/secret_file.h"
#include "platform/os/system_clock.h"

namespace axlecast {

struct PermitIssuer::State {
  explicit State(const ClientSettings& settings)
      : port(settings.command_url, settings.prefix), origin(NewOrigin(settings.machine)) {
    SecretFiles secrets;
    Result<ClientKeys> loaded = LoadClientKeys(settings, secrets);
    if (loaded) keys = std::move(*loaded);
    if (!loaded) usable = Failure(loaded.error());
    if (!port.problem().empty()) usable = Failure(port.problem());
  }

  bool Issue(const std::string& device, const std::vector<std::string>& operations, std::int32_t valid_ms);

  const SystemClock clock;
  LcmPort port;
  Result<> usable;
  ClientKeys keys;
  const Origin origin;
  std::mutex mutex;                          // of what follows
  std::int64_t issue = 0;                    // the last
  std::map<std::string, std::int64_t> sent;  // by device
};

// Locked until it is published, so that permits go out in the order of their numbers.
bool PermitIssuer::State::Issue(const std::string& device, const std::vector<std::string>& operations,
                                std::int32_t valid_ms) {
  if (!usable || valid_ms < 1 || valid_ms > kMaxValidMs || !FitsPermit(device, operations)) return false;
  const std::lock_guard lock(mutex);
  permit_body_t body{};
  body.device = device;
  body.issuer_boot_id = origin.boot_id;
  body.issue = ++issue;
  body.issued_utime = clock.UtcMicroseconds();
  body.valid_ms = valid_ms;
  body.operations = operations;
  permit_t permit = MakePermit(std::move(body), keys.own.get());
  permit.utime = clock.UtcMicroseconds();
  permit.mono_ns = clock.Now();
  origin.Set(permit);
  permit.seq = sent[device]++;
  const std::int64_t unsent = port.unsent();
  return Publish(port, "PERMIT/" + device, permit) && port.unsent() == unsent;
}

PermitIssuer::PermitIssuer(const ClientSettings& settings) : state_(std::make_unique<State>(settings)) {}
PermitIssuer::~PermitIssuer() = default;
PermitIssuer::PermitIssuer(PermitIssuer&& other) noexcept = default;
PermitIssuer& PermitIssuer::operator=(PermitIssuer&& other) noexcept = default;

Result<> PermitIssuer::state() const {
  return state_ ? state_->usable : Result<>(Failure("this issuer was moved from"));
}

bool PermitIssuer::Allow(const std::string& device, const std::vector<std::string>& operations,
                         std::int32_t valid_ms) {
  return state_ && state_->Issue(device, operations, valid_ms);
}

bool PermitIssuer::Withdraw(const std::string& device) { return state_ && state_->Issue(device, {}, kMaxValidMs); }

}  // namespace axlecast
