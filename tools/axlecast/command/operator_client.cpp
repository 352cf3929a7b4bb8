#include "tools/axlecast/command/operator_client.h"

#include <cstdlib>
#include <iostream>

#include "client/command/client_key.h"
#include "core/base/text.h"
#include "platform/os/secret_file.h"
#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

constexpr std::int64_t kWaitMs = 60'000;  // the longest operation reads or writes a whole EEPROM
constexpr std::int64_t kLookMs = 50;      // for Ctrl-C

void Tell(const command_status_t& status) {
  if (status.is_final != 0 || status.text.empty()) return;
  std::cerr << Right(Decimal(100.0 * status.progress, 0), 3) << " % " << Printable(status.text) << '\n';
}

}  // namespace

ClientSettings OperatorSettings(const MachineConfig& machine, const std::string& key_file,
                                std::optional<Role> role) {
  ClientSettings settings = SettingsOf(machine);
  const char* const environment = std::getenv("AXLECAST_KEY");
  settings.key_file = key_file.empty() && environment != nullptr ? environment : key_file;
  if (!settings.key_file.empty()) return settings;
  SecretFiles secrets;
  if (const KeyGrant* grant = ReadableKey(machine, role, secrets)) {
    settings.key_file = grant->place.file;
    settings.key_credential = grant->place.credential;
  }
  return settings;
}

OperatorClient::OperatorClient(const MachineConfig& machine, const std::string& key_file, bool tell)
    : client_(OperatorSettings(machine, key_file)) {
  if (tell) client_.OnStatus(Tell);
}

CommandResult OperatorClient::Execute(const CommandRequest& request) {
  const SystemClock clock;
  const MonoNs give_up = clock.Now() + (kWaitMs + request.valid_ms) * kMillisecond;
  const CommandId id = client_.Send(request);
  while (true) {
    if (CancelOnSignal::requested()) client_.Cancel(id);
    CommandResult result = client_.Await(id, kLookMs);
    if (!result.under_way || clock.Now() >= give_up) return result;
  }
}

CommandResult OperatorClient::Query(const CommandId& id) { return client_.Query(id, kWaitMs); }

}  // namespace axlecast
