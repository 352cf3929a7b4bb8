#include "drivers/kit/asking_probe.h"

namespace axlecast {

std::optional<Step> AskingProbe::Next(MonoNs) const {
  if (lost_ || Disturbed()) return std::nullopt;
  const std::optional<Question> question = Ask();
  if (!question) return std::nullopt;
  if (!quiet_) return Step{.action = WaitForIdleLine{question->quiet}, .priority = Priority::kCommand};
  return Step{.action = question->exchange, .priority = Priority::kCommand};
}

void AskingProbe::On(const Event& event) {
  switch (event.kind) {
    case Event::Kind::kSilent:
      quiet_ = true;
      return;
    case Event::Kind::kReply:
    case Event::Kind::kTimeout:
      quiet_ = false;
      strays_ = 0;
      return Judge(event);
    case Event::Kind::kLinkDown:
      lost_ = true;
      return;
    default:  // bytes of somebody else, or late ones
      quiet_ = false;
      ++strays_;
  }
}

}  // namespace axlecast
