#include "tools/axlecast/device_data/parameter_transfer.h"

#include <algorithm>

#include "core/device/parameter.h"
#include "tools/axlecast/common/exit_code.h"

namespace axlecast {
namespace {

constexpr std::size_t kMaxArguments = 16;  // of a command

CommandRequest Request(const CommandOptions& wish, const char* operation) {
  return {.device = wish.device,
          .operation = operation,
          .valid_ms = wish.valid_ms,
          .expect_epoch = wish.epoch,
          .reason = wish.reason};
}

}  // namespace

ParameterReading ReadParameters(OperatorClient& client, const Family& family, const CommandOptions& wish) {
  ParameterReading reading;
  reading.result = client.Execute(Request(wish, "read_parameters"));
  if (ExitCode(reading.result) == kExitDone) {
    reading.values = FromRegisters(family.parameters, reading.result.status.changes, reading.problem);
  }
  return reading;
}

std::vector<CommandResult> WriteParameters(OperatorClient& client, const CommandOptions& wish,
                                           const ParameterChanges& changes) {
  std::vector<CommandResult> results;
  for (const CommandRequest& request : WriteRequests(wish, changes)) {
    results.push_back(client.Execute(request));
    if (ExitCode(results.back()) != kExitDone) break;
  }
  return results;
}

std::vector<CommandRequest> WriteRequests(const CommandOptions& wish, const ParameterChanges& changes) {
  std::vector<CommandRequest> requests;
  for (std::size_t begin = 0; begin < changes.size(); begin += kMaxArguments) {
    CommandRequest& request = requests.emplace_back(Request(wish, "write_parameters"));
    for (std::size_t i = begin; i < std::min(begin + kMaxArguments, changes.size()); ++i) {
      request.arguments.emplace_back(changes[i].parameter->name,
                                     ParameterText(*changes[i].parameter, changes[i].after));
    }
  }
  return requests;
}

}  // namespace axlecast
