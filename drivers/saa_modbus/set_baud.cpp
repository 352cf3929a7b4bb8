#include "drivers/saa_modbus/set_baud.h"

#include <axlecast/command_status_t.hpp>

#include "core/device/operation.h"

namespace axlecast::saa_modbus {
namespace {

using Reason = command_status_t;

long long Shown(std::int64_t baud) { return static_cast<long long>(baud); }

}  // namespace

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
