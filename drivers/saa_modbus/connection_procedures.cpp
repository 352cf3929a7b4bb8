#include "drivers/saa_modbus/connection_procedures.h"

#include <axlecast/command_status_t.hpp>

#include "core/device/operation.h"

namespace axlecast::saa_modbus {
namespace {

using Reason = command_status_t;

long long Shown(std::int64_t baud) { return static_cast<long long>(baud); }

}  // namespace

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

SetBaud::SetBaud(std::int64_t baud, Connection& connection)
    : before_(connection.baud),
      baud_(baud),
      connection_(connection),
      search_({connection.address, baud}, {connection.address, connection.baud}, connection) {}

Want SetBaud::Next(MonoNs now) const {
  switch (stage_) {
    case Stage::kReadBefore:
      return ReadAt{connection_.address};
    case Stage::kTryPort:
      return PortBaud{baud_};
    case Stage::kSend:
      if (connection_.port_baud != before_) return PortBaud{before_};
      return Send{SetParameterRequest(connection_.address, *BaudParameter(baud_))};
    default:
      return search_.Next(now);
  }
}

std::optional<Outcome> SetBaud::OnStarted(Bytes, MonoNs) {
  sent_ = sent_ || stage_ == Stage::kSend;
  return std::nullopt;
}

void SetBaud::OnRetuned(MonoNs now) {
  if (stage_ == Stage::kTryPort) stage_ = Stage::kSend;
  if (stage_ == Stage::kSearch) search_.OnRetuned(now);
}

std::optional<Outcome> SetBaud::OnAnswer(const Answer& answer, MonoNs) {
  switch (stage_) {
    case Stage::kReadBefore:
      return OnBefore(answer);
    case Stage::kSend:
      accepted_ = answer.ok();
      stage_ = Stage::kSearch;
      return std::nullopt;
    default:
      return OnSearched(answer);
  }
}

std::optional<Outcome> SetBaud::OnBefore(const Answer& answer) {
  if (!answer.ok()) {
    if (++failures_ < kTries) return std::nullopt;
    return Rejected(Reason::REASON_NO_REPLY,
                    Text("the encoder does not answer at %lld Bd (%s)", Shown(before_), ErrorName(*answer.error)));
  }
  if (baud_ == before_) {
    return WithBaud(
        Succeeded(true, Text("the encoder answers at %lld Bd already: nothing was written", Shown(baud_))), baud_);
  }
  stage_ = Stage::kTryPort;
  Outcome running;
  running.text = Text("the encoder answers at %lld Bd", Shown(before_));
  running.progress = 0.2F;
  return running;
}

std::optional<Outcome> SetBaud::OnSearched(const Answer& answer) {
  const char* echo = accepted_ ? "it accepted the change" : "no echo of the change was understood";
  switch (search_.OnAnswer(answer)) {
    case Search::Progress::kGoing:
      return std::nullopt;
    case Search::Progress::kFirst:
      connection_.baud = baud_;
      return WithBaud(
          Succeeded(true, Text("the encoder answers at %lld Bd and the driver follows until it is restarted: "
                               "put link.baud: %lld into the file",
                               Shown(baud_), Shown(baud_))),
          baud_);
    case Search::Progress::kSecond:
      return WithBaud(Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                            Text("%s, but the encoder still answers at %lld Bd", echo, Shown(before_))),
                      before_);
    default:
      return Final(
          CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
          Text("%s, and the encoder answers neither at %lld nor at %lld Bd: turn its power off and on, then "
               "read_position after=\"set_baud baud=%lld\"",
               echo, Shown(baud_), Shown(before_), Shown(baud_)));
  }
}

Outcome SetBaud::OnLinkLost() const {
  if (sent_) {
    return Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
                 Text("the link was lost after the request: read_position after=\"set_baud baud=%lld\" when it is "
                      "back",
                      Shown(baud_)));
  }
  return Final(CommandState::kFailed, Reason::REASON_NO_REPLY,
               stage_ == Stage::kTryPort
                   ? Text("nothing was done: the port cannot do %lld Bd, or the link was lost", Shown(baud_))
                   : "nothing was done: the link was lost");
}

Outcome SetBaud::WithBaud(Outcome outcome, std::int64_t after) const {
  outcome.changes.push_back({"baud", std::to_string(before_), std::to_string(after)});
  return outcome;
}

}  // namespace axlecast::saa_modbus
