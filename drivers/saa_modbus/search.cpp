#include "drivers/saa_modbus/search.h"

namespace axlecast::saa_modbus {

Want Search::Next(MonoNs now) const {
  if (connection_.port_baud != place().baud) return PortBaud{place().baud};
  if (now < due_) return WaitUntil{due_};
  return ReadAt{place().address};
}

Search::Progress Search::OnAnswer(const Answer& answer) {
  if (answer.ok()) {
    counts_ = answer.reply.counts;
    return tried_ == 0 ? Progress::kFirst : Progress::kSecond;
  }
  if (++failures_ < kTries) return Progress::kGoing;
  failures_ = 0;
  if (tried_ + 1 == places_.size()) return Progress::kNowhere;
  ++tried_;
  return Progress::kGoing;
}

}  // namespace axlecast::saa_modbus
