#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <utility>

#include "core/base/time.h"
#include "core/device/line_settings.h"
#include "core/device/link.h"
#include "core/device/probe.h"
#include "core/device/step.h"
#include "drivers/runtime/bus/stale_reply_guard.h"

namespace axlecast {

// Executes one step at a time on a link, and returns the event that ended it, with its timestamps. Allocates nothing.
//
// An event, including its spans, is valid until the next call. Null: nothing happened.
class Transactor {
 public:
  virtual ~Transactor() = default;

  // Returns kUnexpectedBytes if bytes have come without a request, or kLinkDown. Called before every exchange.
  [[nodiscard]] virtual const Event* FindStray() = 0;

  // Executes the step, which must outlive the event. Idle and Listen return null at `by`, or when woken. A step that this
  // kind of bus does not support ends as kLinkDown.
  [[nodiscard]] virtual const Event* Run(const Step& step, MonoNs by) = 0;
};

// Executes steps on a CAN bus: Send, Listen and Idle. Each Listen or Idle returns the next received frame, in order.
class CanTransactor final : public Transactor {
 public:
  CanTransactor(FrameLink& link, const Clock& clock) : link_(link), clock_(clock) {}

  [[nodiscard]] const Event* FindStray() override { return nullptr; }
  [[nodiscard]] const Event* Run(const Step& step, MonoNs by) override;

 private:
  [[nodiscard]] const Event* Transmit(const CanFrame& frame);
  // Returns a frame, or null at `by` or when woken.
  [[nodiscard]] const Event* Receive(MonoNs by);
  [[nodiscard]] const Event* Arrived();
  [[nodiscard]] const Event* Ended(Event::Kind kind, Interval at);

  FrameLink& link_;
  const Clock& clock_;
  FrameLink::Received received_;
  Event event_;
};

// Executes the steps of a probe until the probe has ended or `stop`, which is called before every step, returns true.
// Returns false if the link is lost. `guard` has one device and outlives all probes of one line. It delays a request while
// a late reply to an earlier request could look like its reply.
[[nodiscard]] bool RunProbe(Probe& probe, Transactor& transactor, const Clock& clock, StaleReplyGuard& guard,
                            const std::function<bool()>& stop);

// Executes steps on a line of bytes: all except Send. Half duplex: it never transmits while bytes are unread.
class SerialTransactor final : public Transactor {
 public:
  // `echo`: the adapter receives its own transmission. The reply then follows the bytes of the request. An echo that
  // differs from the request ends the exchange as kTimeout with all bytes.
  // `lines` may be null: a pulse then ends as kLinkDown.
  // `line`: the format at which the link opens; without baud it is unknown. A reply that comes sooner than the wire can
  // carry request and reply answers an earlier request: it becomes unexpected bytes, and the exchange continues.
  SerialTransactor(ByteLink& link, const Clock& clock, bool echo, PulseLines* lines, const LineFormat& line = {})
      : link_(link), clock_(clock), echo_(echo), lines_(lines), opened_(line), line_(line) {}

  // `notify` is called after each request was written, before its reply is awaited: time that the line does not need.
  void NotifyTransmitted(std::function<void()> notify) { transmitted_ = std::move(notify); }

  [[nodiscard]] const Event* FindStray() override;
  [[nodiscard]] const Event* Run(const Step& step, MonoNs by) override;

  // Transmits the request, which must outlive the event, or the pulse, and collects the reply: kReply, kTimeout or
  // kLinkDown.
  [[nodiscard]] const Event* Run(const Exchange& exchange);
  // kPulsed or kLinkDown.
  [[nodiscard]] const Event* Run(const Pulse& pulse);
  // kBaudRateSet or kLinkDown.
  [[nodiscard]] const Event* Run(const SetBaudRate& change);
  // kSilent, kUnexpectedBytes (more may follow: wait again) or kLinkDown.
  [[nodiscard]] const Event* Run(const WaitForIdleLine& idle);
  // kUnsolicited, kSilent at listen.until, or kLinkDown. Null at `by`, or when woken.
  [[nodiscard]] const Event* Run(const Listen& listen, MonoNs by);
  // Sleeps until `by` or until woken (null), or until bytes come: kUnexpectedBytes or kLinkDown.
  [[nodiscard]] const Event* Sleep(MonoNs by);

 private:
  [[nodiscard]] bool Transmit(const Exchange& exchange);
  [[nodiscard]] bool Transmit(const Pulse& pulse) {
    return lines_ != nullptr && lines_->Pulse(pulse.line, pulse.low);
  }
  [[nodiscard]] const Event* Collect(const Exchange& exchange, MonoNs deadline);
  [[nodiscard]] const Event* Complete(std::size_t begin, std::size_t length, std::size_t count);
  [[nodiscard]] const Event* TimedOut(std::size_t begin, std::size_t count);
  // The reply is buffer_[begin, begin + length). Sets event_.received.
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
  std::function<void()> transmitted_;
  LineFormat line_;  // now
  Event event_;
  static constexpr MonoNs kLongAgo = INT64_MIN / 2;
  // A look for strays may take the end of a wait for its own: the wait looked at the port at its end. A thread that was interrupted
  // since then looks again.
  static constexpr MonoNs kJustWaited = 20 * kMicrosecond;
  struct Read {
    std::size_t end = 0;  // index behind its last byte
    MonoNs at = 0;
  };
  std::array<Read, 64> reads_{};  // of the exchange
  std::size_t read_count_ = 0;
  MonoNs masked_until_ = 0;  // received bytes may be the late reply to a secret
  Frame masked_head_;        // begin of the secret's request: address and function
  Frame early_;              // a reply that came too early; unexpected bytes at the next slot
  bool early_waits_ = false;
  MonoNs empty_at_ = kLongAgo;  // a wait for bytes ended without any
  Bytes excess_;                // bytes beyond the length of the last reply: unexpected bytes at the next slot
  std::array<std::uint8_t, 2 * kMaxFrame> buffer_{};  // an echo and a reply
};

}  // namespace axlecast
