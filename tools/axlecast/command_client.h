#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "drivers/io/lcm_port.h"
#include "drivers/runtime/core/clock.h"
#include "tools/axlecast/command_session.h"

namespace axlecast {

// Sends commands to the bridge and follows each to its one outcome. One thread uses it.
class CommandClient {
 public:
  struct Options {
    std::int64_t wait_ms = 60'000;                           // in all; then the outcome counts as not known
    std::function<void(const command_status_t&)> on_status;  // each new state, progress or text; may be empty
    const std::atomic<bool>* cancel = nullptr;               // set (by a signal handler): ask for cancellation
  };

  // `port` is open on the machine's command_url with its prefix; `port` and `clock` outlive the client.
  CommandClient(LcmPort& port, const Clock& clock);
  ~CommandClient();
  CommandClient(const CommandClient&) = delete;
  CommandClient& operator=(const CommandClient&) = delete;

  [[nodiscard]] CommandResult Execute(const CommandRequest& request, const Options& options);
  // How the command `id` stands, without doing anything.
  [[nodiscard]] CommandResult Query(const CommandId& id, const Options& options);

 private:
  using Receiver = std::function<void(Bytes)>;

  [[nodiscard]] CommandResult Follow(CommandSession session, const Options& options);
  void Send(const std::vector<std::uint8_t>& body, MonoNs now);

  LcmPort& port_;
  const Clock& clock_;
  std::int64_t boot_id_;
  std::int64_t seq_ = 0;
  std::shared_ptr<Receiver> receiver_;  // the port's handler may outlive the client
};

// 0 done and verified, 3 rejected, expired or cancelled, 4 failed, 5 indeterminate, 6 no answer,
// 7 done but not verifiable.
[[nodiscard]] int ExitCode(const CommandResult& result);

// One flat object: `outcome` and `reason` as words, `found` as a word after an indeterminate outcome, `problem`
// where there is no final outcome, and the fields of command_status_t as they came; `id` alone when nothing came.
[[nodiscard]] nlohmann::ordered_json ToJson(const CommandResult& result);

// Several lines for a person: the outcome, what changed, what to do.
[[nodiscard]] std::string ToText(const CommandResult& result);

}  // namespace axlecast
