#include "bridge/state/pending_command.h"

namespace axlecast {

std::int32_t PendingCommand::WritesAtMost() const {
  if (operation == nullptr || operation->writes == nullptr) return 0;
  Arguments pairs;
  for (const argument_t& argument : arguments) pairs.emplace_back(argument.key, argument.value);
  return operation->writes(pairs);
}

}  // namespace axlecast
