#include "tools/axlecast/operator_client.h"

#include <iostream>

#include "tools/axlecast/columns.h"

namespace axlecast {
namespace {

constexpr std::int64_t kWaitMs = 60'000;  // the longest operation reads or writes a whole EEPROM

void Tell(const command_status_t& status) {
  if (status.is_final != 0 || status.text.empty()) return;
  std::cerr << Right(Decimal(100.0 * status.progress, 0), 3) << " % " << Printable(status.text) << '\n';
}

}  // namespace

OperatorClient::OperatorClient(const MachineConfig& machine, bool tell)
    : port_(machine.lcm.command_url, machine.lcm.prefix), client_(port_, clock_) {
  options_.cancel = &CancelOnSignal::requested();
  if (tell) options_.on_status = Tell;
}

CommandResult OperatorClient::Execute(const CommandRequest& request) {
  options_.wait_ms = kWaitMs + request.valid_ms;
  return client_.Execute(request, options_);
}

CommandResult OperatorClient::Query(const CommandId& id) {
  options_.wait_ms = kWaitMs;
  return client_.Query(id, options_);
}

}  // namespace axlecast
