#include "tools/axlecast/device_data/device_reads.h"

#include <algorithm>

#include "tools/axlecast/command/command_report.h"
#include "tools/axlecast/command/do_request.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/device_data/parameter_values.h"

namespace axlecast {
namespace {

constexpr const char* kReason = "acceptance";

bool IsPlainRead(const OperationSpec& operation) {
  return operation.reads_only && !operation.internal && !operation.executed_by_bridge &&
         std::none_of(operation.arguments.begin(), operation.arguments.end(),
                      [](const ArgumentSpec& argument) { return argument.required; });
}

void AddValues(const BusConfig& bus, const DeviceRead& read, FindingGroup& group) {
  const std::vector<change_t>& changes = read.result.status.changes;
  std::string problem;
  const ParameterValues values =
      bus.family->parameters.empty() ? ParameterValues() : FromRegisters(bus.family->parameters, changes, problem);
  if (!values.empty() && problem.empty()) {
    for (const ParameterValue& value : values) {
      group.findings.push_back({std::string(value.parameter->name), ValueText(value), Verdict::kUnjudged, ""});
    }
    return;
  }
  for (const change_t& change : changes) {
    group.findings.push_back({read.operation + ": " + change.key, change.after, Verdict::kUnjudged, ""});
  }
  if (changes.empty()) group.findings.push_back({read.operation, read.result.status.text, Verdict::kGood, ""});
}

}  // namespace

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
    const int code = ExitCode(read.result);
    if (code == kExitDone || code == kExitUnverifiable) {
      AddValues(bus, read, group);
    } else {
      group.findings.push_back({read.operation,
                                read.result.answered ? read.result.status.text : read.result.problem,
                                Verdict::kAttention, "axlecast do DEVICE " + read.operation + " tells more"});
    }
  }
  if (reads.empty()) group.findings.push_back({"reads", "this family has none", Verdict::kUnjudged, ""});
  return group;
}

}  // namespace axlecast
