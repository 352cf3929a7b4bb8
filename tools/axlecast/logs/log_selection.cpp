#include "tools/axlecast/logs/log_selection.h"

#include <iostream>

#include "tools/axlecast/common/exit_code.h"
#include "tools/log/log_reader.h"

namespace axlecast {

void LogSelection::AddTo(CLI::App& command) {
  command.add_option("LOG", file_, "An LCM event log, of axlecast record or lcm-logger")->required();
  choice_.AddTo(command);
}

std::optional<int> LogSelection::Open() {
  if (!input_.Open(file_)) return kExitBad;
  input_.Read("", [](const LogEvent&, std::size_t) { return false; });
  if (input_.ExitCode() == kExitBad) return kExitBad;
  if (const std::string problem = choice_.Understand(input_.log()); !problem.empty()) {
    std::cerr << problem << '\n';
    return kExitUsage;
  }
  return std::nullopt;
}

void LogSelection::Visit(const EventVisitor& visit, bool filtered) {
  LogReader reader(input_.log(), choice_.Begin(input_.log()));
  while (const std::optional<LogEvent> event = reader.Next()) {
    if (choice_.EndsAt(*event)) break;
    if (!(filtered ? choice_.Takes(*event) : choice_.TakesTime(*event))) continue;
    if (!visit(*event)) return;
  }
  damaged_bytes_ = DamagedBytes(reader.damage());
}

EventRange LogSelection::events() {
  return [this](const EventVisitor& visit) { Visit(visit, true); };
}

EventRange LogSelection::all() {
  return [this](const EventVisitor& visit) { Visit(visit, false); };
}

}  // namespace axlecast
