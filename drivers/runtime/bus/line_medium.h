#pragma once

#include <array>
#include <cstddef>

#include "drivers/runtime/bus/medium.h"
#include "drivers/runtime/core/byte_link.h"
#include "drivers/runtime/core/clock.h"
#include "drivers/runtime/core/pulse_lines.h"

namespace axlecast {

// Steps on a line of bytes, all but Send. Half duplex: it never transmits while bytes lie unread.
class LineMedium final : public Medium {
 public:
  // With `echo` the adapter hears its own transmission: a reply then counts only after the request's own bytes, and
  // an echo that differs from the request ends the exchange as kTimeout with all bytes.
  // `lines` may be null: a pulse then ends as kLinkDown.
  LineMedium(ByteLink& link, const Clock& clock, bool echo, PulseLines* lines)
      : link_(link), clock_(clock), echo_(echo), lines_(lines) {}

  [[nodiscard]] const Event* FindStray() override;
  [[nodiscard]] const Event* Run(const Step& step, MonoNs by) override;

  // Transmits the request, which must outlive the event, or gives the pulse, and collects the reply: kReply,
  // kTimeout or kLinkDown.
  [[nodiscard]] const Event* Run(const Exchange& exchange);
  // kPulsed or kLinkDown.
  [[nodiscard]] const Event* Run(const Pulse& pulse);
  // kRetuned or kLinkDown.
  [[nodiscard]] const Event* Run(const Retune& retune);
  // kSilent, kStray (more may follow: ask for silence again) or kLinkDown.
  [[nodiscard]] const Event* Run(const Silence& silence);
  // Returns at `by` at the latest, or when woken: null. Else kUnsolicited, kSilent at listen.until, or kLinkDown.
  [[nodiscard]] const Event* Run(const Listen& listen, MonoNs by);
  // Sleeps until `by`, until woken (null), or until bytes come: kStray or kLinkDown.
  [[nodiscard]] const Event* Sleep(MonoNs by);

 private:
  [[nodiscard]] bool Ask(const Exchange& exchange);
  [[nodiscard]] bool Give(const Pulse& pulse) { return lines_ != nullptr && lines_->Pulse(pulse.line, pulse.low); }
  [[nodiscard]] const Event* Collect(const Exchange& exchange, MonoNs deadline);
  [[nodiscard]] const Event* Complete(std::size_t skip, std::size_t length, std::size_t count);
  [[nodiscard]] const Event* TimedOut(std::size_t skip, std::size_t count);
  [[nodiscard]] const Event* Arrived(Event::Kind kind, std::size_t count);
  [[nodiscard]] const Event* Silent(MonoNs since);
  [[nodiscard]] const Event* Excess();
  [[nodiscard]] const Event* Lost();
  [[nodiscard]] bool EchoMatches(std::size_t skip) const;

  ByteLink& link_;
  const Clock& clock_;
  const bool echo_;
  PulseLines* const lines_;
  Event event_;
  MonoNs masked_until_ = 0;  // what comes may be the late reply to a secret
  Bytes excess_;             // came with the last reply, beyond its length: stray at the next turn
  std::array<std::uint8_t, 2 * kMaxFrame> buffer_{};  // an echo and a reply
};

}  // namespace axlecast
