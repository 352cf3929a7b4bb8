#include "tests/campaign/status_listener.h"

#include "core/command/commands.h"
#include "core/messages/message.h"

namespace axlecast {

StatusListener::StatusListener(const std::string& url, const std::string& prefix) : port_(url, prefix) {
  port_.Subscribe("COMMAND_STATUS", [this](const auto&, Bytes bytes) {
    const auto status = DecodeMessage<command_status_t>(bytes);
    if (!status || status->is_final == 0) return;
    const std::lock_guard lock(mutex_);
    Told& told = told_[IdOf(status->id)];
    told.states.insert(status->state);
    if (status->finding != command_status_t::FINDING_NONE) told.findings.insert(status->finding);
  });
  thread_ = std::thread([this] { Run(); });
}

StatusListener::~StatusListener() {
  ending_ = true;
  thread_.join();
}

std::map<CommandId, StatusListener::Told> StatusListener::told() const {
  const std::lock_guard lock(mutex_);
  return told_;
}

void StatusListener::Run() {
  while (!ending_ && port_.Handle(50)) {
  }
}

}  // namespace axlecast
