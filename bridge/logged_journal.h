#pragma once

#include "bridge/journal.h"

namespace axlecast {

// Writes a line to the log for each command and each outcome; the rest is the journal's behind it.
class LoggedJournal final : public Journal {
 public:
  explicit LoggedJournal(Journal& journal) : journal_(journal) {}

  [[nodiscard]] bool Accepted(const command_status_t& status, MonoNs now, MonoNs keep_until) override;
  void Step(const command_status_t& status) override { journal_.Step(status); }
  void Outcome(const command_status_t& status) override;
  [[nodiscard]] std::optional<command_status_t> Find(const CommandId& id) const override {
    return journal_.Find(id);
  }

 private:
  Journal& journal_;
};

}  // namespace axlecast
