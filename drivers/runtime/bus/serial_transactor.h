#pragma once

#include <array>
#include <cstddef>

#include "core/base/time.h"
#include "core/device/line_settings.h"
#include "core/device/link.h"
#include "drivers/runtime/bus/transactor.h"

namespace axlecast {

// Steps on a line of bytes, all but Send. Half duplex: it never transmits while bytes lie unread.
class SerialTransactor final : public Transactor {
 public:
  // With `echo` the adapter hears its own transmission: a reply then counts only after the request's own bytes, and
  // an echo that differs from the request ends the exchange as kTimeout with all bytes.
  // `lines` may be null: a pulse then ends as kLinkDown.
  // `line` is the format at which the link opens; without baud nothing is known of it. What looks like a reply but has
  // come sooner than the wire can carry request and reply answers an earlier request: it becomes stray, and the
  // exchange goes on.
  SerialTransactor(ByteLink& link, const Clock& clock, bool echo, PulseLines* lines, const LineFormat& line = {})
      : link_(link), clock_(clock), echo_(echo), lines_(lines), opened_(line), line_(line) {}

  [[nodiscard]] const Event* FindStray() override;
  [[nodiscard]] const Event* Run(const Step& step, MonoNs by) override;

  // Transmits the request, which must outlive the event, or gives the pulse, and collects the reply: kReply,
  // kTimeout or kLinkDown.
  [[nodiscard]] const Event* Run(const Exchange& exchange);
  // kPulsed or kLinkDown.
  [[nodiscard]] const Event* Run(const Pulse& pulse);
  // kBaudRateSet or kLinkDown.
  [[nodiscard]] const Event* Run(const SetBaudRate& retune);
  // kSilent, kUnexpectedBytes (more may follow: ask for silence again) or kLinkDown.
  [[nodiscard]] const Event* Run(const WaitForIdleLine& silence);
  // Returns at `by` at the latest, or when woken: null. Else kUnsolicited, kSilent at listen.until, or kLinkDown.
  [[nodiscard]] const Event* Run(const Listen& listen, MonoNs by);
  // Sleeps until `by`, until woken (null), or until bytes come: kUnexpectedBytes or kLinkDown.
  [[nodiscard]] const Event* Sleep(MonoNs by);

 private:
  [[nodiscard]] bool Ask(const Exchange& exchange);
  [[nodiscard]] bool Give(const Pulse& pulse) { return lines_ != nullptr && lines_->Pulse(pulse.line, pulse.low); }
  [[nodiscard]] const Event* Collect(const Exchange& exchange, MonoNs deadline);
  [[nodiscard]] const Event* Complete(std::size_t begin, std::size_t length, std::size_t count);
  [[nodiscard]] const Event* TimedOut(std::size_t begin, std::size_t count);
  // The reply is buffer_[begin, begin + length); sets event_.received.
  [[nodiscard]] bool TooEarly(const Exchange& exchange, std::size_t begin, std::size_t length);
  void NoteRead(std::size_t end);
  [[nodiscard]] MonoNs ArrivalOf(std::size_t index) const;
  [[nodiscard]] const Event* Arrived(Event::Kind kind, std::size_t count);
  [[nodiscard]] const Event* Silent(MonoNs since);
  [[nodiscard]] const Event* Excess();
  [[nodiscard]] const Event* Lost();
  [[nodiscard]] std::size_t EchoSize() const { return echo_ ? event_.request.size() : 0; }
  [[nodiscard]] bool EchoMatches() const;
  [[nodiscard]] bool HasExcess() const { return early_waits_ || !excess_.empty(); }

  ByteLink& link_;
  const Clock& clock_;
  const bool echo_;
  PulseLines* const lines_;
  const LineFormat opened_;
  LineFormat line_;  // now
  Event event_;
  struct Read {
    std::size_t end = 0;  // index behind its last byte
    MonoNs at = 0;
  };
  std::array<Read, 64> reads_{};  // of the exchange
  std::size_t read_count_ = 0;
  MonoNs masked_until_ = 0;  // what comes may be the late reply to a secret
  Frame masked_head_;        // how the secret's request began: address and function
  Frame early_;              // came too early; stray at the next turn
  bool early_waits_ = false;
  Bytes excess_;  // came with the last reply, beyond its length: stray at the next turn
  std::array<std::uint8_t, 2 * kMaxFrame> buffer_{};  // an echo and a reply
};

}  // namespace axlecast
