#include "bridge/logged_journal.h"

#include <spdlog/spdlog.h>

#include "drivers/runtime/command/command_words.h"
#include "drivers/runtime/command/order_ledger.h"

namespace axlecast {

bool LoggedJournal::Accepted(const command_status_t& status, MonoNs now, MonoNs keep_until) {
  const bool noted = journal_.Accepted(status, now, keep_until);
  spdlog::info("{} {} {}: {}", IdText(IdOf(status.id)), status.device, status.operation,
               noted ? StateName(status.state) : "the journal is full");
  return noted;
}

void LoggedJournal::Outcome(const command_status_t& status) {
  journal_.Outcome(status);
  const bool good = status.state == command_status_t::STATE_SUCCEEDED;
  spdlog::log(good ? spdlog::level::info : spdlog::level::warn, "{} {} {}: {}{} {}", IdText(IdOf(status.id)),
              status.device, status.operation, StateName(status.state), status.verified != 0 ? ", verified" : "",
              status.text);
}

}  // namespace axlecast
