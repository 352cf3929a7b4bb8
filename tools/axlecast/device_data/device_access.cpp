#include "tools/axlecast/device_data/device_access.h"

#include <algorithm>
#include <iostream>

#include "core/device/operation.h"
#include "core/device/parameter.h"
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/device_data/parameters.h"

namespace axlecast {
namespace {

CommandRequest WriteRequest(const CommandOptions& options, const CellRun& run) {
  return {.device = options.device,
          .operation = "eeprom_write",
          .arguments = {{"address", std::to_string(run.address)}, {"data", HexText(run.after)}},
          .valid_ms = options.valid_ms,
          .reason = options.reason};
}

CommandRequest Request(const CommandOptions& options, const char* operation) {
  return {.device = options.device,
          .operation = operation,
          .valid_ms = options.valid_ms,
          .expect_epoch = options.epoch,
          .reason = options.reason};
}

constexpr const char* kReason = "acceptance";

bool IsPlainRead(const OperationSpec& operation) {
  return operation.reads_only && !operation.internal && !operation.executed_by_bridge &&
         std::none_of(operation.arguments.begin(), operation.arguments.end(),
                      [](const ArgumentSpec& argument) { return argument.required; });
}

void AddValues(const BusConfig& bus, const DeviceRead& read, FindingGroup& group) {
  const std::vector<change_t>& changes = read.result.status.changes;
  const auto values = FromRegisters(bus.family->parameters, changes);
  if (values && !values->empty()) {
    for (const ParameterValue& value : *values) {
      group.Add(std::string(value.parameter->name), ValueText(value));
    }
    return;
  }
  for (const change_t& change : changes) {
    group.Add(read.operation + ": " + change.key, change.after);
  }
  if (changes.empty()) group.Add(read.operation, read.result.status.text, Verdict::kGood);
}

}  // namespace

PermittedCells QueryPermitted(OperatorClient& client, const CommandOptions& options, const MemoryCells& present,
                              const MemoryCells& wanted) {
  PermittedCells permitted;
  for (const CellRun& cell : CellRuns(present, wanted, 1)) {
    CommandRequest request = WriteRequest(options, cell);
    request.prepare = true;
    CommandResult result = client.Execute(request);
    if (result.outcome() == CommandOutcome::kPrepared) {
      permitted.cells[cell.address] = cell.after.front();
    } else if (result.answered && result.status.reason_code == command_status_t::REASON_NOT_PERMITTED) {
      permitted.not_permitted.push_back(cell.address);
    } else {
      permitted.failed = std::move(result);
      break;
    }
  }
  return permitted;
}

CommandResult WriteCells(OperatorClient& client, const CommandOptions& options, const CellRun& run) {
  return client.Execute(WriteRequest(options, run));
}

ParameterReading ReadParameters(OperatorClient& client, const Family& family, const CommandOptions& options) {
  ParameterReading reading;
  reading.result = client.Execute(Request(options, "read_parameters"));
  if (ExitCode(reading.result) == kExitDone) {
    reading.values = FromRegisters(family.parameters, reading.result.status.changes);
  }
  return reading;
}

std::vector<CommandResult> WriteParameters(OperatorClient& client, const CommandOptions& options,
                                           const ParameterChanges& changes) {
  std::vector<CommandResult> results;
  for (const CommandRequest& request : WriteRequests(options, changes)) {
    results.push_back(client.Execute(request));
    if (ExitCode(results.back()) != kExitDone) break;
  }
  return results;
}

std::vector<CommandRequest> WriteRequests(const CommandOptions& options, const ParameterChanges& changes) {
  std::vector<CommandRequest> requests;
  for (std::size_t begin = 0; begin < changes.size(); begin += kMaxArguments) {
    CommandRequest& request = requests.emplace_back(Request(options, "write_parameters"));
    for (std::size_t i = begin; i < std::min(begin + kMaxArguments, changes.size()); ++i) {
      request.arguments.emplace_back(changes[i].parameter->name,
                                     ParameterText(*changes[i].parameter, changes[i].after));
    }
  }
  return requests;
}

bool IsDone(const CommandResult& result) {
  return ExitCode(result) == kExitDone || ExitCode(result) == kExitUnverifiable;
}

int PrintOutcome(const CommandResult& result) {
  std::cerr << ToText(result);
  return ExitCode(result);
}

std::vector<DeviceRead> ReadEverything(OperatorClient& client, const BusConfig& bus, const std::string& device) {
  std::vector<DeviceRead> reads;
  for (const OperationSpec* operation : OperationsOf(bus)) {
    if (!IsPlainRead(*operation)) continue;
    reads.push_back(
        {std::string(operation->name),
         client.Execute({.device = device, .operation = std::string(operation->name), .reason = kReason})});
    if (!reads.back().result.answered) break;  // no bridge: it will not answer the next one either
    // It needs one of several arguments.
    if (reads.back().result.status.reason_code == command_status_t::REASON_BAD_ARGUMENT) reads.pop_back();
  }
  return reads;
}

FindingGroup ReadFindings(const BusConfig& bus, const std::vector<DeviceRead>& reads) {
  FindingGroup group{"Read from the device", {}};
  for (const DeviceRead& read : reads) {
    if (IsDone(read.result)) {
      AddValues(bus, read, group);
    } else {
      group.Add(read.operation, read.result.answered ? read.result.status.text : read.result.problem,
                Verdict::kAttention, "axlecast do DEVICE " + read.operation + " shows more");
    }
  }
  if (reads.empty()) group.Add("reads", "this family has none");
  return group;
}

}  // namespace axlecast
