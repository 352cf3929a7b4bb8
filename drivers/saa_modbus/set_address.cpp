#include "drivers/saa_modbus/set_address.h"

#include <axlecast/command_status_t.hpp>

#include "core/device/operation.h"

namespace axlecast::saa_modbus {

using Reason = command_status_t;

SetAddress::SetAddress(std::uint8_t from, std::uint8_t to, Connection& connection)
    : from_(from),
      to_(to),
      connection_(connection),
      search_({to, connection.baud}, {from, connection.baud}, connection) {}

Want SetAddress::Next(MonoNs now) const {
  switch (stage_) {
    case Stage::kReadBefore:
      return ReadAt{from_};
    case Stage::kProbe:
      return ReadAt{to_};
    case Stage::kSend:
      return Send{SetAddressRequest(from_, to_)};
    default:
      return search_.Next(now);
  }
}

std::optional<Outcome> SetAddress::OnStarted(Bytes, MonoNs) {
  sent_ = sent_ || stage_ == Stage::kSend;
  return std::nullopt;
}

std::optional<Outcome> SetAddress::OnAnswer(const Answer& answer, MonoNs end) {
  switch (stage_) {
    case Stage::kReadBefore:
      return OnBefore(answer);
    case Stage::kProbe:
      return OnProbed(answer);
    case Stage::kSend:
      accepted_ = answer.ok();
      stage_ = Stage::kSearch;
      search_.Start(end + Search::kSettle);
      return std::nullopt;
    default:
      return OnSearched(answer);
  }
}

std::optional<Outcome> SetAddress::OnBefore(const Answer& answer) {
  if (!answer.ok()) {
    if (++failures_ < kTries) return std::nullopt;
    return Rejected(Reason::REASON_NO_REPLY,
                    Text("no encoder answers at address %d (%s)", int{from_}, ErrorName(*answer.error)));
  }
  if (from_ == to_) {
    connection_.address = to_;
    return WithAddress(
        Succeeded(true, Text("the encoder answers at address %d already: nothing was written", int{to_})), to_);
  }
  stage_ = Stage::kProbe;
  failures_ = 0;
  return std::nullopt;
}

// WaitForIdleLine is the good answer, several times: a reply may be lost. Any byte shows that somebody is there.
std::optional<Outcome> SetAddress::OnProbed(const Answer& answer) {
  if (answer.error != ErrorKind::kTimeout) {
    return Rejected(
        Reason::REASON_NOT_PERMITTED,
        Text("something answers at address %d: choose another, or give that device another address first",
             int{to_}));
  }
  if (++failures_ < kTries) return std::nullopt;
  stage_ = Stage::kSend;
  Outcome running;
  running.text = Text("the encoder answers at address %d, nobody at %d", int{from_}, int{to_});
  running.progress = 0.3F;
  return running;
}

std::optional<Outcome> SetAddress::OnSearched(const Answer& answer) {
  const char* reply = accepted_ ? "it answered from the new address" : "no reply to the change was understood";
  switch (search_.OnAnswer(answer)) {
    case Search::Progress::kGoing:
      return std::nullopt;
    case Search::Progress::kFirst:
      return WithAddress(
          Succeeded(true, Text("the encoder answers at address %d and the driver follows until it is "
                               "restarted: put address: %d into the file",
                               int{to_}, int{to_})),
          to_);
    case Search::Progress::kSecond:
      return WithAddress(Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                               Text("%s, but the encoder still answers at address %d", reply, int{from_})),
                         from_);
    default:
      return Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
                   Text("%s, and the encoder answers neither at address %d nor at %d: read_position "
                        "after=\"set_address address=%d\"",
                        reply, int{to_}, int{from_}, int{to_}));
  }
}

Outcome SetAddress::OnLinkLost() const {
  if (sent_) {
    return Final(
        CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
        Text("the link was lost after the request: read_position after=\"set_address address=%d\" when it is "
             "back",
             int{to_}));
  }
  return Final(CommandState::kFailed, Reason::REASON_NO_REPLY, "nothing was done: the link was lost");
}

Outcome SetAddress::WithAddress(Outcome outcome, std::uint8_t after) const {
  outcome.changes.push_back({"address", std::to_string(from_), std::to_string(after)});
  return outcome;
}

}  // namespace axlecast::saa_modbus
