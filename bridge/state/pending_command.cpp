#include "bridge/state/pending_command.h"

#include <algorithm>

namespace axlecast {

std::int32_t PendingCommand::WritesAtMost() const {
  if (operation == nullptr || operation->writes == nullptr) return 0;
  Arguments pairs;
  for (const argument_t& argument : arguments) pairs.emplace_back(argument.key, argument.value);
  return operation->writes(pairs);
}

std::string ArgumentOf(const PendingCommand& pending, std::string_view key) {
  const auto found = std::find_if(pending.arguments.begin(), pending.arguments.end(),
                                  [&](const argument_t& argument) { return argument.key == key; });
  return found == pending.arguments.end() ? "" : found->value;
}

std::string ChangedTo(const command_status_t& status, std::string_view key) {
  const auto found = std::find_if(status.changes.begin(), status.changes.end(),
                                  [&](const change_t& change) { return change.key == key; });
  return found == status.changes.end() ? "" : found->after;
}

}  // namespace axlecast
